"""Files that are complete or absent, alone and together."""

import os
import signal
import stat
import subprocess
import sys
from pathlib import Path
from threading import Thread

import pytest

from tomr_power_model.errors import InputError
from tomr_power_model.files import write_text, write_together


def left(folder: Path) -> dict[str, str]:
    return {path.name: path.read_text() for path in folder.iterdir()}


def test_a_file_that_cannot_be_written_leaves_all_as_they_were(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("old")
    (tmp_path / "folder").mkdir()
    for bad in (tmp_path / "folder", tmp_path / "nowhere" / "b", tmp_path / "nul\0"):
        with pytest.raises(InputError, match="cannot be written"):
            write_together({tmp_path / "a": "new", bad: "text"}, [tmp_path / "stale"])
        assert left(tmp_path / "folder") == {}
        assert (tmp_path / "a").read_text() == "old"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "folder"]


def test_what_no_longer_belongs_goes(tmp_path: Path) -> None:
    (tmp_path / "stale").write_text("old")
    write_together({tmp_path / "a": "text", tmp_path / "b": b"bytes"}, [tmp_path / "stale"])
    assert left(tmp_path) == {"a": "text", "b": "bytes"}


def test_permissions_links_and_devices_are_kept(tmp_path: Path) -> None:
    target = tmp_path / "target"
    target.write_text("old")
    target.chmod(0o640)
    (tmp_path / "link").symlink_to(target)
    write_text(tmp_path / "link", "new")
    assert target.read_text() == "new"
    assert stat.S_IMODE(target.stat().st_mode) == 0o640
    assert (tmp_path / "link").is_symlink()
    write_text(Path("/dev/null"), "text")
    assert stat.S_ISCHR(Path("/dev/null").stat().st_mode)
    write_text(tmp_path / "odd", "a name \udcff")
    assert (tmp_path / "odd").read_text() == "a name \\udcff"
    mask = os.umask(0)
    os.umask(mask)
    assert stat.S_IMODE((tmp_path / "odd").stat().st_mode) == 0o666 & ~mask


def test_of_two_runs_the_files_of_one_are_left(tmp_path: Path) -> None:
    names = [tmp_path / name for name in ("report.html", "report.json", "robot.yaml")]

    def run(mark: str) -> None:
        for _ in range(60):
            write_together(dict.fromkeys(names, mark))

    threads = [Thread(target=run, args=(mark,)) for mark in "ab"]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
        # Whoever is done first: the other's are a whole set or none, in the end at least.
    assert len(set(left(tmp_path).values())) == 1
    assert len(left(tmp_path)) == 3


_WRITER = """
import sys
from pathlib import Path
from tomr_power_model.files import write_together
folder, size = Path(sys.argv[1]), 3_000_000
print("ready", flush=True)
while True:
    for mark in "ab":
        write_together({folder / name: mark * size for name in ("x", "y")})
"""


def test_a_killed_run_leaves_whole_files(tmp_path: Path) -> None:
    for wait in (0.0, 0.02, 0.05):
        process = subprocess.Popen(
            [sys.executable, "-c", _WRITER, str(tmp_path)], stdout=subprocess.PIPE
        )
        assert process.stdout is not None
        process.stdout.readline()
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(wait + 0.01)
        process.send_signal(signal.SIGKILL)
        process.wait()
        process.stdout.close()
        for name in ("x", "y"):
            path = tmp_path / name
            assert not path.exists() or set(path.read_text()) in ({"a"}, {"b"})
            assert not path.exists() or path.stat().st_size == 3_000_000
