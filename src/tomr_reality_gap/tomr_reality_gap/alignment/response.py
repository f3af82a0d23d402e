"""How drivers answer to commands, from wheel speeds alone: how late, with which ramp and loop."""

from collections.abc import Mapping, Sequence

import numpy as np
from attrs import evolve
from numpy.typing import NDArray

from tomr_power_model.drive.astray import ramp_in
from tomr_power_model.estimation.noise import rows_of
from tomr_power_model.robot import Robot
from tomr_reality_gap.alignment.channels import Channel
from tomr_reality_gap.alignment.simulation import RecordingSimulation, predict_all

Array = NDArray[np.float64]

DELAY, INTEGRAL = "controller.delay", "controller.integral"
ACCELERATION = "controller.acceleration_limit"

_LATER = np.arange(-0.2, 0.41, 0.02)  # s, beyond the described delay
_FINER = np.arange(-0.018, 0.019, 0.002)  # s, around the best of these
_BELIEVED = 0.01  # s: what is less is known no better than stamps are
_USUAL = 10.0  # 1/s, of an integral gain over the proportional one
_GAIN = 50.0  # of log likelihood: what is called better
_NEARER = np.arange(0.8, 1.26, 0.05)  # of the limit that it shows


def controller_alternatives(
    simulations: Sequence[RecordingSimulation], robot: Robot
) -> Mapping[str, float]:
    """Values of the controller, by key, with which wheels turn much more as they were seen to.

    All are far off or right: a late command shows for as long as it is late, which no derivative
    at the described delay shows; a loop without an integral leaves an error, with any none; a ramp
    that is not described shows for as long as it takes.
    """
    seen = [
        evolve(item, channels=tuple(_early(c) for c in item.channels if c.kind == "speed"))
        for item in simulations
    ]
    if not any(item.channels for item in seen):
        return {}
    value = np.concatenate([c.value for item in seen for c in item.channels])
    found = {}
    limit = _ramp(seen, value, robot)
    if limit is not None:
        found[ACCELERATION] = limit
        robot = answering(robot, found)
    proportional = robot.controller.proportional
    other = 0.0 if robot.controller.integral else _USUAL * proportional
    loops = {robot.controller.integral: robot}
    loops[other] = answering(robot, {INTEGRAL: other})
    delays = _LATER[_LATER + robot.controller.delay >= 0.0]
    delays = np.concatenate([[0.0], delays[np.abs(delays) > 0.5 * _BELIEVED]])
    rows = {
        integral: predict_all(seen, [looped], later=delays[1:].tolist())
        for integral, looped in loops.items()
    }
    likely = {integral: _likely(value, item).max() for integral, item in rows.items()}
    best = max(likely, key=lambda integral: float(likely[integral]))
    if likely[best] > likely[robot.controller.integral] + _GAIN:
        found[INTEGRAL] = best
    answers = _answers(seen, value, rows[best])
    late = float(delays[np.argmax(answers)])
    if answers.max() > answers[0] + _GAIN and abs(late) > _BELIEVED:
        finer = late + _FINER[_FINER + late + robot.controller.delay >= 0.0]
        closer = predict_all(seen, [loops[best]], later=finer.tolist())[1:]
        late = float(finer[np.argmax(_answers(seen, value, closer))])
        found[DELAY] = robot.controller.delay + late
    return found


def answering(robot: Robot, alternatives: Mapping[str, float]) -> Robot:
    """A robot whose drivers are as `controller_alternatives` has them."""
    controller = robot.controller
    return evolve(
        robot,
        controller=evolve(
            controller,
            acceleration_limit=alternatives.get(ACCELERATION, controller.acceleration_limit),
            integral=alternatives.get(INTEGRAL, controller.integral),
            delay=alternatives.get(DELAY, controller.delay),
        ),
    )


def _ramp(seen: Sequence[RecordingSimulation], value: Array, robot: Robot) -> float | None:
    """The limit with which wheels turn most as they were seen to."""
    shown = [
        ramp_in(item.recorded, robot, item.timeline.middle, item.run(robot).speed) for item in seen
    ]
    limits = [limit for limit in shown if limit is not None]
    if not limits:
        return None
    tried = float(np.median(limits)) * _NEARER
    others = [answering(robot, {ACCELERATION: float(limit)}) for limit in tried]
    rows = predict_all(seen, [robot, *others])
    described, *likely = _likely(value, rows)
    best = int(np.argmax(likely))
    return float(tried[best]) if likely[best] > described + _GAIN else None


def _answers(seen: Sequence[RecordingSimulation], value: Array, simulated: Array) -> Array:
    """Likelihood of when the wheels turn, which a delay changes: how fast is left to friction."""
    parts = rows_of([channel for item in seen for channel in item.channels])
    scaled = [_scaled(value[part], simulated[:, part]) for part in parts]
    return _likely(value, np.concatenate(scaled, axis=1))


def _likely(value: Array, simulated: Array) -> Array:
    """Log likelihood of each row after Laplace: samples far off for another reason count little."""
    return np.asarray(-len(value) * np.log(np.abs(simulated - value).mean(axis=1) + 1e-12))


def _scaled(value: Array, simulated: Array) -> Array:
    """Each row times what brings it nearest to the values."""
    square = np.maximum(np.square(simulated).sum(axis=1), 1e-12)
    return np.asarray(simulated * ((simulated @ value) / square)[:, None])


def _early(channel: Channel) -> Channel:
    """Without the end, of which a simulation that comes sooner knows nothing."""
    return channel.at(channel.time < channel.time[-1] + _LATER[0])
