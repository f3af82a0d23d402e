"""The step bound to the laws of the effects: as it is, or compiled.

`step`, `contacts`, `inverse`, `start` and `batch` are plain functions that call each other and four
laws by name. Binding makes copies of them for which the laws are those of the effects: of those
that a robot has, in plain Python; of all, where numba compiles them. So there is one source of the
dynamics, and an effect is one file.
"""

import hashlib
import importlib.util
import inspect
import os
import pickletools
import tempfile
import warnings
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from io import BytesIO
from pathlib import Path
from types import FunctionType, ModuleType, SimpleNamespace
from typing import Any
from uuid import uuid4

from tomr_power_model.dynamics import batch, contacts, inverse, layout, numbers, start, step
from tomr_power_model.effects import EFFECTS, LAWS, base

_MODULES = (contacts, step, inverse, start, batch)
_ENTRIES = (
    *("advance", "begin", "control", "drive_power", "drive_powers", "motor_currents"),
    *("one_drive_power", "predict", "read", "run", "tractions"),
)
_CACHE = "TOMR_CACHE_DIR"  # where compiled code is kept; default: the user's cache folder
_ROOM = 2_000_000  # bytes that it takes, and some more

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
    offsets = numbers.law_offsets()
    changes = name == "supplied"
    found = None
    for effect_id in effect_ids:
        law = getattr(EFFECTS[effect_id], name)
        if law is None:
            continue
        count = len(EFFECTS[effect_id].parameters)
        made = _one(jit(law), offsets[effect_id], count, not changes, jit)
        join = _after if changes else _added
        found = made if found is None else join(found, made, jit)
    return found or jit(_unchanged if changes else _nothing)


def _bound(effect_ids: Iterable[str], jit: Jit, entry: Jit) -> Any:
    """Copies of all functions of the dynamics, which call each other and the laws."""
    ids = tuple(effect_ids)
    copies: dict[Any, Any] = {getattr(step, law): _law(law, ids, jit) for law in LAWS}
    # One namespace a module: a name may be a place in the layout here, a kind of channel there.
    spaces = [dict(vars(module)) for module in _MODULES]
    for names in spaces:
        for name, value in names.items():
            own = isinstance(value, FunctionType) and value.__module__ == names["__name__"]
            if own and value not in copies:
                copy = FunctionType(value.__code__, names, name, value.__defaults__)
                copies[value] = (entry if name in _ENTRIES else jit)(copy)
    for names in spaces:
        names.update({k: copies[v] for k, v in names.items() if isinstance(v, FunctionType)})
    found = {name: names[name] for names in spaces for name in _ENTRIES if name in names}
    return SimpleNamespace(**found)


def plain(effect_ids: tuple[str, ...]) -> Any:
    """The dynamics as they are, with the laws of some effects only: others would add nothing."""
    return _plain(
        tuple(name for name in numbers.law_offsets() if name in effect_ids), tuple(EFFECTS)
    )


@cache
def _plain(present: tuple[str, ...], vocabulary: tuple[str, ...]) -> Any:
    """Where a law finds its parameters depends on the vocabulary as well."""
    return _bound(present, _as_it_is, _as_it_is)


def has_numba() -> bool:
    """Whether there is something to compile with."""
    return importlib.util.find_spec("numba") is not None


def compiled() -> Any:
    """The dynamics compiled, with the laws of all effects; plain where there is no numba.

    Compiled code is kept in a folder named after all that it was made of, if there is one that
    can be written to; else it is made anew in each process.
    """
    return _compiled(tuple(EFFECTS))


@cache
def _compiled(vocabulary: tuple[str, ...]) -> Any:
    try:
        import numba
    except ImportError as error:
        warnings.warn(
            f"no compiler ({error}): simulations take a hundred times as long; pip install numba",
            RuntimeWarning,
            stacklevel=3,
        )
        return plain(vocabulary)
    jit, entry = _compilers(_cache_folder(numba.__version__))
    return _bound(vocabulary, jit, entry)


def _compilers(folder: Path | None) -> tuple[Jit, Jit]:
    """For inner functions, and for entries, whose compiled code is kept in a folder if there is."""
    import numba

    config: Any = numba.config
    tag = uuid4().hex if folder is None else folder.name

    def renamed(function: Any) -> Any:
        """Of another vocabulary's code in one process the linker would take what has its name."""
        name = f"{function.__name__}_{tag}"
        parts = (function.__globals__, name, function.__defaults__, function.__closure__)
        copy = FunctionType(function.__code__, *parts)
        copy.__qualname__, copy.__module__ = name, function.__module__
        return copy

    def jit(function: Any) -> Any:
        return numba.njit(nogil=True, error_model="numpy")(renamed(function))

    def entry(function: Any) -> Any:
        before = config.CACHE_DIR
        config.CACHE_DIR = "" if folder is None else str(folder)
        try:
            cached = folder is not None
            return numba.njit(nogil=True, error_model="numpy", cache=cached)(renamed(function))
        finally:
            config.CACHE_DIR = before

    return jit, entry


def _cache_folder(version: str) -> Path | None:
    """A folder for compiled code of just these sources; None if none can be written to."""
    digest = hashlib.sha256(version.encode())
    for source in sorted(_sources()):
        digest.update(source.read_bytes())
    for place in _cache_places():
        folder = place / digest.hexdigest()[:16]
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder) as probe:
                probe.write(bytes(_ROOM))
            for kept in folder.rglob("*.nb[ci]"):
                if not _is_whole(kept):
                    kept.unlink(missing_ok=True)
            return folder
        except OSError:
            continue
    return None


def _cache_places() -> list[Path]:
    given = os.environ.get(_CACHE)
    if given:
        return [Path(given)]
    # Path.home() raises where there is none; "~" then stays as it is.
    home = Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"))
    spare = Path(tempfile.gettempdir()) / f"tomr-{os.getuid()}"
    return [home / "tomr", spare] if home.is_absolute() else [spare]


def _is_whole(file: Path) -> bool:
    """Whether a file is of complete pickles: a robot switched off while it writes leaves others."""
    data = BytesIO(file.read_bytes())
    size = len(data.getvalue())
    try:
        while data.tell() < size:
            for _ in pickletools.genops(data):
                pass
    except (ValueError, IndexError, UnicodeDecodeError):
        return False
    return size > 0


def _sources() -> set[Path]:
    modules: list[ModuleType] = [*_MODULES, layout, numbers, base]
    files = {Path(__file__), *(Path(str(module.__file__)) for module in modules)}
    return files | {Path(inspect.getfile(effect)) for effect in EFFECTS.values()}
