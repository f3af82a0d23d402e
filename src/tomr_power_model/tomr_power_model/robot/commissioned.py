"""The record that `tomr_commission` leaves in a description: what was commissioned and when."""

import hashlib
import json
from collections.abc import Mapping
from importlib.metadata import version

import numpy as np
from attrs import asdict

from tomr_power_model.errors import InputError
from tomr_power_model.robot.description import Robot, robot_from_parameters

COMMISSIONING = "tomr_commission"  # section of the record
DIGEST = "description"  # its key for the digest of the robot that was commissioned
DATE = "date"
_DIGITS = 16


def suite_version() -> str:
    """Version of the suite."""
    return version("tomr_power_model")


def digest_of(robot: Robot) -> str:
    """A short name of a robot's values: equal if and only if these are."""
    values = asdict(robot)
    if not any(robot.imu_rpy):  # as it is in all that were commissioned before there was the key
        del values["imu_rpy"]
    text = json.dumps(values, sort_keys=True, default=_plain)
    return hashlib.sha256(text.encode()).hexdigest()[:_DIGITS]


def _plain(value: object) -> object:
    if isinstance(value, Mapping):
        return dict(value)
    return value.tolist() if isinstance(value, np.ndarray) else str(value)


def check_commissioned(
    record: Mapping[str, object], described: Mapping[str, object], place: str
) -> None:
    """Raise InputError if another robot was commissioned than the one beside the record."""
    if record and record.get(DIGEST) != digest_of(robot_from_parameters(described, place)):
        raise InputError(
            f"{place}: its values are not those that were commissioned on {record.get(DATE)}: run "
            f"tomr_commission again, or remove the section {COMMISSIONING} with the bands and the "
            "caution that belong to it"
        )
