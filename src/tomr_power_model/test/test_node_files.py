"""Which files the launch files hand to the nodes."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from tomr_power_model.errors import InputError
from tomr_power_model.nodes.launching import find_files
from tomr_power_model.robot import load_robot, shipped_robot


def found(**given: str) -> dict[str, str]:
    context = SimpleNamespace(launch_configurations=given)
    find_files(context)
    return given


def test_a_shipped_robot_by_name_and_no_settings() -> None:
    files = found(robot="reference", settings="")
    assert load_robot(files["robot_file"]) == shipped_robot("reference")
    assert files["settings_file"] == files["robot_file"]
    assert found(robot="reference")["settings_file"] == files["robot_file"]


def test_files_by_their_paths(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    robot, settings = tmp_path / "it's mine.yaml", tmp_path / "settings"
    robot.touch()
    settings.touch()
    files = found(robot="~/it's mine.yaml", settings=str(settings))
    assert files["robot_file"] == str(robot)
    assert files["settings_file"] == str(settings)


def test_a_file_that_is_not_there_is_named() -> None:
    with pytest.raises(InputError, match=r"^/no/such\.yaml: no such file: .*, or one of reference"):
        found(robot="/no/such.yaml")
    with pytest.raises(InputError, match=r"^/no/settings: no such file: give the path"):
        found(robot="reference", settings="/no/settings")
