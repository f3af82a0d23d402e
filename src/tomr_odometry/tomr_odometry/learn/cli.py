"""`tomr_odometry learn`: the creep of floors from drives with a known pose, into a robot.yaml."""

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from tomr_odometry.creep import Creep
from tomr_odometry.learn.drives import Leg, read_legs
from tomr_odometry.learn.fit import Batch, fit_creep
from tomr_power_model.calibration.fitted import sections_text
from tomr_power_model.cli import EXIT_OK
from tomr_power_model.errors import InputError
from tomr_power_model.files import make_folder, write_together
from tomr_power_model.robot import load_robot, read_sections
from tomr_power_model.slides.body import body_of

ROBOT_FILE, REPORT_FILE, NODE = "robot_learnt.yaml", "learnt.json", "slip_odometry"
_EPILOG = """\
examples:
  tomr_odometry learn lab/* --robot my_robot.yaml --reference ground_truth/odom --out learnt
  tomr_odometry learn a b --floor lab=a --floor hall=b --reference tf:base_link --out learnt

One floor: each wheel's own creep, for that floor. Several floors: what they have in common, for
floors not seen, with its uncertainty. OUT/robot_learnt.yaml holds it (creep.*)."""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="tomr_odometry learn",
        description="Learn how wheels creep from drives with a reference pose.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("bags", type=Path, nargs="+", metavar="BAG")
    parser.add_argument("--robot", default="reference", help="robot.yaml or a shipped name")
    parser.add_argument("--reference", required=True, metavar="TOPIC", help="pose, or tf:CHILD")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="new folder")
    parser.add_argument(
        "--floor",
        action="append",
        default=[],
        metavar="NAME=BAG,BAG",
        help="which bags belong to which floor (default: all to one)",
    )
    parser.add_argument(
        "--turned", type=float, default=0.0, metavar="RAD", help="reference's heading less robot's"
    )
    return parser


def _floors(options: argparse.Namespace) -> dict[str, list[Path]]:
    """Bags by floor. Raises InputError for one that belongs to none or to several."""
    if not options.floor:
        return {"floor": list(options.bags)}
    found: dict[str, list[Path]] = {}
    for text in options.floor:
        name, equals, bags = text.partition("=")
        if not equals or not bags:
            raise InputError(f"--floor {text}: write NAME=BAG,BAG")
        found[name] = [Path(bag) for bag in bags.split(",")]
    named = [bag for bags in found.values() for bag in bags]
    for bag in options.bags:
        if named.count(bag) != 1:
            raise InputError(f"--floor: {bag} belongs to {named.count(bag)} floors: name one")
    return found


def learnt_text(source: str, creep: Creep, bags: Sequence[str]) -> str:
    """Text of a robot.yaml with the creep in the node's section, all other values as they were."""
    sections = read_sections(source)
    slashed, own = sections.pop(f"/{NODE}", {}), sections.pop(NODE, {})
    given = own or slashed  # as `read_node_sections` takes them
    kept = {name: value for name, value in given.items() if not name.startswith("creep.")}
    learnt = {
        "creep.coefficient": [float(f"{value:.5g}") for value in creep.coefficient],
        "creep.growth": float(f"{creep.growth:.5g}"),
        "creep.uncertainty": float(f"{creep.uncertainty:.3g}"),
    }
    header = [f"{source} with creep learnt from {', '.join(bags) or 'its drives'} (tomr_odometry)"]
    return sections_text({**sections, NODE: {**kept, **learnt}}, header)


def _report(floors: Mapping[str, Sequence[Leg]], creep: Creep, body: Any) -> dict[str, Any]:
    scores = {}
    for name, legs in floors.items():
        batch = Batch(legs, body)
        left = batch.errors(np.array(creep.coefficient), creep.growth)
        plain = batch.errors(np.zeros(3), 0.0)
        scores[name] = {
            "legs": len(legs),
            "end_error_of_wheels_m": float(np.median(plain)),
            "end_error_m": float(np.median(left)),
        }
    return {
        "coefficient": list(creep.coefficient),
        "growth": creep.growth,
        "uncertainty": creep.uncertainty,
        "floors": scores,
    }


def learn(arguments: Sequence[str] | None) -> int:
    """Body of the command."""
    options = _parser().parse_args(arguments)
    if options.out.exists():
        raise InputError(f"{options.out} exists already: remove it or choose another folder")
    robot, floors = load_robot(options.robot), {}
    body, _ = body_of(robot)
    for name, bags in _floors(options).items():
        legs: list[Leg] = []
        for bag in tqdm(bags, desc=name, disable=None):
            legs += read_legs(bag, robot, options.reference, options.turned)
        if not legs:
            raise InputError(f"{name}: no leg of 0.2 m or more with a known pose: drive further")
        floors[name] = legs
    creep = fit_creep(floors, body)
    found = _report(floors, creep, body)
    text = learnt_text(options.robot, creep, [str(bag) for bag in options.bags])
    report = json.dumps(found, indent=2, allow_nan=False)
    make_folder(options.out)
    write_together({options.out / ROBOT_FILE: text, options.out / REPORT_FILE: f"{report}\n"})
    coefficients = ", ".join(f"{value:.3g}" for value in creep.coefficient)
    print(f"creep: {coefficients}; growth {creep.growth:.3g} +- {creep.uncertainty:.2g}")
    for name, item in found["floors"].items():
        print(
            f"{name}: end error of the wheels {item['end_error_of_wheels_m']:.3f} m -> "
            f"{item['end_error_m']:.3f} m (median of {item['legs']} legs)"
        )
    return EXIT_OK
