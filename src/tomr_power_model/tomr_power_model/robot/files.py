"""Read robot.yaml: an ordinary ROS 2 parameter file."""

from collections.abc import Iterable, Mapping
from functools import cache
from importlib.resources import files
from pathlib import Path

from tomr_power_model.errors import InputError
from tomr_power_model.files import load_yaml, read_text
from tomr_power_model.robot.commissioned import COMMISSIONING, check_commissioned
from tomr_power_model.robot.description import Robot, robot_from_parameters
from tomr_power_model.robot.parameters import SHARED_PARAMETERS, USE_SIM_TIME

EVERY_NODE = "/**"
# Section in which tomr_calibrate keeps which robot its values were fitted to.
CALIBRATION = "tomr_calibrate"
IDENTITY = "identity."


def load_robot(source: Path | str) -> Robot:
    """Read a robot description from a file, or a shipped one by name (`reference`).

    It stands in the `/**` section; sections of single nodes are theirs and not looked at.
    Raises InputError with one line that names the file, the key and the remedy.
    """
    return robot_from_parameters(read_description(source), str(source))


def read_description(source: Path | str) -> dict[str, object]:
    """Flat parameters of the `/**` section, e.g. {"robot.mass": 15.0}, not checked.

    Raises InputError as `load_robot` does where the file cannot be read, has no such section, or
    holds values fitted to another robot.
    """
    sections = read_sections(source)
    section = sections.get(EVERY_NODE)
    if not section:
        raise InputError(f"{source}: no `/**: ros__parameters:` section: see robots/reference.yaml")
    check_identity(sections.get(CALIBRATION, {}), section, str(source))
    check_commissioned(sections.get(COMMISSIONING, {}), section, str(source))
    return dict(section)


def check_identity(
    calibration: Mapping[str, object], described: Mapping[str, object], place: str
) -> None:
    """Raise InputError if values were fitted to another robot than the one described."""
    for name, fitted in calibration.items():
        key = name.removeprefix(IDENTITY)
        if key != name and described.get(key) != fitted:
            raise InputError(
                f"{place}: its values were fitted to a robot with {key} = {fitted}, not "
                f"{described.get(key)}: take that robot's own file, or fit again"
            )


def read_node_sections(source: Path | str, nodes: Iterable[str]) -> dict[str, object]:
    """Flat parameters that a description gives to some nodes: those for all nodes, then those of
    their own sections, merged. Without use_sim_time, which is no node's own."""
    sections = read_sections(source)
    shared = {spec.name for spec in SHARED_PARAMETERS}
    common = sections.get(EVERY_NODE, {})
    merged = {name: value for name, value in common.items() if name in shared}
    for node in nodes:
        merged.update(sections.get(node) or sections.get(f"/{node}") or {})
    merged.pop(USE_SIM_TIME.name, None)
    return merged


def shipped_robots() -> list[str]:
    """Names of the robots that come with the package."""
    folder = files("tomr_power_model").joinpath("robots")
    return sorted(
        entry.name.removesuffix(".yaml")
        for entry in folder.iterdir()
        if entry.name.endswith(".yaml")
    )


@cache
def shipped_robot(name: str) -> Robot:
    """A robot that comes with the package, by name; read once."""
    if name not in shipped_robots():
        raise InputError(f"robot {name!r} is not shipped: give one of {shipped_robots()}")
    return load_robot(name)


def robot_file(given: str) -> Path:
    """The file of a robot: given by its path, in which ~ is the home, or shipped, by name.

    Raises InputError where it is not there.
    """
    if given in shipped_robots():
        return Path(str(files("tomr_power_model").joinpath("robots").joinpath(f"{given}.yaml")))
    try:
        return parameter_file(given)
    except InputError as error:
        raise InputError(f"{error}, or one of {', '.join(shipped_robots())}") from None


def parameter_file(given: str) -> Path:
    """A file that is there, in whose path ~ is the home. Raises InputError where it is not."""
    path = Path(given).expanduser()
    if not path.is_file():
        raise InputError(f"{given}: no such file: give the path of a parameter file")
    return path.absolute()


def read_sections(source: Path | str) -> dict[str, dict[str, object]]:
    """Flat dotted parameters of each section of a ROS 2 parameter file, not checked."""
    document = load_yaml(_text(source), str(source))
    if not isinstance(document, Mapping):
        return {}
    found: dict[str, dict[str, object]] = {}
    for node, section in document.items():
        parameters = section.get("ros__parameters") if isinstance(section, Mapping) else None
        if not isinstance(parameters, Mapping):
            raise InputError(f"{source}: section {node!r} has no ros__parameters: add or remove it")
        found[str(node)] = _flat(parameters)
    return found


def _text(source: Path | str) -> str:
    if str(source) in shipped_robots():
        resource = files("tomr_power_model").joinpath("robots").joinpath(f"{source}.yaml")
        return resource.read_text(encoding="utf-8")
    try:
        return read_text(Path(source))
    except InputError as error:
        raise InputError(f"{error}: give a robot.yaml or one of {shipped_robots()}") from None


def _flat(tree: Mapping[object, object], prefix: str = "") -> dict[str, object]:
    """Nested mappings as dotted keys: {"robot": {"mass": 1}} -> {"robot.mass": 1}."""
    flat: dict[str, object] = {}
    for key, value in tree.items():
        name = f"{prefix}{key}"
        if isinstance(value, Mapping):
            flat.update(_flat(value, name + "."))
        else:
            flat[name] = value
    return flat
