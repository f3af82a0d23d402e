"""Unpacking the data set's archive, within limits: an archive of kilobytes may hold gigabytes."""

import shutil
import tarfile
import zlib
from pathlib import Path, PurePosixPath

from tomr_power_model.errors import InputError
from tomr_power_model.files import require_regular
from tomr_power_model.limits import limits, too_large

_KEPT = ".csv"
_LARGEST_HEADER = 1 << 20  # bytes: tarfile reads headers whole


class _Bounded(tarfile.TarInfo):
    """A member whose extended header is refused before it is read, if it is large."""

    def _proc_member(self, archive: tarfile.TarFile) -> tarfile.TarInfo:
        if self.type in _HEADERS and self.size > _LARGEST_HEADER:
            raise tarfile.ReadError(f"a header of {self.size:,} bytes")
        return super()._proc_member(archive)  # type: ignore[misc, no-any-return]


_HEADERS = (
    tarfile.GNUTYPE_LONGNAME,
    tarfile.GNUTYPE_LONGLINK,
    tarfile.XHDTYPE,
    tarfile.XGLTYPE,
    tarfile.SOLARIS_XHDTYPE,
)


def unpack(archive: Path, folder: Path) -> Path:
    """Unpack the csv files of an archive; other members, links among them, are left out.

    Raises:
        InputError: damaged, more than the limits allow, or a path that leaves the folder.
    """
    try:
        require_regular(archive)
        # Read once from its beginning to its end; nothing is unpacked to find out its size.
        with tarfile.open(archive, mode="r|*", tarinfo=_Bounded) as tar:
            _extract(tar, archive, folder)
    # TypeError: of tarfile where a compressed file ends within its header.
    except (tarfile.TarError, EOFError, OSError, TypeError, ValueError, zlib.error) as error:
        if isinstance(error, InputError):
            raise
        reason = " ".join(str(error).split())
        raise InputError(f"{archive} cannot be unpacked: {reason}; download it again") from error
    return folder


def _extract(tar: tarfile.TarFile, archive: Path, folder: Path) -> None:
    files = size = 0
    while (member := tar.next()) is not None:
        tar.members.clear()  # type: ignore[attr-defined] # it keeps them all
        files, size = files + 1, size + member.size
        if files > limits().archive_files:
            too_large(str(archive), f"more than {files - 1:,} members", "archive_files")
        if size > limits().archive_bytes:
            too_large(str(archive), f"it unpacks to {size:,} bytes or more", "archive_bytes")
        path = PurePosixPath(member.name)
        if path.is_absolute() or ".." in path.parts:
            raise InputError(f"{archive}: {member.name!r} leads out of it: download it again")
        source = tar.extractfile(member) if member.isreg() and path.suffix == _KEPT else None
        if source is None:
            continue
        target = folder.joinpath(*path.parts)
        target.parent.mkdir(parents=True, exist_ok=True)
        with target.open("wb") as file:
            shutil.copyfileobj(source, file)
