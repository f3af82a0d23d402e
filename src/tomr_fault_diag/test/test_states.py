"""The page of states in docs/ is whole, and its levels are those that are published."""

import re
from pathlib import Path

from tomr_fault_diag.classifier import states
from tomr_fault_diag.classifier.advice import CHECKS
from tomr_fault_diag.classifier.states import State

PAGE = Path(__file__).parents[3] / "docs" / "states.md"


def _every() -> dict[str, str]:
    """Level by name; those of wheels once."""
    values = [getattr(states, name) for name in vars(states) if name.isupper()]
    found = [item for item in values if isinstance(item, State)]
    found += [item for row in values if isinstance(row, tuple) for item in row]
    return {re.sub(r" \d$", " n", state.name): state.level.name for state in found}


def test_every_state_has_its_row_and_level() -> None:
    rows = re.findall(r"^\| `([a-z n]+)` \| (\w+) \|.*\|(.*)\|$", PAGE.read_text(), re.MULTILINE)
    assert {name: level for name, level, _ in rows} == _every()
    checked = {name.removesuffix(" n") for name, _, look_at in rows if look_at.strip()}
    assert checked == set(CHECKS)
