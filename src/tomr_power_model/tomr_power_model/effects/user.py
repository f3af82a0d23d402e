"""Effects of a user's own, in a folder of Python files: they join the vocabulary when asked for.

A file of one runs with all that the command or node may do. So no folder is looked into unless it
is named: by an option `--effects`, or for all commands and nodes by TOMR_EFFECTS.
"""

import importlib.util
import inspect
import os
import sys
from pathlib import Path

from tomr_power_model.effects.base import EFFECTS, LAWS
from tomr_power_model.errors import InputError
from tomr_power_model.files.paths import real_path

VARIABLE = "TOMR_EFFECTS"
_MOST_PARAMETERS = 3  # of an effect with laws
# What a file that is no effect's raises; whatever else it does is its own defect.
_UNUSABLE = (SyntaxError, ImportError, NameError, AttributeError, TypeError, ValueError, OSError)


def load_effects(folder: Path) -> list[str]:
    """Run the files of a folder, but for tests, and return the ids of the effects that joined.

    Raises InputError where there are none, or one is not usable.
    """
    files = _files(folder)
    if not files:
        raise InputError(f"{folder}: holds no effects: give a folder of Python files")
    found = [effect_id for file in files for effect_id in _load(real_path(file))]
    if not found:
        raise InputError(f"{folder}: no file registers an effect: see tomr_gap promote")
    return found


def load_named_effects() -> None:
    """Those of the folder that TOMR_EFFECTS names, if it does."""
    for folder in _named():
        load_effects(folder)


def named_files() -> list[Path]:
    """The files that these are in."""
    return [file for folder in _named() for file in _files(folder)]


def _named() -> list[Path]:
    named = os.environ.get(VARIABLE)
    return [Path(named)] if named else []


def _files(folder: Path) -> list[Path]:
    return [item for item in sorted(folder.glob("*.py")) if not item.name.startswith("test_")]


def _load(file: Path) -> list[str]:
    before = dict(EFFECTS)
    name = f"tomr_user_effects.{file.stem}"
    spec = importlib.util.spec_from_file_location(name, file)
    if spec is None or spec.loader is None:
        raise InputError(f"{file}: cannot be loaded: give a Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except _UNUSABLE as error:
        raise InputError(f"{file}: cannot be used ({error})") from None
    joined = [item for item, known in EFFECTS.items() if before.get(item) is not known]
    for effect_id in joined:
        _check(effect_id, before, file)
    return joined


def _check(effect_id: str, before: dict[str, type], file: Path) -> None:
    """Raise InputError, and take the effect out again, where it cannot be one of the vocabulary."""
    known, made = before.get(effect_id), EFFECTS[effect_id]
    why = ""
    if known is not None and real_path(Path(inspect.getfile(known))) != file:
        why = "that effect is there already: give it another id"
    has_law = any(getattr(made, law) is not None for law in LAWS)
    if has_law and not 0 < len(made.parameters) <= _MOST_PARAMETERS:
        why = f"an effect with a law has one to {_MOST_PARAMETERS} parameters"
    if why:
        EFFECTS.remove(effect_id)
        if known is not None:
            EFFECTS.register(known)
        raise InputError(f"{file}: {effect_id}: {why}")
