"""docs/keys.md is what the tables in the code say."""

from pathlib import Path

from tomr_fault_diag.diagnosis.key_table import key_tables, summaries
from tomr_power_model.effects import EFFECTS

COMMITTED = Path(__file__).parents[3] / "docs" / "keys.md"


def test_the_committed_table_is_current() -> None:
    assert COMMITTED.read_text(encoding="utf-8") == key_tables(), "run `make docs`"


def test_every_row_has_as_many_cells_as_its_head() -> None:
    cells = 0
    for line in key_tables().replace("\\|", "").splitlines():
        if line.startswith(("| key", "| effect")):
            cells = line.count("|")
        if line.startswith("|"):
            assert line.count("|") == cells, line


def test_a_terminal_gets_all_keys_too() -> None:
    lines = list(summaries())
    for name in ("robot.mass", "cmd_vel_type", "band.power", "physics.friction.coulomb.torque"):
        assert any(line.startswith(name) for line in lines)
    assert sum(line.startswith("physics.") for line in lines) == sum(
        len(effect.parameters) for effect in EFFECTS.values()
    )
