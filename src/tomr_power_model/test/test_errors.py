"""Words of errors and notes."""

import pytest

from tomr_power_model.errors import counted


@pytest.mark.parametrize(
    ("number", "words"),
    [(0, "0 messages"), (1, "1 message"), (2, "2 messages"), (7449, "7,449 messages")],
)
def test_what_is_counted_is_plural_but_for_one(number: int, words: str) -> None:
    assert counted(number, "message") == words
