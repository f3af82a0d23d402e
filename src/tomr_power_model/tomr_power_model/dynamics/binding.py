"""The step bound to the laws of the effects: as it is, or compiled.

`step`, `contacts`, `inverse`, `start` and `batch` are plain functions that call each other and four
laws by name. Binding makes copies of them in one namespace in which the laws are those of the
effects: of those that a robot has, in plain Python; of all, where numba compiles them. So there
is one source of the dynamics, and an effect is one file.
"""

import hashlib
import importlib.util
import os
import tempfile
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from pathlib import Path
from types import FunctionType, ModuleType, SimpleNamespace
from typing import Any

from tomr_power_model.dynamics import batch, contacts, inverse, layout, start, step
from tomr_power_model.dynamics.numbers import law_offsets
from tomr_power_model.effects import EFFECTS, LAWS, base

_MODULES = (contacts, step, inverse, start, batch)
_ENTRIES = ("advance", "begin", "drive_powers", "predict", "read", "run")
_CACHE = "TOMR_CACHE_DIR"  # where compiled code is kept; default: the user's cache folder

Jit = Callable[[Any], Any]


def _as_it_is(function: Any) -> Any:
    return function


def _nothing(p: Sequence[float], at: int, state: Any) -> float:
    return 0.0


def _unchanged(p: Sequence[float], at: int, value: float) -> float:
    return value


def _one(law: Any, place: int, count: int, empty: bool, jit: Jit) -> Any:
    """A law with its parameters read from a wheel's record; neutral where its flag is not set.

    `empty`: neutral is 0, else the value that it would change.
    """
    if count == 1:

        def of_one(p: Sequence[float], at: int, state: Any) -> float:
            if p[at + place] > 0.0:
                return float(law(p[at + place + 1], state))
            return 0.0 if empty else state

        return jit(of_one)
    if count == 2:

        def of_two(p: Sequence[float], at: int, state: Any) -> float:
            if p[at + place] > 0.0:
                return float(law(p[at + place + 1], p[at + place + 2], state))
            return 0.0 if empty else state

        return jit(of_two)

    def of_three(p: Sequence[float], at: int, state: Any) -> float:
        if p[at + place] > 0.0:
            return float(law(p[at + place + 1], p[at + place + 2], p[at + place + 3], state))
        return 0.0 if empty else state

    return jit(of_three)


def _added(one: Any, other: Any, jit: Jit) -> Any:
    def both(p: Sequence[float], at: int, state: Any) -> float:
        return float(one(p, at, state) + other(p, at, state))

    return jit(both)


def _after(one: Any, other: Any, jit: Jit) -> Any:
    def both(p: Sequence[float], at: int, value: float) -> float:
        return float(other(p, at, one(p, at, value)))

    return jit(both)


def _law(name: str, effect_ids: Iterable[str], jit: Jit) -> Any:
    """The laws of one kind of several effects, as one function."""
    offsets, effects = law_offsets(), EFFECTS
    changes = name == "supplied"
    found = None
    for effect_id in effect_ids:
        law = getattr(effects[effect_id], name)
        if law is None:
            continue
        count = len(effects[effect_id].parameters)
        made = _one(jit(law), offsets[effect_id], count, not changes, jit)
        join = _after if changes else _added
        found = made if found is None else join(found, made, jit)
    return found or jit(_unchanged if changes else _nothing)


def _bound(effect_ids: Iterable[str], jit: Jit, entry: Jit) -> Any:
    """Copies of all functions of the dynamics, in one namespace with the laws."""
    ids = tuple(effect_ids)
    # numba looks the module up by its name when it loads what it compiled.
    names: dict[str, Any] = {"__builtins__": __builtins__, "__name__": step.__name__}
    plain: dict[str, FunctionType] = {}
    for module in _MODULES:
        for name, value in vars(module).items():
            if isinstance(value, FunctionType) and value.__module__ == module.__name__:
                plain[name] = value
            elif not name.startswith("__") and names.setdefault(name, value) != value:
                raise RuntimeError(f"{module.__name__}.{name} means something else elsewhere")
    for name, function in plain.items():
        copy = FunctionType(function.__code__, names, name, function.__defaults__)
        names[name] = (entry if name in _ENTRIES else jit)(copy)
    for law in LAWS:
        names[law] = _law(law, ids, jit)
    return SimpleNamespace(**{name: names[name] for name in _ENTRIES})


@cache
def plain(effect_ids: tuple[str, ...]) -> Any:
    """The dynamics as they are, with the laws of some effects only: others would add nothing."""
    present = [name for name in law_offsets() if name in effect_ids]
    return _bound(present, _as_it_is, _as_it_is)


def has_compiler() -> bool:
    """Whether numba is installed."""
    return importlib.util.find_spec("numba") is not None


@cache
def compiled() -> Any:
    """The dynamics compiled, with the laws of all effects; plain where there is no numba.

    Compiled code is kept in a folder named after all that it was made of, if there is one that
    can be written to; else it is made anew in each process.
    """
    if not has_compiler():
        return plain(tuple(EFFECTS))
    import numba

    config: Any = numba.config
    folder = _cache_folder(numba.__version__)

    def jit(function: Any) -> Any:
        return numba.njit(nogil=True, error_model="numpy")(function)

    def entry(function: Any) -> Any:
        before = config.CACHE_DIR
        config.CACHE_DIR = "" if folder is None else str(folder)
        try:
            cached = folder is not None
            return numba.njit(nogil=True, error_model="numpy", cache=cached)(function)
        finally:
            config.CACHE_DIR = before

    return _bound(EFFECTS, jit, entry)


def _cache_folder(version: str) -> Path | None:
    """A folder for compiled code of just these sources; None if none can be written to."""
    digest = hashlib.sha256(version.encode())
    for source in sorted(_sources()):
        digest.update(source.read_bytes())
    given = os.environ.get(_CACHE)
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "tomr"
    places = [Path(given)] if given else [home, Path(tempfile.gettempdir()) / f"tomr-{_user()}"]
    for place in places:
        folder = place / digest.hexdigest()[:16]
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                return folder
        except OSError:
            continue
    return None


def _user() -> int:
    return os.getuid()


def _sources() -> set[Path]:
    modules: list[ModuleType] = [*_MODULES, layout, base]
    files = {Path(__file__), *(Path(str(module.__file__)) for module in modules)}
    for effect in EFFECTS.values():
        module = importlib.import_module(effect.__module__)
        files.add(Path(str(module.__file__)))
    return files
