"""Weights as arrays by name, from a file or from those that are shipped."""

from collections.abc import Callable, Mapping
from importlib.resources import as_file, files
from importlib.resources.abc import Traversable
from pathlib import Path

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.errors import InputError
from tomr_power_model.files import read_arrays

Array = NDArray[np.float64]
Shapes = Mapping[str, tuple[int, ...]]

# Files of the weights that are shipped, by the name of their classifier.
SHIPPED: Mapping[str, str] = {"window": "window.npz", "wang2024": "wang2024.npz"}


def shipped_weights(classifier: str) -> Traversable:
    """The file that comes with the package."""
    return files("tomr_fault_diag").joinpath("weights").joinpath(SHIPPED[classifier])


@frozen
class Stored:
    """How the weights of one kind of network are stored."""

    classifier: str  # whose
    network: str  # in words
    names: tuple[str, ...]
    shapes: Callable[[Mapping[str, Array]], Shapes]  # that the arrays must have together
    remedy: str = "train it again"

    def load(self, path: Path | str | None) -> dict[str, Array]:
        """Arrays of a file, or the shipped ones; raises InputError if they do not fit."""
        if path:
            return self._read(Path(path))
        with as_file(shipped_weights(self.classifier)) as file:
            return self._read(file)

    def _read(self, path: Path) -> dict[str, Array]:
        try:
            found = read_arrays(path, self.names)
        except InputError as error:
            raise InputError(f"{error}: no weights of {self.network}: {self.remedy}") from None
        for name, shape in self.shapes(found).items():
            if found[name].shape != shape or not np.isfinite(found[name]).all():
                raise InputError(
                    f"{path}: {name} has shape {found[name].shape}, needs finite numbers of "
                    f"shape {shape}: train it again"
                )
        return found
