"""Finding the files of the Robotino data set, in a folder or in its archive."""

import csv
import math
import os
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory

from attrs import asdict, fields, frozen

from tomr_power_model.errors import InputError, one_line
from tomr_power_model.files import make_folder, write_text
from tomr_sim_bridge.importers.archive import unpack
from tomr_sim_bridge.importers.robotino import Run, read_run, write_run

ARCHIVES = (".tar.gz", ".tgz", ".tar")
BENCH = "bench"
_BENCH_FOLDER = "dc_motor_model_identification"
_SURFACE_SUFFIX = "_surface"


@frozen
class SourceFile:
    """One csv file of the data set."""

    path: Path
    place: str  # how errors name it
    surface: str  # gray, green, ..., or bench
    bag: str  # name of its recording, relative to the output folder


@frozen
class IndexRow:
    """One line of index.csv; a bench run has neither heading nor speed."""

    bag: str
    surface: str
    heading_deg: str
    speed_m_s: str
    duration_s: str
    samples: int
    largest_gap_s: str


def default_dataset() -> Path:
    """Where the data set lies: under TOMR_RECORDINGS, or beside the working copy."""
    return Path(os.environ.get("TOMR_RECORDINGS", "../shared/recordings")) / "robotino"


@contextmanager
def open_dataset(dataset: Path) -> Iterator[list[SourceFile]]:
    """Give the csv files under a folder or in an archive, sorted by recording name.

    A folder without csv files may hold the archive instead.

    Raises:
        InputError: no such folder or archive, a broken archive, or no csv files in it.
    """
    if not dataset.exists():
        raise InputError(
            f"{dataset} does not exist; give the folder `datasets` of the Robotino data set "
            "or its .tar.gz"
        )
    with TemporaryDirectory(prefix="robotino-") as scratch:
        if dataset.is_dir():
            found = _files(dataset, dataset)
            archives = sorted(path for path in dataset.iterdir() if _is_archive(path))
            if not found and len(archives) == 1:
                found = _files(unpack(archives[0], Path(scratch)), archives[0])
        elif _is_archive(dataset):
            found = _files(unpack(dataset, Path(scratch)), dataset)
        else:
            raise InputError(f"{dataset} is neither a folder nor a .tar.gz of the data set")
        if not found:
            raise InputError(f"{dataset} holds no csv files; give the folder `datasets`")
        yield found


def choose(files: Sequence[SourceFile], surfaces: Collection[str]) -> list[SourceFile]:
    """Keep the files of the named surfaces; all of them when none is named.

    Raises:
        InputError: a surface of which there is no file.
    """
    there = sorted({file.surface for file in files})
    for surface in surfaces:
        if surface not in there:
            raise InputError(f"--surface {surface}: the data set has {', '.join(there)}")
    return [file for file in files if not surfaces or file.surface in surfaces]


def import_files(
    files: Iterable[SourceFile], out: Path, storage: str, report: Callable[[str], None]
) -> tuple[int, int]:
    """Write a recording per file and `index.csv`; return how many succeeded and failed.

    A file that cannot be read is handed to `report` as one line, and the others are still done.
    The index is written in the end, also where that is an interruption.
    """
    make_folder(out)
    done = failed = 0
    index = StringIO(newline="")
    writer = csv.DictWriter(index, [field.name for field in fields(IndexRow)])
    writer.writeheader()
    try:
        for file in files:
            try:
                run = read_run(file.path, file.place)
                write_run(run, out / file.bag, storage)
            except InputError as error:
                report(one_line(error))
                failed += 1
                continue
            writer.writerow(asdict(index_row(file, run)))
            done += 1
    finally:
        write_text(out / "index.csv", index.getvalue())
    return done, failed


def index_row(file: SourceFile, run: Run) -> IndexRow:
    """Describe a run: heading and speed are those commanded in its first sample."""
    heading = speed = ""
    if run.drive is not None:
        v_x, v_y, _ = (float(value) for value in run.drive.command[0])
        heading = f"{math.degrees(math.atan2(v_y, v_x)) % 360.0:.1f}"
        speed = f"{math.hypot(v_x, v_y):.3f}"
    return IndexRow(
        bag=file.bag,
        surface=file.surface,
        heading_deg=heading,
        speed_m_s=speed,
        duration_s=f"{run.duration_s:.3f}",
        samples=len(run.stamps_ns),
        largest_gap_s=f"{run.largest_gap_s:.3f}",
    )


def _is_archive(path: Path) -> bool:
    return path.is_file() and path.name.endswith(ARCHIVES)


def _files(root: Path, shown_root: Path) -> list[SourceFile]:
    relative = sorted(
        path.relative_to(root)
        for path in root.rglob("*.csv")
        if path.is_file() and not path.name.startswith(".")
    )
    short = {path: f"{_surface(path)}/{path.stem}" for path in relative}
    count = Counter(short.values())
    return sorted(
        (
            SourceFile(
                path=root / path,
                place=str(shown_root / path),
                surface=_surface(path),
                # Folders of different experiments may repeat a name: then all of it is kept.
                bag=name if count[name] == 1 else str(path.with_suffix("")),
            )
            for path, name in short.items()
        ),
        key=lambda file: file.bag,
    )


def _surface(path: Path) -> str:
    folder = path.parent.name
    return BENCH if folder == _BENCH_FOLDER else folder.removesuffix(_SURFACE_SUFFIX) or "data"
