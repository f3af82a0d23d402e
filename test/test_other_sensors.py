"""Drives and cases as other sensors would have recorded them."""

import sys
from pathlib import Path

import numpy as np
import pytest

from tomr_power_model.messages.bag import bag_message
from tomr_power_model.messages.types import BATTERY, JOINT_STATE
from tomr_power_model.recordings import open_recording
from tomr_power_model.robot import load_robot

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "bench"))

from concealed.cli import main  # noqa: E402
from other_sensors import SENSORS, Message  # noqa: E402


@pytest.mark.parametrize(
    ("kind", "current"),
    [
        ("slow", -0.55),
        ("coarse-currents", -0.55),
        ("coarse-encoders", -0.55),
        ("motor-encoders", -0.55),
        ("currents-alone", -0.55),
        ("magnitudes", 0.55),
        ("coarse-everywhere", -0.55),
    ],
)
def test_other_sensors_say_less(kind: str, current: float) -> None:
    random = np.random.default_rng(1)
    is_coarse = kind in ("coarse-currents", "coarse-everywhere")
    for topic, number in (("/joint_states", 10), ("/wheel_1/power", 10), ("/cmd_vel", 10)):
        found = []
        for index in range(number):
            content = bag_message(BATTERY, voltage=24.04, current=-0.55)
            if topic == "/joint_states":
                content = bag_message(JOINT_STATE, position=np.full(3, 0.1), velocity=np.ones(3))
            if SENSORS[kind](Message(topic, content, index), random):
                found.append(content)
        if topic == "/wheel_1/power":
            assert len(found) == (2 if kind == "slow" else 10)
            assert abs(found[0].current - current) < (0.11 if is_coarse else 1e-6)
            shown = {item.current for item in found}
            assert len(shown) == (2 if is_coarse else 1)  # between two steps
            assert np.isnan(found[0].voltage) == (kind == "currents-alone")
        elif topic == "/joint_states":
            assert len(found) == (4 if kind == "slow" else 10)
            counted = {"coarse-encoders": 4.0 / 256, "motor-encoders": 15.0 / 960}.get(kind)
            position = 0.1 if counted is None else 2.0 * np.pi * counted
            assert found[0].position[0] == pytest.approx(position)
            assert len(found[0].velocity) == (3 if counted is None else 0)
        else:
            assert len(found) == 10


def test_the_robots_own_sensor_is_coarse_too_where_all_are() -> None:
    for kind, current in (("coarse-currents", -1.23), ("coarse-everywhere", -1.2)):
        content = bag_message(BATTERY, voltage=24.04, current=-1.23)
        assert SENSORS[kind](Message("/battery_state", content, 0), np.random.default_rng(0))
        assert content.current == pytest.approx(current)


def test_some_messages_of_a_hundred_are_lost() -> None:
    random = np.random.default_rng(1)
    kept = [SENSORS["lost"](Message("/cmd_vel", None, index), random) for index in range(5000)]
    assert np.mean(kept) == pytest.approx(0.98, abs=0.005)


def _magnitudes(bag: Path) -> list[float]:
    with open_recording(bag) as recording:
        return [item.current for _, _, item, _ in recording.messages(["wheel_1/power"])]


def test_a_case_with_other_sensors_is_a_case_with_its_own_simulation(tmp_path: Path) -> None:
    case = tmp_path / "cases" / "a1b2c3"
    case.mkdir(parents=True)
    robots = ROOT / "src" / "tomr_power_model" / "tomr_power_model" / "robots"
    (case / "robot.yaml").write_text((robots / "reference.yaml").read_text())
    for name in ("real", "sim"):
        (case / name).symlink_to(ROOT / "bags" / "square")
    out = tmp_path / "new"
    for _ in range(2):  # what is there is kept
        assert main(["sensors", "magnitudes", str(case.parent), "--out", str(out)]) == 0
    made = out / "cases" / case.name
    assert not load_robot(made / "robot.yaml").measurement.signed
    signed = _magnitudes(case / "real")
    assert min(signed) < 0.0
    assert _magnitudes(made / "real") == [abs(current) for current in signed]
    assert _magnitudes(made / "sim") == signed
