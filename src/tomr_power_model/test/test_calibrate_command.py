"""tomr_calibrate from the outside: what it refuses, what it writes."""

from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
import yaml
from attrs import evolve

from tomr_power_model.calibrate_cli import _parser, _timing, main
from tomr_power_model.calibration.calibrate import Timing, align, calibrate
from tomr_power_model.calibration.parameters import Choice
from tomr_power_model.drive.record import Drive
from tomr_power_model.errors import InputError
from tomr_power_model.robot import load_robot, read_description, shipped_robot
from tomr_power_model.wang2024 import Coefficients

# Of a recording: quoted in YAML, escaped in HTML, no formula in a picture.
NAME = "<script>\x01 $a_ #: {\ntour"
MakeDrive = Callable[..., Drive]
WriteBag = Callable[..., Path]
ROBOT = shipped_robot("reference")
REFERENCE = Path(load_robot.__code__.co_filename).parents[1] / "robots" / "reference.yaml"
FAULTY_BAG = Path(__file__).resolve().parents[3] / "bags" / "circle_encoder_lost"


def during(time: np.ndarray, start: float = 10.0, end: float = 16.0) -> np.ndarray:
    return (time >= start) & (time <= end)


def test_power_unlike_the_rest_is_refused_after_the_fit(make_drive: MakeDrive) -> None:
    drive = make_drive(ROBOT, 1)
    power = drive.power.copy()
    power[during(drive.power_time), 0] += 4.0
    samples = align([evolve(drive, power=power)], ROBOT, Timing())
    with pytest.raises(InputError, match=r"wheel_1_joint, (9.9|10.\d) s to 1[56].\d s: it draws"):
        calibrate(read_description("reference"), "test", samples, (), choice=Choice())


@pytest.mark.parametrize(
    ("more", "sections", "expected"),
    [
        ([], {}, Timing()),
        ([], {"power_model": {"ros__parameters": {"encoder_window": 0.09}}}, Timing(span=0.09)),
        (["--encoder-window", "0.12", "--power-window", "0.02"], {}, Timing(0.12, 0.02)),
    ],
)
def test_the_span_is_that_of_the_encoders_unless_somebody_gives_one(
    tmp_path: Path, more: list[str], sections: dict[str, object], expected: Timing
) -> None:
    robot = tmp_path / "robot.yaml"
    described = yaml.safe_load(REFERENCE.read_text(encoding="utf-8"))
    described.pop("power_model", None)
    robot.write_text(yaml.safe_dump({**described, **sections}))
    assert _timing(_parser().parse_args(["tour", "--robot", str(robot), *more])) == expected


class _Links(HTMLParser):
    """Collects what a page would load."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []
        self.pictures = 0

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for key, value in attrs:
            if key in ("src", "href") and value is not None:
                self.pictures += value.startswith("data:image/png;base64,")
                if not value.startswith("data:"):
                    self.found.append(value)


def test_the_command_writes_a_robot_and_a_page(
    tmp_path: Path,
    make_drive: MakeDrive,
    write_bag: WriteBag,
    other_values: Callable[..., object],
    capsys: pytest.CaptureFixture[str],
) -> None:
    real = other_values(ROBOT)
    bags = [
        str(write_bag(make_drive(real, seed, seconds=30.0), tmp_path / f"{NAME}{seed}"))
        for seed in (1, 2)
    ]
    out, page = tmp_path / "fitted.yaml", tmp_path / "report.html"
    command = [bags[0], "--holdout", bags[1], "--robot", "reference", "--out", str(out)]
    assert main([*command, "--report", str(page)]) == 0
    printed = capsys.readouterr().out
    assert "held out" in printed
    assert "robot.mass" in printed

    fitted = load_robot(out)
    assert fitted.mass == pytest.approx(real.mass, rel=0.01)
    for wheel in range(3):
        friction, truth = (r.effect("friction.coulomb", wheel) for r in (fitted, real))
        assert friction is not None
        assert truth is not None
        assert friction["torque"] == pytest.approx(truth["torque"], rel=0.15)
    text = out.read_text()
    assert "tour1" in text.splitlines()[0]
    assert "tour2, not fitted: motor 1" in text

    links = _Links()
    links.feed(page.read_text())
    assert links.found == []
    assert links.pictures == 3  # two drives, and the residuals
    assert "<script" not in page.read_text()


def test_the_paper_s_coefficients_are_fitted_to_a_file_that_the_model_takes(
    tmp_path: Path,
    make_drive: MakeDrive,
    write_bag: WriteBag,
    capsys: pytest.CaptureFixture[str],
) -> None:
    bags = [
        str(write_bag(make_drive(ROBOT, seed, seconds=30.0), tmp_path / f"{NAME}{seed}"))
        for seed in (1, 2)
    ]
    out = tmp_path / "wang2024.yaml"
    command = [bags[0], "--holdout", bags[1], "--robot", "reference", "--out", str(out)]
    assert main([*command, "--power-model", "wang2024"]) == 0
    printed = capsys.readouterr().out
    (unseen,) = [line for line in printed.splitlines() if "tour2" in line]
    motors, robot = (float(word) for word in unseen.split()[-2:])
    assert 90.0 < motors < robot < 100.0
    assert f"--set wang2024.coefficients={out}" in printed
    Coefficients.load(out).check(ROBOT)
    shorter = tmp_path / "shorter.yaml"
    command[command.index(str(out))] = str(shorter)
    assert main([*command, "--power-model", "wang2024", "--encoder-window", "0.05"]) == 0
    assert Coefficients.load(shorter) != Coefficients.load(out)
    assert out.read_text().splitlines()[1].endswith("tour1, for reference.")


def test_a_fitted_file_of_another_robot_is_refused(
    tmp_path: Path, make_drive: MakeDrive, write_bag: WriteBag
) -> None:
    bag = write_bag(make_drive(ROBOT, 1, seconds=25.0), tmp_path / "tour")
    out = tmp_path / "fitted.yaml"
    assert main([str(bag), "--robot", "reference", "--out", str(out), "--shared", "all"]) == 0
    tree = yaml.safe_load(out.read_text())
    tree["/**"]["ros__parameters"]["robot"]["wheel_radius"] = 0.06
    out.write_text(yaml.safe_dump(tree))
    with pytest.raises(InputError, match=r"fitted to a robot with robot.wheel_radius = 0.05, not"):
        load_robot(out)
    assert main([str(bag), "--robot", str(out)]) == 2


def test_a_recorded_fault_is_one_line_and_skipping_it_helps(
    capsys: pytest.CaptureFixture[str],
) -> None:
    command = [str(FAULTY_BAG), "--robot", "reference", "--shared", "all"]
    assert main(command) == 2
    printed = capsys.readouterr().err
    assert printed.startswith(
        "error: circle_encoder_lost: wheel_3_joint, 8.0 s to 14.0 s: its encoder"
    )
    assert "--skip circle_encoder_lost=7.0:15.0" in printed
    assert printed.count("\n") == 1
    assert main([*command, "--skip", "circle_encoder_lost=7.0:15.0"]) == 0


def test_a_radius_that_the_drivers_do_not_share_is_refused_with_the_one_they_have(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    described = yaml.safe_load(REFERENCE.read_text(encoding="utf-8"))
    described["/**"]["ros__parameters"]["robot"]["wheel_radius"] = 0.0515
    robot = tmp_path / "robot.yaml"
    robot.write_text(yaml.safe_dump(described))
    assert main([str(FAULTY_BAG.parent / "square"), "--robot", str(robot)]) == 2
    printed = capsys.readouterr().err
    assert (
        "they turn 1.030 times as fast as described: write robot.wheel_radius: 0.05, as" in printed
    )
    assert printed.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["--skip", "other=1:2"], "no recording other"),
        (["--skip", "circle_encoder_lost=x"], "give BAG=FROM:TO in seconds"),
        (["--tolerance", "robot.mass=-1"], "give a number above 0"),
        (["--out", "/nowhere/fitted.yaml"], "no folder /nowhere"),
        (["--encoder-window", "0"], "give seconds above 0"),
        (["--power-model", "wang2024", "--power-window", "0.02"], "--power-window is for the phys"),
        (["--power-model", "wang2024"], "wheel_3_joint, 8.0 s to 14.0 s: its encoder"),
    ],
)
def test_bad_options_are_one_line(
    arguments: list[str], reason: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(FAULTY_BAG), "--robot", "reference", *arguments]) == 2
    printed = capsys.readouterr().err
    assert reason in printed
    assert printed.count("\n") == 1
