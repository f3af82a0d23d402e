"""The fitted robot.yaml: complete, with where its values come from and which robot they belong to.

The header and the section of `tomr_calibrate` say what was fitted to what, how well, and to which
robot; reading the file as a robot description looks at that robot's identity again.
"""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

import numpy as np
import yaml
from numpy.typing import NDArray

from tomr_power_model.errors import one_line
from tomr_power_model.estimation.parameter import Parameter, ParameterisedRobot, Values
from tomr_power_model.robot import WHEELS, read_sections
from tomr_power_model.robot.description import split_effect
from tomr_power_model.robot.files import CALIBRATION, EVERY_NODE, IDENTITY

Array = NDArray[np.float64]
Tree = dict[str, "Tree | object"]

# What a calibration cannot change: another value means another robot.
IDENTITY_KEYS = (
    "robot.wheel_names",
    "robot.wheel_offset",
    "robot.robot_radius",
    "robot.wheel_radius",
    "motor.gear_ratio",
)
_DIGITS = 6


def fitted_text(
    source: Path | str,
    values: Values,
    parameters: Sequence[Parameter],
    numbers: Sequence[float] | Array,
    *,
    half_widths: Sequence[float] | Array,
    header: Sequence[str],
    provenance: Mapping[str, object],
) -> str:
    """Text of a robot.yaml with fitted values.

    Args:
        source: robot.yaml that was fitted; sections of single nodes are taken over.
        values: its description, flat.
        parameters: what was fitted.
        numbers: fitted values.
        half_widths: half of their 95 % intervals.
        header: lines of comment at the top.
        provenance: flat parameters of the section that says where the values come from.
    """
    rounded = [float(f"{number:.{_DIGITS}g}") for number in numbers]
    comments = {
        item.keys[0]: f"fitted, +- {half:.2g} (95 %); was {item.prior_mean:g}"
        for item, half in zip(parameters, half_widths, strict=True)
    }
    fixed = set(IDENTITY_KEYS).difference(*(item.keys for item in parameters))
    identity = {IDENTITY + key: values[key] for key in IDENTITY_KEYS if key in fixed}
    sections: dict[str, Values] = dict(read_sections(source))
    keys = [item.keys[0] for item in parameters]
    changed = ParameterisedRobot(values, str(source)).given(dict(zip(keys, rounded, strict=True)))
    sections[EVERY_NODE] = _own_values_alone(changed.values, parameters)
    sections[CALIBRATION] = {**identity, **provenance}
    return sections_text(sections, header, comments)


def sections_text(
    sections: Mapping[str, Mapping[str, object]],
    header: Sequence[str],
    comments: Mapping[str, str] = MappingProxyType({}),
) -> str:
    """Text of a ROS 2 parameter file.

    Args:
        sections: flat parameters by node.
        header: lines of comment at the top.
        comments: behind values of the description, by key.
    """
    lines = [f"# {one_line(line)}".rstrip() for line in header]
    for node, flat in sections.items():
        lines += [f"{_scalar(node)}:", "  ros__parameters:"]
        lines += _lines(_nested(flat), 4, "", comments if node == EVERY_NODE else {})
    return "\n".join(lines) + "\n"


def _own_values_alone(values: Values, parameters: Sequence[Parameter]) -> Values:
    """Without an effect's value for all wheels where each wheel has its own."""
    own = Counter(item.name for item in parameters if item.keys[0] != item.name)
    return {
        key: value
        for key, value in values.items()
        if not key.startswith("physics.") or own[key] < WHEELS
    }


def _nested(flat: Mapping[str, object]) -> Tree:
    """Dotted keys as a tree; an effect's id stays one key."""
    tree: Tree = {}
    for key, value in flat.items():
        branch = tree
        *groups, leaf = _parts(key)
        for group in groups:
            following = branch.setdefault(group, {})
            assert isinstance(following, dict)
            branch = following
        branch[leaf] = value
    return tree


def _parts(key: str) -> list[str]:
    found = split_effect(key)
    return key.split(".") if found is None else ["physics", found[0], *found[1].split(".")]


def _lines(tree: Tree, indent: int, prefix: str, comments: Mapping[str, str]) -> list[str]:
    lines = []
    for key, value in tree.items():
        name = f"{prefix}{key}"
        start = f"{' ' * indent}{_scalar(key)}:"
        if isinstance(value, dict):
            lines += [start, *_lines(value, indent + 2, name + ".", comments)]
            continue
        comment = f"  # {comments[name]}" if name in comments else ""
        lines.append(f"{start} {_scalar(value)}{comment}")
    return lines


def _scalar(value: object) -> str:
    """A value or a key on one line, quoted where YAML would read something else."""
    dumped = yaml.safe_dump(_plain(value), default_flow_style=True, width=math.inf)
    return str(dumped).partition("\n")[0]


def _plain(value: object) -> object:
    return list(value) if isinstance(value, tuple) else value
