"""Commissionings to which a faulty drive was given as a healthy one."""

import json
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from attrs import frozen
from rich.console import Console

from faults.explain import Run, measured, tool
from faults.recordings import Drive, Recordings
from tomr_power_model.cli import EXIT_OK
from tomr_power_model.errors import InputError
from tomr_power_model.files import make_folder

_HEALTHY = 3  # drives beside the faulty one


@frozen
class Spoilt:
    """One commissioning and what it came to."""

    identity: str  # of the faulty drive
    fault: str
    wheel: int | None  # 1 to 3; None: no single one
    run: Run
    reasons: tuple[str, ...]

    @property
    def is_go(self) -> bool:
        """Whether it would have been switched on."""
        return self.run.code == EXIT_OK

    @property
    def names_drive(self) -> bool:
        """Whether what speaks against it names the drive that has the fault."""
        return any(self.identity in reason for reason in self.reasons)

    @property
    def names_wheel(self) -> bool | None:
        """Whether it names the wheel with the drive; None where no single one is at fault."""
        if self.wheel is None:
            return None
        called = re.compile(rf"(wheel|motor|fault)[ _]{self.wheel}(?!\d)")
        return any(self.identity in reason and called.search(reason) for reason in self.reasons)


def faulty_drives(recordings: Recordings, only: Sequence[str]) -> tuple[Drive, ...]:
    """Those of `only`, or all that have a fault. Raises InputError for an id that there is not."""
    found = {drive.identity: drive for drive in recordings.drives("drives") if not drive.is_normal}
    absent = [name for name in only if name not in found]
    if absent:
        raise InputError(f"--only {absent[0]}: give ids of faulty drives: {', '.join(found)}")
    return tuple(found[name] for name in only or found)


def spoilt(recordings: Recordings, out: Path, only: Sequence[str], console: Console) -> None:
    """Commission with each of the faulty drives beside three healthy ones; print a line each."""
    found = []
    for one in _commissioned(recordings, out, faulty_drives(recordings, only)):
        found.append(one)
        said = "GO" if one.is_go else f"no go ({one.run.code})"
        named = f"drive {_yes(one.names_drive)}, wheel {_yes(one.names_wheel)}"
        console.print(f"{one.identity} {one.fault:24} {said:10} {named:24} {one.run.cost}")
        for reason in one.reasons:
            console.print(f"    {reason}", soft_wrap=True)
    refused = sum(not one.is_go for one in found)
    drives = sum(one.names_drive for one in found)
    wheels = [one.names_wheel for one in found if one.names_wheel is not None]
    console.print(
        f"no go: {refused} of {len(found)}; drive named: {drives}; "
        f"wheel named: {sum(wheels)} of {len(wheels)}"
    )


def _yes(is_so: bool | None) -> str:
    return "-" if is_so is None else "named" if is_so else "not named"


def _commissioned(recordings: Recordings, out: Path, drives: Sequence[Drive]) -> Iterator[Spoilt]:
    healthy = [drive.bag for drive in recordings.drives("healthy")][:_HEALTHY]
    for drive in drives:
        folder = out / drive.identity
        make_folder(folder)
        # The faulty drive is not the last: the last one is held out.
        bags = [healthy[0], drive.bag, *healthy[1:]]
        command: list[str | Path] = [tool("tomr_commission"), *bags]
        command += ["--robot", recordings.description, "--out", folder]
        run = measured(command, folder / "commission.log")
        truth = recordings.fault(drive.identity)
        yield Spoilt(drive.identity, *truth, run, tuple(reasons_of(folder, run)))


def reasons_of(folder: Path, run: Run) -> Iterator[str]:
    """What speaks against switching it on, or the line that refuses."""
    written = folder / "commission.json"
    if run.code == EXIT_OK or not written.exists():
        yield run.last
        return
    for reason in json.loads(written.read_text(encoding="utf-8"))["reasons"]:
        yield f"{reason['what']}: {reason['remedy']}"
