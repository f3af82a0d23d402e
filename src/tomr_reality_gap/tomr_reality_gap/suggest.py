"""The drive that would separate what the data cannot: a mission file."""

from collections.abc import Sequence

from tomr_power_model.effects import EFFECTS
from tomr_power_model.effects.base import Phase
from tomr_power_model.effects.missions import INERTIAL, PAUSE, STAND, VARIED
from tomr_power_model.files import plain_yaml
from tomr_reality_gap.explanation import Finding

# What shows a wrong parameter, by the beginning of its key.
_PARAMETERS: tuple[tuple[str, Sequence[Phase]], ...] = (
    ("supply.auxiliary_power", STAND),
    ("robot.", INERTIAL),
    ("", VARIED),
)


def suggested(findings: Sequence[Finding]) -> str:
    """Text of a mission file for the first finding with rivals; empty if there is none."""
    for finding in findings:
        if finding.rivals:
            names = [finding.effect, *(rival.effect for rival in finding.rivals)]
            phases: list[Phase] = [PAUSE]
            parts: list[Sequence[Phase]] = []
            for part in map(_phases, names):
                if part not in parts:
                    parts.append(part)
                    phases += [*part, PAUSE]
            mission = {
                "name": "separate",
                "description": f"Distinguishes {names[0]} from {', '.join(names[1:])}.",
                "phases": phases,
            }
            return plain_yaml(mission)
    return ""


def _phases(name: str) -> Sequence[Phase]:
    key = name.removeprefix("parameter.").removeprefix("physics.")
    for effect_id, effect in EFFECTS.items():
        if key == effect_id or key.startswith(f"{effect_id}."):
            return effect.mission
    return next(phases for start, phases in _PARAMETERS if key.startswith(start))
