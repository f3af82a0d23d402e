"""Expected motion of the wheels from the commands, tick by tick."""

import math
from collections import deque
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.model.settings import ModelSettings
from tomr_power_model.model.ticks import to_ns
from tomr_power_model.physics.model import PhysicalModel, WheelMotion
from tomr_power_model.response.closed_loop import ClosedLoop, LoopState, Triple
from tomr_power_model.robot import Robot

Array = NDArray[np.float64]

# The loop runs at the driver's own rate, but no finer than this [s]: one step costs 10 us.
_FINEST_STEP = 0.004
_STOP: Triple = (0.0, 0.0, 0.0)


class ExpectedMotion:
    """Runs the closed loop over the commands, each held until the next."""

    def __init__(self, robot: Robot, model: PhysicalModel, settings: ModelSettings) -> None:
        period_s = 1e-9 * settings.ticks.period
        wanted = max(1.0 / robot.controller.rate, _FINEST_STEP)
        self._steps = max(1, math.ceil(period_s / wanted - 1e-9))
        self._period = settings.ticks.period
        self._timeout = settings.command_timeout
        self._patience = settings.stale
        self._delay = to_ns(robot.controller.delay)
        self._loop = ClosedLoop.of(robot, model, period_s / self._steps)
        self._pending: deque[tuple[int, Triple]] = deque()
        self.clear()

    def clear(self) -> None:
        """Forget all commands: what the robot does is not known until the next."""
        self._pending.clear()
        self._state: LoopState | None = None
        self._command: Triple | None = None
        self._given = 0

    def command(self, stamp_ns: int, twist: Triple) -> None:
        """Take a command; one that comes too late for its stamp acts from the next step on."""
        self._pending.append((stamp_ns + self._delay, twist))

    @property
    def steps(self) -> int:
        """Parts of a tick's window."""
        return self._steps

    def over(
        self,
        tick_ns: int,
        measured: Array,
        resisting: Array | None = None,
        warm: Array | None = None,
    ) -> WheelMotion | None:
        """Motion in the steps of the window that ends at a tick, or None without a command.

        `measured` [rad/s], (3,): where the loop starts when the first command finds the robot
        already moving; NaN after a while without encoders counts as standstill. `resisting` [N m],
        (steps, 3): torques besides those of the model; `warm` [K], (3,): windings above 25 C.
        """
        if self._state is None and not self._started(tick_ns, measured):
            return None
        assert self._state is not None
        start = tick_ns - self._period
        speeds = [self._state.speed]
        torques: Sequence[Triple | None] = [None] * self._steps
        if resisting is not None:
            torques = [_triple(row) for row in resisting]
        heat = None if warm is None else _triple(warm)
        for step, torque in enumerate(torques):
            self._advance(start + step * self._period // self._steps, torque, heat)
            speeds.append(self._state.speed)
        edges = np.array(speeds)
        rate = 1.0 / self._loop.step_s
        speed, acceleration = 0.5 * (edges[1:] + edges[:-1]), rate * (edges[1:] - edges[:-1])
        return WheelMotion(speed, acceleration, resisting=resisting)

    def _started(self, tick_ns: int, measured: Array) -> bool:
        """Take up the motion that the first command finds; without encoders, standstill."""
        if not self._pending or self._pending[0][0] > tick_ns:
            return False
        if np.isnan(measured).any() and tick_ns - self._pending[0][0] < self._patience:
            return False
        self._state = self._loop.moving(np.nan_to_num(measured))
        self._command = self._state.twist
        return True

    def _advance(self, now_ns: int, resisting: Triple | None, warm: Triple | None) -> None:
        while self._pending and self._pending[0][0] <= now_ns:
            self._given, self._command = self._pending.popleft()
        if self._timeout and now_ns > self._given + self._timeout:
            self._command = _STOP
        assert self._state is not None
        assert self._command is not None
        self._state = self._loop.step(self._state, self._command, resisting, warm)


def _triple(values: Array) -> Triple:
    first, second, third = values.tolist()
    return first, second, third
