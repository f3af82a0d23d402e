"""Robot descriptions: what a file may say, and the one line for what it may not."""

from importlib.resources import files
from pathlib import Path

import pytest
import yaml

from tomr_power_model.errors import InputError
from tomr_power_model.robot import load_robot, read_node_sections, shipped_robot, shipped_robots

REFERENCE = files("tomr_power_model").joinpath("robots").joinpath("reference.yaml").read_text()


def _write(tmp_path: Path, **changes: object) -> Path:
    """The reference robot with dotted keys changed; None removes one."""
    document = yaml.safe_load(REFERENCE)
    for dotted, value in changes.items():
        *path, last = dotted.split("__")
        place = document["/**"]["ros__parameters"]
        for part in path:
            place = place.setdefault(part, {})
        if value is None:
            del place[last]
        else:
            place[last] = value
    file = tmp_path / "robot.yaml"
    file.write_text(yaml.safe_dump(document))
    return file


def test_keys_for_all_nodes_may_stand_beside_the_robot(tmp_path: Path) -> None:
    file = _write(tmp_path, cmd_vel_type="twist", hardware_id="r7", use_sim_time=True)
    assert load_robot(file) == load_robot("reference")
    settings = read_node_sections(file, ("power_model", "fault_classifier"))
    assert settings["cmd_vel_type"] == "twist"
    assert settings["hardware_id"] == "r7"
    assert "use_sim_time" not in settings  # of ROS, not of a tool


def test_shipped_robots_load() -> None:
    assert {"reference", "robotino_v2"} <= set(shipped_robots())
    for name in shipped_robots():
        assert load_robot(name).mass > 0.0
    assert shipped_robot("reference") is shipped_robot("reference")  # tests take it by the thousand


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"robot__mass": None}, ["robot.mass", "missing", "kg"]),
        ({"robot__mass": -3.0}, ["robot.mass", "-3", "at least 0.01"]),
        ({"robot__mass": float("nan")}, ["robot.mass", "finite"]),
        ({"robot__mass": float("inf")}, ["robot.mass", "finite"]),
        ({"robot__mass": 1e30}, ["robot.mass", "at most"]),
        ({"robot__mass": 10**350}, ["robot.mass", "too large"]),
        ({"physics__friction.coulomb": {"torque": 1e30}}, ["friction.coulomb.torque", "at most"]),
        ({"physics__body.payload_mass": {"mass": -15.0}}, ["payload_mass", "leaves nothing"]),
        ({"robot__wheel_names": ["a", "b", "{c}"]}, ["wheel_names", "letters"]),
        ({"robot__wheel_names": ["a", "b", "c\nd"]}, ["wheel_names", "letters"]),
        ({"robot__mass": "heavy"}, ["robot.mass", "number"]),
        ({"robot__mas": 3.0}, ["robot.mas ", "did you mean robot.mass"]),
        ({"robot__mass_center": [0.0, 0.0]}, ["mass_center", "3 values"]),
        ({"robot__wheel_names": ["a", "a", "b"]}, ["wheel_names", "different"]),
        ({"motor__resistance": 0.0}, ["motor.resistance", "at least 0.0001"]),
        ({"physics__friction.coulom": {"torque": 0.1}}, ["friction.coulom", "unknown"]),
        ({"physics__friction.coulomb": {"torqe": 0.1}}, ["torqe", "torque"]),
        ({"physics__friction.stribeck": {"torque": 0.1}}, ["friction.stribeck.speed", "missing"]),
        ({"measurement__source": "guess"}, ["measurement.source", "one of"]),
        ({"cmd_vel_type": "twst"}, ["cmd_vel_type", "one of auto, twist_stamped, twist"]),
        ({"controller__integrator": "sideways"}, ["controller.integrator", "backward, forward"]),
    ],
)
def test_bad_values_get_one_clear_line(
    tmp_path: Path, changes: dict[str, object], words: list[str]
) -> None:
    file = _write(tmp_path, **changes)
    with pytest.raises(InputError) as caught:
        load_robot(file)
    line = str(caught.value)
    assert "\n" not in line
    for word in [str(file), *words]:
        assert word in line


def test_what_a_file_may_leave_out_or_say(tmp_path: Path) -> None:
    drag = {"physics__contact.roller_drag": {"coefficient": 0.1}}
    plain = load_robot(_write(tmp_path, **drag))
    assert (plain.controller.integrator, plain.sensors.power_window) == ("backward", 0.005)
    assert plain.effect("contact.roller_drag") == {"coefficient": 0.1, "slip": 0.0}
    changes = {"controller__integrator": "forward", "sensors__power_window": 0.02}
    loaded = load_robot(_write(tmp_path, **changes))
    assert (loaded.controller.integrator, loaded.sensors.power_window) == ("forward", 0.02)


@pytest.mark.parametrize("text", ["", "a: [", "/**: {}", "- 1", "/**: {ros__parameters: {}}"])
def test_a_file_that_is_no_description(tmp_path: Path, text: str) -> None:
    file = tmp_path / "robot.yaml"
    file.write_text(text)
    with pytest.raises(InputError, match=r"robot\.yaml"):
        load_robot(file)


def test_a_missing_file_is_named() -> None:
    with pytest.raises(InputError, match="nowhere"):
        load_robot("nowhere.yaml")


def test_wheels_may_differ(tmp_path: Path) -> None:
    file = _write(
        tmp_path,
        motor__wheel_2_joint={"resistance": 1.5},
        **{"physics__friction.coulomb": {"torque": 0.06, "wheel_3_joint": {"torque": 0.2}}},
    )
    robot = load_robot(file)
    assert [motor.resistance for motor in robot.motors] == [0.8, 1.5, 0.8]
    assert robot.everywhere("friction.coulomb", "torque") == (0.06, 0.06, 0.2)
