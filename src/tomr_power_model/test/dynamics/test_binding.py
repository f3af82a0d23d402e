"""Compiled and plain dynamics: one source, and what may be missing around the compiler."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from tomr_power_model.dynamics import binding
from tomr_power_model.effects import EFFECTS

# A function that compiles in no time, in a module of its own: compiled code is kept by file.
TWICE = """
from pathlib import Path
from tomr_power_model.dynamics import binding

def twice(number):
    return 2.0 * number

def result(folder):
    return binding._compilers(folder)[1](twice)(21.0)
"""
PLAIN = """
from tomr_power_model.dynamics.simulation import Simulation
from tomr_power_model.dynamics.vehicle import vehicle_of
from tomr_power_model.robot import shipped_robot
vehicle = vehicle_of(shipped_robot("reference"))
simulation = Simulation(vehicle)
simulation.advance(simulation.start(), simulation.inputs())
"""


@pytest.fixture
def result(tmp_path: Path) -> Callable[[Path | None], float]:
    """Compiles a function, keeps it in a folder, and calls it."""
    file = tmp_path / "twice.py"
    file.write_text(TWICE, encoding="utf-8")
    names: dict[str, Callable[[Path | None], float]] = {}
    exec(compile(TWICE, str(file), "exec"), names)
    return names["result"]


def started(code: str, **environment: str) -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [sys.executable, "-c", code],
        env={**os.environ, **environment},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def finished(process: "subprocess.Popen[str]") -> tuple[str, str]:
    out, error = process.communicate(timeout=120)
    assert process.returncode == 0, error
    return out.strip(), error.strip()


def test_without_a_place_for_compiled_code_it_is_made_anew(
    monkeypatch: pytest.MonkeyPatch, result: Callable[[Path | None], float]
) -> None:
    monkeypatch.setenv("TOMR_CACHE_DIR", "/dev/null/nowhere")
    folder = binding._cache_folder("1")
    assert folder is None
    assert result(folder) == 42.0


def test_a_read_only_home_is_replaced_by_a_temporary_folder(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.delenv("TOMR_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", "/dev/null")
    monkeypatch.setattr(binding.tempfile, "gettempdir", lambda: str(tmp_path))
    folder = binding._cache_folder("1")
    assert folder is not None
    assert tmp_path in folder.parents


def test_a_user_without_a_home_gets_a_temporary_folder(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    for name in ("TOMR_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(binding.os.path, "expanduser", lambda path: path)
    monkeypatch.setattr(binding.tempfile, "gettempdir", lambda: str(tmp_path))
    assert [place.parent for place in binding._cache_places()] == [tmp_path]


def test_compiled_code_belongs_to_all_that_it_is_made_of() -> None:
    """A change of the layout or of any effect must not meet what was compiled before it."""
    parts = {"batch", "contacts", "inverse", "layout", "numbers", "start", "step"}
    effects = {effect_id.partition(".")[2] for effect_id in EFFECTS}
    assert parts | effects <= {file.stem for file in binding._sources()}


@pytest.mark.parametrize("left", [0, 100, -1])
@pytest.mark.parametrize("kind", ["nbi", "nbc"])
def test_damaged_compiled_code_is_made_anew(
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    result: Callable[[Path | None], float],
    kind: str,
    left: int,
) -> None:
    monkeypatch.setenv("TOMR_CACHE_DIR", str(tmp_path))
    result(binding._cache_folder("1"))
    (kept,) = tmp_path.rglob(f"*.{kind}")
    kept.write_bytes(kept.read_bytes()[:left])
    assert result(binding._cache_folder("1")) == 42.0
    assert binding._is_whole(kept)


def test_code_of_two_folders_has_names_of_its_own(tmp_path: Path) -> None:
    """The linker of a process takes one function for another of the same name."""

    def law(number: float) -> float:
        return number

    folders = [tmp_path / "one", tmp_path / "two", None, None]
    names = {compiler(law).__name__ for f in folders for compiler in binding._compilers(f)}
    assert len(names) == len(folders)


def test_two_processes_may_compile_at_once(tmp_path: Path) -> None:
    (tmp_path / "twice.py").write_text(TWICE, encoding="utf-8")
    code = "import twice; print(twice.result(twice.binding._cache_folder('1')))"
    both = [started(code, TOMR_CACHE_DIR=str(tmp_path), PYTHONPATH=str(tmp_path)) for _ in range(2)]
    assert [finished(process)[0] for process in both] == ["42.0"] * 2


def test_without_numba_the_plain_dynamics_run_with_one_warning() -> None:
    code = f"""
import sys
sys.modules["numba"] = None
from tomr_power_model.dynamics.binding import compiled
{PLAIN}
assert compiled() is compiled()
state = simulation.start()
compiled().advance(simulation.numbers, state, simulation.inputs(), [0.0] * simulation.row, 3)
"""
    error = finished(started(code))[1]
    assert error.count("RuntimeWarning") == 1
    assert "pip install numba" in error


def test_what_runs_in_the_nodes_does_not_import_numba() -> None:
    code = f"""
import pkgutil, sys
from importlib import import_module
import tomr_power_model.messages, tomr_power_model.model
for package in (tomr_power_model.messages, tomr_power_model.model):
    for module in pkgutil.iter_modules(package.__path__, package.__name__ + "."):
        import_module(module.name)
{PLAIN}
print("numba" in sys.modules)
"""
    assert finished(started(code))[0] == "False"
