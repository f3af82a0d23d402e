"""Whether the bands and the caution in use were set for this robot and this classifier."""

import hashlib
from functools import cache
from importlib.resources import files
from pathlib import Path

from tomr_fault_diag.classifier.settings import ClassifierSettings

_SHIPPED = {"window": "window.npz", "wang2024": "wang2024.npz"}
_DIGITS = 8


def stamp_of(date: str, settings: ClassifierSettings) -> str:
    """What the parameter `commissioned` holds: the date, and which weights it was with."""
    return f"{date} {_weights(settings.classifier, settings.weights)}"


def commissioned_words(settings: ClassifierSettings) -> str:
    """When the robot was commissioned, or what to do."""
    date, _, weights = settings.commissioned.partition(" ")
    if not date:
        return "no: run tomr_commission"
    if weights != _weights(settings.classifier, settings.weights):
        return f"no: with another classifier on {date}, run tomr_commission again"
    return date


@cache
def _weights(classifier: str, path: str) -> str:
    """A short name of the weights in use."""
    if path:
        data = Path(path).read_bytes()
    else:
        shipped = files("tomr_fault_diag").joinpath("weights").joinpath(_SHIPPED[classifier])
        data = shipped.read_bytes()
    return hashlib.sha256(data).hexdigest()[:_DIGITS]
