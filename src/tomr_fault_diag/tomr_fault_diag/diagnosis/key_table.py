"""Every key of robot.yaml, as docs/keys.md has them: made from the tables that check the file.

python -m tomr_fault_diag.diagnosis.key_table > docs/keys.md
"""

from collections.abc import Iterable, Iterator, Sequence
from itertools import chain

from tomr_fault_diag.diagnosis.settings import PARAMETERS, STAGE_NODES
from tomr_power_model.effects import EFFECTS
from tomr_power_model.robot.parameters import SHARED_PARAMETERS, ParameterSpec
from tomr_power_model.robot.tables import ROBOT_PARAMETERS

_HEAD = f"""\
# Keys of robot.yaml

Made by `make docs` from the tables that check the file; a test holds it to them.
`tomr_diagnose --parameters` prints the same. How to find the values:
[on-your-robot.md](on-your-robot.md).

The `/**` section describes the robot. Settings of the diagnosis stand in a section of the node's
name ({", ".join(f"`{name}`" for name in STAGE_NODES)};
`tomr_diagnose` reads all of them), or are given by `-p name:=value` to a node and by
`--set name=value` to `tomr_diagnose`. An unknown key is an error.
"""
_ROBOT = """\
## The robot

A key without a default must be given. `motor.<wheel name>.<key>` describes one motor otherwise than
the rest."""
_SHARED = """\
## For all nodes, beside the robot"""
_EFFECTS = """\
## Effects: `physics.<effect>`

`friction.coulomb: {torque: 0.06}` for all wheels alike; where one differs,
`{torque: 0.06, wheel_2_joint: {torque: 0.1}}`. An effect that is absent is left out of the
simulation; `tomr_gap explain` finds out which ones a robot has."""
_SETTINGS = """\
## Settings of the diagnosis"""


def key_tables() -> str:
    """All tables as Markdown."""
    known = {spec.name for spec in SHARED_PARAMETERS}
    settings = (spec for spec in PARAMETERS.values() if spec.name not in known)
    parts = [
        _HEAD,
        _ROBOT,
        _specs(ROBOT_PARAMETERS),
        _SHARED,
        _specs(SHARED_PARAMETERS),
        _EFFECTS,
        _effects(),
        _SETTINGS,
        _specs(settings),
    ]
    return "\n\n".join(part.rstrip() for part in parts) + "\n"


def summaries() -> Iterator[str]:
    """The same, one line a key, for a terminal."""
    for spec in chain(ROBOT_PARAMETERS, SHARED_PARAMETERS):
        yield spec.summary
    for effect_id, effect in EFFECTS.items():
        for name, parameter in effect.parameters.items():
            unit = f" [{parameter.unit}]" if parameter.unit else ""
            yield f"physics.{effect_id}.{name}{unit}: of {effect.label.lower()}"
    known = {spec.name for spec in SHARED_PARAMETERS}
    yield from (spec.summary for spec in PARAMETERS.values() if spec.name not in known)


def _specs(specs: Iterable[ParameterSpec]) -> str:
    rows = [
        (
            f"`{spec.name}`",
            "" if spec.default is None else f"`{_shown(spec.default)}`",
            spec.unit,
            spec.description + ("" if spec.read_only else " (may change while running)"),
            spec.bounds,
        )
        for spec in specs
    ]
    return _table(("key", "default", "unit", "meaning", "permitted"), rows)


def _shown(value: object) -> object:
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, tuple):
        return list(value)
    return {True: "true", False: "false"}.get(value, value) if isinstance(value, bool) else value


def _effects() -> str:
    rows = []
    for effect_id, effect in EFFECTS.items():
        keys = "; ".join(
            f"`{name}`" + (f" [{parameter.unit}]" if parameter.unit else "")
            for name, parameter in effect.parameters.items()
        )
        law = " ".join((effect.__doc__ or "").split())
        rows.append((f"`{effect_id}`", effect.place, keys, law, effect.shown_by))
    return _table(("effect", "where", "keys", "law", "what shows it"), rows)


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    def line(cells: Iterable[str]) -> str:
        return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"

    return "\n".join([line(head), line("---" for _ in head), *map(line, rows)])


if __name__ == "__main__":
    print(key_tables(), end="")
