"""Files of arrays (.npz), read within a limit and without pickled objects."""

import tokenize
import zipfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.errors import InputError
from tomr_power_model.files.text import require_regular
from tomr_power_model.limits import limits, too_large

# What zip, zlib and numpy raise for a damaged file. Where a flipped bit asks for a password or a
# compression that zipfile does not have, that is a RuntimeError.
DAMAGED = (
    OSError,
    ValueError,
    KeyError,
    EOFError,
    MemoryError,
    RuntimeError,
    SyntaxError,
    TypeError,
    tokenize.TokenError,
    zipfile.BadZipFile,
    zipfile.zlib.error,  # type: ignore[attr-defined]
)


def read_arrays(path: Path, names: Iterable[str]) -> dict[str, NDArray[np.float64]]:
    """Arrays of numbers by name. Raises InputError where that is not in the file, or too large."""
    try:
        require_regular(path)
        with zipfile.ZipFile(path) as packed:
            unpacked = sum(entry.file_size for entry in packed.infolist())
        if unpacked > limits().arrays_bytes:
            too_large(str(path), f"its arrays take {unpacked:,} bytes", "arrays_bytes")
        with np.load(path, allow_pickle=False) as stored:
            return {name: _numbers(stored[name]) for name in names}
    except DAMAGED as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path}: cannot be read ({error})") from None


def _numbers(array: NDArray[Any]) -> NDArray[np.float64]:
    if array.dtype.kind not in "iuf":
        raise ValueError(f"an array of {array.dtype}, not of numbers")
    return np.asarray(array, np.float64)
