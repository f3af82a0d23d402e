"""metadata.yaml of a rosbag2 folder: which files hold the recording, and how they are packed."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path, PurePosixPath

from attrs import frozen

from tomr_power_model.errors import InputError
from tomr_power_model.files import load_yaml, read_text

FILE_NAME = "metadata.yaml"
_NEWEST = 9  # version of the format
_MODES = ("", "none", "file", "message")


@frozen
class Metadata:
    """What is taken from it; the rest the storage files say themselves."""

    files: tuple[Path, ...]
    mode: str  # of compression: "", "file" or "message"


def read_metadata(folder: Path) -> Metadata:
    """Read it. Raises InputError where it cannot be read, or names files outside its folder."""
    path = folder / FILE_NAME
    document = load_yaml(read_text(path), str(path))
    information = _mapping(document).get("rosbag2_bagfile_information")
    if not isinstance(information, Mapping):
        raise InputError(f"{path}: no rosbag2_bagfile_information")
    version = information.get("version")
    if not isinstance(version, int) or version > _NEWEST:
        raise InputError(f"{path}: version = {version!r}: 1 to {_NEWEST} are known")
    mode = str(information.get("compression_mode", "")).lower()
    packing = information.get("compression_format") or "zstd"
    if mode not in _MODES or packing != "zstd":
        raise InputError(f"{path}: compression {mode} by {packing!r} is unknown")
    names = information.get("relative_file_paths")
    if not isinstance(names, list) or not names:
        raise InputError(f"{path}: relative_file_paths names no file")
    files = tuple(_inside(folder, name, path) for name in names)
    return Metadata(files, "" if mode == "none" else mode)


def _mapping(value: object) -> Mapping[object, object]:
    return value if isinstance(value, Mapping) else {}


def _inside(folder: Path, name: object, place: Path) -> Path:
    """A file of the folder; early versions wrote the folder's name before it."""
    parts = PurePosixPath(name).parts if isinstance(name, str) and "\0" not in name else ()
    if not parts or len(parts) > 2 or parts[0] == "/" or ".." in parts:
        raise InputError(f"{place}: relative_file_paths: {name!r} is no file of its folder")
    file = folder / parts[-1]
    if not file.exists():
        raise InputError(f"{place}: {parts[-1]} is missing: copy the whole folder")
    return file
