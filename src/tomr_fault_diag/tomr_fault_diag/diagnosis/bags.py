"""Which recordings are meant by the paths on a command line."""

from collections.abc import Iterable
from pathlib import Path

from tomr_power_model.errors import InputError
from tomr_power_model.recordings.reader import FILE_SUFFIXES


def is_bag(path: Path) -> bool:
    """Whether a path is one recording: a file, or a folder with storage files or metadata."""
    if not path.is_dir():
        return True
    return any(f.name == "metadata.yaml" or f.suffix in FILE_SUFFIXES for f in path.iterdir())


def _is_hidden(path: Path) -> bool:
    return any(part.startswith(".") for part in path.parts)


def find_bags(paths: Iterable[Path]) -> list[Path]:
    """The recordings, with those in folders at any depth, each once, hidden ones left out: a
    recorder may be at work there.

    Raises InputError for a folder without any.
    """
    found: dict[Path, None] = {}
    for path in paths:
        if is_bag(path):
            found[path] = None
            continue
        inside = sorted(
            folder
            for folder in path.rglob("*")
            if folder.is_dir() and not _is_hidden(folder.relative_to(path)) and is_bag(folder)
        )
        if not inside:
            raise InputError(
                f"{path} holds no recording; give a rosbag2 folder, or a folder of them"
            )
        found.update(dict.fromkeys(inside))
    return list(found)
