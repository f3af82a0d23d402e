"""Power residuals of the nodes and of `tomr_gap` on the same drives, ticks and regimes."""

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from attrs import frozen
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from faults.closed_loop import Prediction, closed_loop
from faults.play import Played, play
from faults.recordings import Drive, Recordings
from faults.regimes import (
    AT_REST,
    Mask,
    noise_of,
    regimes_of,
    rms,
    tick_means,
    tick_speeds,
    undisturbed,
)
from tomr_power_model.dynamics.simulation import worker_count
from tomr_power_model.errors import InputError
from tomr_power_model.robot import Robot, load_robot

Array = NDArray[np.float64]

PATHS = ("command path", "encoder path", "closed loop")
_LONG = 120.0  # s, of the long drive


@frozen
class Compared:
    """One drive: residuals of the three predictions, on the ticks where all are known."""

    residual: Array  # W, (3, n, 3): `PATHS`, ticks, wheels
    sampled: float  # RMS of the closed loop's over power samples, not ticks [W]
    regimes: dict[str, Mask]  # of `regimes_of`
    tick_noise: Array  # of each motor's measured power while the robot stands [W], (3,)
    sample_noise: Array  # the same of single samples [W], (3,)
    rate: float  # of power samples [Hz]


def compared(played: Played, predicted: Prediction, bumps_ns: Sequence[int] = ()) -> Compared:
    """Put the residuals of a drive side by side, without what bumps do to it."""
    ticks, period = played.stamp_ns, played.period_ns
    means = [tick_means(m.time_ns, m.residual, ticks, period) for m in predicted.motors]
    residual = np.stack([played.command_path, played.encoder_path, np.stack(means, axis=1)])
    speed = tick_speeds(predicted.encoder_ns, predicted.angle, ticks, period)
    known = np.isfinite(residual).all(axis=(0, 2)) & np.isfinite(speed).all(axis=1)
    known &= undisturbed(ticks, bumps_ns)
    samples = [m.residual[undisturbed(m.time_ns, bumps_ns)] for m in predicted.motors]
    everywhere = regimes_of(np.nan_to_num(speed), 1e-9 * period)
    regimes = {name: mask[known] for name, mask in everywhere.items()}
    rest = regimes[AT_REST].all(axis=1)
    standing = ticks[known][rest]
    single = [m.measured[_standing(m.time_ns, standing, period)] for m in predicted.motors]
    return Compared(
        residual=residual[:, known],
        sampled=rms(np.concatenate(samples)),
        regimes=regimes,
        tick_noise=np.array([noise_of(wheel) for wheel in played.measured[known][rest].T]),
        sample_noise=np.array([noise_of(values) for values in single]),
        rate=float(np.median([1e9 / np.median(np.diff(m.time_ns)) for m in predicted.motors])),
    )


def _standing(time_ns: NDArray[np.int64], resting_ns: NDArray[np.int64], period_ns: int) -> Mask:
    """Which stamps lie in a tick in which no wheel moves."""
    tick = np.searchsorted(resting_ns, time_ns)
    inside = tick < len(resting_ns)
    inside[inside] = resting_ns[tick[inside]] - time_ns[inside] < period_ns
    return np.asarray(inside)


def compare(drive: Drive, robot: Path, seconds: float) -> Compared:
    """Run a drive through nodes' core and simulation."""
    played = play(drive.bag, robot, seconds)
    return compared(played, closed_loop(drive.bag, robot, seconds), drive.bumps_ns)


def compare_all(recordings: Recordings, robot: Path) -> dict[str, Compared | str]:
    """All healthy drives that no fit saw, by name; a line instead for what is refused."""
    chosen = [(f"normal {d.identity}", d, np.inf) for d in recordings.drives("drives")
              if d.is_normal]  # fmt: skip
    held = recordings.drives("healthy")[-1]
    chosen.append((f"held out {held.identity}", held, np.inf))
    for drive in recordings.drives("healthy_long"):
        chosen.append((f"long {drive.identity}", drive, _LONG))
    found: dict[str, Compared | str] = {}
    with ProcessPoolExecutor(worker_count()) as pool:
        tasks = {name: pool.submit(compare, drive, robot, end) for name, drive, end in chosen}
        for name, task in tasks.items():
            try:
                found[name] = task.result()
            except InputError as error:
                found[name] = str(error)
    return found


def power(recordings: Recordings, robot: Path, console: Console) -> None:
    """Compare all healthy drives and print the tables."""
    found = compare_all(recordings, robot)
    good = {name: item for name, item in found.items() if isinstance(item, Compared)}
    for name, item in found.items():
        if isinstance(item, str):
            console.print(f"{name}: refused: {item}")
    if good:
        console.print(drives_table(good))
        console.print(regimes_table(list(good.values()), load_robot(robot)))


def drives_table(found: dict[str, Compared]) -> Table:
    """RMS of each drive, three motors together."""
    table = Table(
        title="RMS of motor power [W], mean over ticks, 2 s after bumps left out",
        title_justify="left",
    )
    table.add_column("drive")
    for head in (*PATHS, "command / closed loop", "encoder / closed loop", "closed loop, samples"):
        table.add_column(head, justify="right")
    for name, item in found.items():
        table.add_row(name, *_cells([rms(part) for part in item.residual]), f"{item.sampled:.3f}")
    everything = [rms(np.concatenate([x.residual[k].ravel() for x in found.values()]))
                  for k in range(len(PATHS))]  # fmt: skip
    table.add_section()
    table.add_row("all", *_cells(everything), "")
    return table


def _cells(errors: list[float]) -> list[str]:
    command, encoder, loop = errors
    return [*(f"{error:.3f}" for error in errors), f"{command / loop:.2f}", f"{encoder / loop:.2f}"]


def regimes_table(found: list[Compared], robot: Robot) -> Table:
    """RMS by regime over all drives, against the noise of the sensor."""
    noise = float(np.nanmedian([item.tick_noise for item in found]))
    single = float(np.nanmedian([item.sample_noise for item in found]))
    per_tick = found[0].rate * 0.05
    stated = robot.sensors.current_noise * robot.supply.nominal_voltage
    table = Table(
        title="RMS of motor power [W] by what the wheel does; in brackets over the noise of a tick",
        caption=f"noise of the power sensor: at rest {single:.3f} W a sample, {noise:.3f} W a tick "
        f"of {per_tick:.1f} samples; as described {stated:.3f} W and "
        f"{stated / np.sqrt(per_tick):.3f} W",
        title_justify="left",
        caption_justify="left",
    )
    table.add_column("regime")
    table.add_column("ticks of wheels", justify="right")
    for head in PATHS:
        table.add_column(head, justify="right")
    for regime in found[0].regimes:
        parts = [item.residual[:, item.regimes[regime]] for item in found]
        values = np.concatenate(parts, axis=1)
        errors = [rms(part) for part in values]
        cells = [f"{error:.3f} ({error / noise:.1f})" for error in errors]
        table.add_row(regime, str(values.shape[1]), *cells)
    return table
