"""The drive that would separate what the data cannot: a mission file."""

from collections.abc import Mapping, Sequence

import yaml

from tomr_reality_gap.explanation import Finding

Phase = Mapping[str, object]

_PAUSE: Phase = {"pause": 2.0}


def _move(heading: float, speed: float, seconds: float) -> Phase:
    return {"move": {"heading_deg": heading % 360.0, "speed": speed, "duration": seconds}}


def _spin(rate: float, seconds: float) -> Phase:
    return {"twist": [0.0, 0.0, rate], "duration": seconds}


# What tells an effect, by the beginning of its name: what is in it decides first.
_PHASES: tuple[tuple[str, Sequence[Phase]], ...] = (
    ("friction.stribeck", [_move(20.0 * k, 0.01 * (k + 1), 6.0) for k in range(6)]),
    (
        "contact.roller_drag",
        [_move(15.0 * k, 0.2, 2.5) for k in range(24)],
    ),
    (
        "friction.asymmetric",
        [_move(180.0 * (k % 2) + 40.0 * (k // 2), 0.3, 3.0) for k in range(8)],
    ),
    ("electrical.winding_heating", [_spin(2.0 * (-1.0) ** k, 1.0) for k in range(40)] + [_PAUSE]),
    ("electrical.driver_standby", [{"pause": 15.0}]),
    ("sensor.power_bias", [{"pause": 15.0}]),
    ("supply.auxiliary_power", [{"pause": 15.0}]),
    ("body.", [_move(60.0 * k, 0.4, 1.2) for k in range(12)]),
    (
        "robot.",
        [_move(60.0 * k, 0.4, 1.2) for k in range(12)] + [_spin(1.5, 1.5), _spin(-1.5, 1.5)],
    ),
    ("friction.", [_move(20.0, 0.05 * 2.0**k, 4.0) for k in range(4)]),
    ("", [_spin(1.0, 3.0), _move(0.0, 0.4, 2.0), _move(180.0, 0.4, 2.0), _move(90.0, 0.1, 5.0)]),
)


def suggested(findings: Sequence[Finding]) -> str:
    """Text of a mission file for the first finding with rivals; empty if there is none."""
    for finding in findings:
        if finding.rivals:
            names = [finding.effect, *(rival.effect for rival in finding.rivals)]
            phases: list[Phase] = [_PAUSE]
            for text in dict.fromkeys(_beginning(name) for name in names):
                phases += [*dict(_PHASES)[text], _PAUSE]
            mission = {
                "name": "separate",
                "description": f"Tells {names[0]} from {', '.join(names[1:])}.",
                "phases": phases,
            }
            return str(yaml.safe_dump(mission, sort_keys=False, default_flow_style=None))
    return ""


def _beginning(effect: str) -> str:
    name = effect.removeprefix("parameter.").removeprefix("physics.")
    return next(text for text, _ in _PHASES if name.startswith(text))
