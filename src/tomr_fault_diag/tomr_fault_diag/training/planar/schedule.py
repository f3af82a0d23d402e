"""What happens to a batch of drives, step by step: commands, faults, bumps."""

import math
from collections.abc import Sequence
from typing import Self

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_fault_diag.training.drives import Drive
from tomr_fault_diag.training.planar.fleet import RATE, Array
from tomr_sim_bridge.faults.floor_slippery import SLIPPERIEST

Single = NDArray[np.float32]

TICK = 0.05  # s
STEPS = round(TICK * RATE)  # of the drivers per tick


@frozen
class Schedule:
    """Per step of the drivers (m of them) and drive (n): what is told and what is wrong."""

    command: Array  # v_x, v_y [m/s], omega_z [rad/s], (m, 3, n)
    drive: Single  # share of the voltage that reaches the bridge, (m, 3, n)
    encoder: Single  # share of the counts that is reported, (m, 3, n)
    friction: Array  # traction coefficient, (m, n)
    push: Single  # force and moment on the body in the world [N, N, N m], (m, 3, n)
    faulty: NDArray[np.bool_]  # whether the fault is in force in a tick, (ticks, n)
    ticks: NDArray[np.int64]  # of each drive, (n,)

    @classmethod
    def of(cls, drives: Sequence[Drive], ticks: int = 0) -> Self:
        """Lay the drives side by side, as long as the longest or `ticks`; then they stand still."""
        own = np.array([math.floor(drive.length / TICK) for drive in drives])
        m, n = max(ticks, int(own.max())) * STEPS, len(drives)
        made = cls(
            command=np.zeros((m, 3, n)),
            drive=np.ones((m, 3, n), dtype=np.float32),
            encoder=np.ones((m, 3, n), dtype=np.float32),
            friction=np.tile(np.array([drive.mission.floor_friction for drive in drives]), (m, 1)),
            push=np.zeros((m, 3, n), dtype=np.float32),
            faulty=np.zeros((m // STEPS, n), dtype=bool),
            ticks=own,
        )
        for column, drive in enumerate(drives):
            made._command(column, drive)
            made._fault(column, drive)
            for bump in drive.bumps:
                rows = slice(_step(bump.start), _step(bump.start + bump.duration))
                made.push[rows, :, column] += [*bump.force, bump.moment]
        return made

    def _command(self, column: int, drive: Drive) -> None:
        plan = drive.mission.plan(drive.believed)
        told = list(plan.commands())
        steps = np.array([_step(time) for time, _ in told])
        twists = np.array([twist for _, twist in told])
        length = np.diff(np.append(steps, len(self.command)))
        rows = np.repeat(twists, np.maximum(length, 0), axis=0)
        self.command[: len(rows), :, column] = rows[: len(self.command)]

    def _fault(self, column: int, drive: Drive) -> None:
        for fault in drive.mission.faults:
            end = drive.length if fault.end is None else fault.end
            rows = slice(_step(fault.start), _step(end))
            self.faulty[math.floor(fault.start / TICK) : math.ceil(end / TICK), column] = True
            severity = float(str(fault.settings["severity"]))
            if fault.fault_id == "floor_slippery":
                fall = min(SLIPPERIEST / drive.mission.floor_friction, 1.0) ** severity
                self.friction[rows, column] *= fall
                continue
            what = self.drive if fault.fault_id == "control_signal_lost" else self.encoder
            what[rows, int(str(fault.settings["wheel"])) - 1, column] *= 1.0 - severity


def _step(time: float) -> int:
    """First step that is not before a time [s]."""
    return math.ceil(time * RATE - 1e-6)
