"""Whether the bands and the caution in use were set for this robot and this classifier."""

import hashlib
from functools import cache
from pathlib import Path

from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.classifier.stored import shipped_weights
from tomr_power_model.robot import Robot, digest_of, suite_version

_DIGITS = 8


def stamp_of(date: str, settings: ClassifierSettings, robot: Robot) -> str:
    """What the parameter `commissioned` holds: date, weights, robot and version of the suite."""
    return " ".join([date, *_now(settings, robot)])


def commissioned_words(settings: ClassifierSettings, robot: Robot) -> str:
    """When the robot was commissioned, or what to do."""
    date, *then = settings.commissioned.split(" ")
    if not date:
        return "no: run tomr_commission"
    weights, described, version = [*then, "", "", ""][:3]
    now = _now(settings, robot)
    if weights != now[0]:
        other = "with another classifier"
    elif described != now[1]:
        other = "another robot, or this one before its description was changed,"
    elif version != now[2]:
        other = f"with version {version} of the suite, this is {now[2]},"
    else:
        return date
    return f"no: {other} on {date}, run tomr_commission again"


def _now(settings: ClassifierSettings, robot: Robot) -> tuple[str, str, str]:
    return _weights(settings.classifier, settings.weights), digest_of(robot), suite_version()


@cache
def _weights(classifier: str, path: str) -> str:
    """A short name of the weights in use."""
    data = (Path(path) if path else shipped_weights(classifier)).read_bytes()
    return hashlib.sha256(data).hexdigest()[:_DIGITS]
