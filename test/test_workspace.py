"""The packages as installed: commands, package.xml, data files, and who may import whom."""

import ast
import contextlib
import functools
import os
import re
import runpy
import subprocess
import sys
import sysconfig
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any
from unittest.mock import patch

import pytest
import setuptools

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = sorted(path.parent for path in ROOT.glob("src/*/package.xml"))
# What the shell of a newcomer has: nothing of ROS, nothing sourced.
BARE_ENVIRONMENT = {"PATH": "/usr/bin:/bin", "HOME": os.environ.get("HOME", "/")}
# Imported module -> (key in package.xml, name in requirements.txt); ROS modules are named alike.
LIBRARIES = {
    "attr": ("python3-attrs", "attrs"),
    "attrs": ("python3-attrs", "attrs"),
    "hypothesis": ("python3-hypothesis", "hypothesis"),
    "jinja2": ("python3-jinja2", "Jinja2"),
    "lz4": ("python3-lz4", "lz4"),
    "matplotlib": ("python3-matplotlib", "matplotlib"),
    "mujoco": ("python3-mujoco-pip", "mujoco"),
    "numba": ("python3-numba", "numba"),
    "numpy": ("python3-numpy", "numpy"),
    "pytest": ("python3-pytest", "pytest"),
    "rich": ("python3-rich", "rich"),
    "rosbags": ("python3-rosbags-pip", "rosbags"),
    "scipy": ("python3-scipy", "scipy"),
    "tqdm": ("python3-tqdm", "tqdm"),
    "websockets": ("python3-websockets", "websockets"),
    "yaml": ("python3-yaml", "PyYAML"),
}
# What no package.xml can name: requirements-train.txt.
TRAINING = {"torch"}
# Only a fleet of recordings needs Dask: requirements-fleet.txt.
FLEET = {"distributed"}
# What tests of several packages share; pyproject.toml puts it on their path.
SHARED = {path.stem for path in ROOT.glob("test/*.py")}


@functools.cache
def setup_arguments(package: Path) -> dict[str, Any]:
    """What the package's setup.py gives setuptools."""
    stated: dict[str, Any] = {}
    with contextlib.chdir(package), patch("setuptools.setup", lambda **given: stated.update(given)):
        runpy.run_path("setup.py")
    return stated


def commands(package: Path) -> list[str]:
    scripts = setup_arguments(package)["entry_points"]["console_scripts"]
    return [script.partition("=")[0].strip() for script in scripts]


def imports(path: Path) -> Iterator[str]:
    """Full names of the modules that a file imports, wherever in it."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            yield node.module
            yield from (f"{node.module}.{name.name}" for name in node.names)


def each_package(*subset: str) -> pytest.MarkDecorator:
    chosen = [path for path in PACKAGES if not subset or path.name in subset]
    return pytest.mark.parametrize("package", chosen, ids=lambda path: path.name)


def each_command() -> pytest.MarkDecorator:
    chosen = [(package, name) for package in PACKAGES for name in commands(package)]
    return pytest.mark.parametrize(("package", "command"), chosen, ids=[name for _, name in chosen])


@each_command()
def test_command_explains_itself_without_sourcing_anything(package: Path, command: str) -> None:
    program = Path(sysconfig.get_path("scripts"), command)
    run = subprocess.run(
        [program, "--help"], env=BARE_ENVIRONMENT, capture_output=True, text=True, timeout=60
    )
    assert run.returncode == 0, run.stderr
    assert "usage" in run.stdout.lower()
    assert run.stderr == ""


@each_command()
def test_colcon_installs_command_where_ros2_run_looks(package: Path, command: str) -> None:
    program = ROOT / "install" / package.name / "lib" / package.name / command
    assert os.access(program, os.X_OK), f"{program} is missing: run `make setup`"


def test_packages_are_taken_out_before_they_are_installed_anew() -> None:
    """One by one pip would lose a command that has moved to a package that it installs earlier."""
    changed = "src/tomr_training/setup.py"
    steps = subprocess.run(
        ["make", "-n", "-W", changed, "setup"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout
    assert -1 < steps.find("pip uninstall") < steps.find(" -e src/")


def test_command_runs_after_sourcing_the_workspace() -> None:
    program = "install/tomr_power_model/lib/tomr_power_model/power_model"
    run = subprocess.run(
        ["bash", "-c", f". install/setup.bash && exec {program} --help"],
        cwd=ROOT,
        env=BARE_ENVIRONMENT,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert run.returncode == 0, run.stderr
    assert "usage" in run.stdout.lower()


@each_package()
def test_install_has_what_ros2_looks_for(package: Path) -> None:
    share = ROOT / "install" / package.name / "share"
    assert (share / "ament_index/resource_index/packages" / package.name).exists()
    expected = {"package.xml"}
    for folder in ("launch/*.launch.py", "config/*", "*/robots/*.yaml", "*/missions/*.yaml"):
        expected |= {f"{file.parent.name}/{file.name}" for file in package.glob(folder)}
    installed = {
        str(file.relative_to(share / package.name))
        for file in share.rglob("*.*")
        if file.is_relative_to(share / package.name)
    }
    assert expected <= installed


@each_package()
def test_package_xml_agrees_with_setup(package: Path) -> None:
    root = ET.parse(package / "package.xml").getroot()
    stated = setup_arguments(package)
    for tag, key in (
        ("name", "name"),
        ("version", "version"),
        ("description", "description"),
        ("license", "license"),
        ("maintainer", "maintainer"),
    ):
        assert root.findtext(tag) == stated[key]
    assert stated["version"] == setup_arguments(PACKAGES[0])["version"]
    address = root.find("maintainer").attrib["email"]  # type: ignore[union-attr]
    assert address == stated["maintainer_email"]
    # colcon builds plain Python, without a word, where it takes the address for invalid.
    assert re.fullmatch(r"[-\w.]+@[-\w]+(\.[-\w]+)+", address)
    assert root.findtext("export/build_type") == "ament_python"


@each_package()
def test_every_file_of_the_package_is_installed(package: Path) -> None:
    with contextlib.chdir(package):
        stated = {**setup_arguments(package), "script_name": "setup.py"}
        command = setuptools.Distribution(stated).get_command_obj("build_py")
        command.ensure_finalized()
        installed = {str(Path(file)) for _, _, file in command.find_all_modules()}
        for _, folder, _, files in command.data_files:
            installed |= {str(Path(folder, file)) for file in files}
    present = {
        str(file.relative_to(package))
        for file in (package / package.name).rglob("*")
        if file.is_file()
        and not re.search(r"/(__pycache__|\.\w+)/", str(file.relative_to(package)))
    }
    forgotten = present - installed
    assert not forgotten, "no __init__.py beside it, or not in package_data of setup.py"


def _pins(file: str) -> set[str]:
    """Names and exact versions that a file of requirements asks for, as `pip` compares names."""
    found = re.findall(r"^([\w.-]+)(?:\[\w+\])?==([\w.]+)", (ROOT / file).read_text(), re.MULTILINE)
    return {f"{re.sub('[-_.]+', '-', name).lower()}=={version}" for name, version in found}


@pytest.mark.parametrize("kind", ["dev", "fleet"])
def test_what_is_installed_is_locked_with_hashes(kind: str) -> None:
    locked = _pins(f"requirements-{kind}.lock")
    asked = _pins("requirements.txt") | _pins(f"requirements-{kind}.txt")
    assert asked
    assert asked <= locked, "run `make lock`"
    entries = re.split(r"^(?=\w)", (ROOT / f"requirements-{kind}.lock").read_text(), flags=re.M)
    assert all("--hash=sha256:" in entry for entry in entries[1:])


@each_package()
def test_imports_are_declared(package: Path) -> None:
    declared = {
        element.text
        for element in ET.parse(package / "package.xml").getroot()
        if element.tag in ("exec_depend", "test_depend", "depend")
    }
    pinned = set(re.findall(r"^([\w-]+)", (ROOT / "requirements.txt").read_text(), re.MULTILINE))
    pinned |= {"hypothesis", "pytest"}
    for file in (*(package / package.name).rglob("*.py"), *package.glob("*/*.py")):
        known = {
            package.name,
            *sys.stdlib_module_names,
            *(TRAINING if package.name == "tomr_training" else ()),
        }
        known |= FLEET if "fleet" in str(file.relative_to(package)) else set()
        known |= SHARED if file.parent.name == "test" else set()
        for name in {full.partition(".")[0] for full in imports(file)} - known:
            key, requirement = LIBRARIES.get(name, (name, None))
            assert key in declared, f"{file} imports {name}: package.xml does not declare {key}"
            if requirement is not None:
                assert requirement in pinned, f"{file} imports {name}: not in requirements.txt"


ROS_FREE = ("fault_diag", "odometry", "power_model", "reality_gap", "sim_bridge", "view")


@each_package(*(f"tomr_{name}" for name in ROS_FREE))
def test_only_nodes_import_rclpy(package: Path) -> None:
    allowed = {"nodes", "cli"}
    for file in (package / package.name).rglob("*.py"):
        inside = file.relative_to(package / package.name).parts
        if inside[0] not in allowed and not file.name.endswith("_node.py"):
            assert not [name for name in imports(file) if name.split(".")[0] == "rclpy"], file


@pytest.mark.parametrize(
    "node", ["power_model", "power_residuals", "fault_classifier", "diagnosis"]
)
def test_nodes_import_nothing_large(node: str) -> None:
    """Each would add seconds and tens of megabytes to a node on a small computer."""
    package = "tomr_power_model" if node == "power_model" else "tomr_fault_diag"
    program = f"import {package}.nodes.{node}_node, sys; print(*sys.modules)"
    run = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert not {"scipy", "numba", "matplotlib", "rosbags", "torch"} & set(run.stdout.split())


def test_a_fit_imports_neither_pictures_nor_all_of_statistics() -> None:
    """Together they would add a tenth to the memory of `tomr_gap explain`."""
    program = "import tomr_reality_gap.cli, tomr_reality_gap.explain, sys; print(*sys.modules)"
    run = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert not {"matplotlib", "jinja2", "scipy.stats"} & set(run.stdout.split())


def test_launch_files_start_commands_that_exist() -> None:
    known = {(package.name, name) for package in PACKAGES for name in commands(package)}
    started = set()
    for file in ROOT.glob("src/*/launch/*.launch.py"):
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.Call):
                given = {key.arg: key.value for key in node.keywords}
                named = [given.get("package"), given.get("executable")]
                if all(isinstance(value, ast.Constant) for value in named):
                    started.add(tuple(value.value for value in named))
    nodes = {
        "power_model",
        "power_residuals",
        "fault_classifier",
        "tomr_diagnosis",
        "sim_bridge",
        "slip_odometry",
    }
    assert {command for _, command in started} == nodes
    assert started <= known


class _Said:
    """Something of `launch` or `launch_ros`, which need a ROS installation: keeps what it hears."""

    def __init__(self, *given: Any, **named: Any) -> None:
        self.given, self.named = given, named


class _Launch(ModuleType):
    def __getattr__(self, name: str) -> type[_Said]:
        return type(name, (_Said,), {})


def test_the_diagnosis_is_launched_as_three_nodes_or_as_one() -> None:
    names = ["", ".actions", ".conditions", ".substitutions", ".parameter_descriptions"]
    modules = [f"{package}{name}" for package in ("launch", "launch_ros") for name in names]
    file = ROOT / "src/tomr_fault_diag/launch/diagnosis.launch.py"
    with patch.dict(sys.modules, {name: _Launch(name) for name in modules}):
        (stated,) = runpy.run_path(str(file))["generate_launch_description"]().given
    nodes = [action.named for action in stated if type(action).__name__ == "Node"]
    started: dict[str, set[str]] = {"IfCondition": set(), "UnlessCondition": set()}
    for node in nodes:
        (switch,) = node["condition"].given
        assert switch.given == ("composition",)
        started[type(node["condition"]).__name__].add(node["executable"])
        # The robot comes first, then settings, which may change its values; arguments count most.
        own = [name for values in node["parameters"][2:] for name in values]
        assert {"use_sim_time", "hardware_id"} <= set(own)
        assert ("managed" in own) == (node["executable"] == "tomr_diagnosis")
    assert started == {
        "IfCondition": {"tomr_diagnosis"},
        "UnlessCondition": {"power_model", "power_residuals", "fault_classifier"},
    }
    arguments = {action.given[0] for action in stated if "default_value" in action.named}
    used = {
        value.given[0].given[0] for n in nodes for v in n["parameters"][2:] for value in v.values()
    }
    assert used <= arguments


def test_launch_files_name_files_that_are_installed() -> None:
    named = set()
    for file in ROOT.glob("src/*/launch/*.launch.py"):
        for node in ast.walk(ast.parse(file.read_text())):
            match node:
                case ast.List([ast.Call(ast.Name("FindPackageShare"), [package]), *rest]):
                    name, *parts = (ast.literal_eval(part) for part in (package, *rest))
                    named.add(ROOT.joinpath("install", name, "share", name, *parts))
    assert {file.name for file in named} == {"diagnosis.launch.py"}
    assert all(file.is_file() for file in named)


def test_shipped_robots_and_missions_are_read_alike_from_source_and_share() -> None:
    for package in PACKAGES:
        for file in package.glob(f"{package.name}/[rm]*/*.yaml"):
            share = ROOT / "install" / package.name / "share" / package.name
            assert (share / file.parent.name / file.name).read_bytes() == file.read_bytes()


def test_results_are_written_whole_or_not_at_all() -> None:
    """By `files.write`, which leaves no half of a file, whatever ends the process."""
    straight = re.compile(r"\.write_(text|bytes)\(|savefig\((?!buffer|drawn)")
    sources = [path for path in ROOT.glob("src/*/tomr_*/**/*.py") if path.is_file()]
    assert len(sources) > 100
    assert [path.name for path in sources if straight.search(path.read_text("utf-8"))] == []
