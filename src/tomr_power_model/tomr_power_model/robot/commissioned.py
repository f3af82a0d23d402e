"""The record that `tomr_commission` leaves in a description: what was commissioned and when."""

import hashlib
import json
from collections.abc import Mapping

from tomr_power_model.errors import InputError

COMMISSIONING = "tomr_commission"  # section of the record
DIGEST = "description"  # its key for the digest of the description that was commissioned
DATE = "date"
_DIGITS = 16


def digest_of(described: Mapping[str, object]) -> str:
    """A short name of a description's values: equal if and only if these are."""
    plain = {
        key: list(value) if isinstance(value, tuple) else value for key, value in described.items()
    }
    text = json.dumps(plain, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:_DIGITS]


def check_commissioned(
    record: Mapping[str, object], described: Mapping[str, object], place: str
) -> None:
    """Raise InputError if another description was commissioned than the one beside the record."""
    if record and record.get(DIGEST) != digest_of(described):
        raise InputError(
            f"{place}: its values are not those that were commissioned on {record.get(DATE)}: run "
            f"tomr_commission again, or remove the section {COMMISSIONING} with the bands and the "
            "caution that belong to it"
        )
