"""Residuals as a DiagnosticArray and back."""

import math
from collections.abc import Sequence
from typing import Any

from attrs import evolve

from tomr_fault_diag.residuals.frame import (
    ALONG,
    RESIDUALS,
    TOTAL,
    UNITS,
    YAW,
    Residual,
    ResidualFrame,
    residual_names,
    voltage_names,
)
from tomr_power_model.messages.intake import Unusable
from tomr_power_model.messages.outgoing import DiagnosticMessage
from tomr_power_model.messages.plain import Level, Status
from tomr_power_model.robot import WHEELS, Robot

TOPIC = "residuals"


def residual_message(
    robot: Robot, frame: ResidualFrame, hardware_id: str = ""
) -> DiagnosticMessage:
    """The message of one frame: a sentence to read, numbers to plot."""
    names = residual_names(robot.wheel_topics)
    statuses = tuple(
        _status(name, residual, hardware_id, () if place else _of_all(frame))
        for place, (name, residual) in enumerate(zip(names, frame.residuals, strict=True))
    )
    beside = tuple(
        _beside(_status(name, residual, hardware_id, ()), residual)
        for name, residual in zip(
            (YAW, *ALONG, *voltage_names(robot.wheel_topics)),
            (frame.yaw, *frame.along, *frame.voltages),
            strict=True,
        )
    )
    return DiagnosticMessage(TOPIC, frame.stamp_ns, (*statuses, *beside))


def _of_all(frame: ResidualFrame) -> tuple[tuple[str, str], ...]:
    """What a frame says of the whole robot, beside its total power."""
    return ("supply", f"{frame.supply:.6g}"), ("mistake", frame.mistake)


def _beside(status: Status, residual: Residual) -> Status:
    """Of an IMU, which a robot need not have, or of what drivers hold, which need not be known."""
    return evolve(status, level=Level.OK) if residual.stale else status


def _status(
    name: str, residual: Residual, hardware_id: str, more: Sequence[tuple[str, str]]
) -> Status:
    return Status(
        name,
        _level(residual),
        sentence(residual),
        (
            ("residual", f"{residual.residual:.6g}"),
            ("band", f"{residual.band:.6g}"),
            ("code", str(residual.code)),
            ("modelled", f"{residual.modelled:.6g}"),
            *more,
        ),
        hardware_id,
    )


def _level(residual: Residual) -> Level:
    if residual.stale:
        return Level.STALE
    return Level.WARN if residual.code else Level.OK


def sentence(residual: Residual) -> str:
    """A residual in words."""
    if residual.stale:
        return residual.missing or "not known"
    unit = residual.unit
    if residual.code == 0:
        return f"as modelled: {residual.residual:+.3g} {unit}, band {residual.band:.3g} {unit}"
    side = "above" if residual.code > 0 else "below"
    return (
        f"{abs(residual.residual):.3g} {unit} {side} the modelled {residual.modelled:.3g} {unit}, "
        f"band {residual.band:.3g} {unit}"
    )


def frame_of(message: Any, stamp_ns: int) -> ResidualFrame:
    """The frame that a message carries; raises Unusable if it carries none."""
    statuses = message.status
    count = RESIDUALS + 1 + len(ALONG) + WHEELS
    if len(statuses) != count:
        raise Unusable(f"{len(statuses)} statuses, a frame has {count}")
    *residuals, yaw, x, y, first, second, third = (_residual(status) for status in statuses)
    supply, mistake = _read_of_all(statuses[TOTAL])
    voltages = (first, second, third)
    return ResidualFrame(stamp_ns, tuple(residuals), supply, yaw, (x, y), voltages, mistake)


def _read_of_all(status: Any) -> tuple[float, str]:
    values = {item.key: item.value for item in status.values}
    found = values.get("supply", "nan")
    try:
        return float(found), str(values.get("mistake", ""))
    except ValueError:
        raise Unusable(f"{status.name}: supply {found!r} is no number") from None


def _residual(status: Any) -> Residual:
    values = {item.key: item.value for item in status.values}
    try:
        residual, band = float(values["residual"]), float(values["band"])
        modelled = float(values["modelled"])
    except (KeyError, ValueError) as error:
        raise Unusable(f"{status.name}: no number for {error}") from None
    if band <= 0.0:
        raise Unusable(f"{status.name}: a band of {band:g}, it must be above 0")
    if math.isnan(residual):
        return Residual(residual, band, modelled, missing=str(status.message))
    # The values are bare numbers, for plots; the sentence ends with the unit.
    unit = UNITS.get(str(status.message).rpartition(" ")[2])
    if unit is None:
        raise Unusable(f"{status.name}: {status.message!r} does not end with a unit")
    return Residual(residual, band, modelled, unit)
