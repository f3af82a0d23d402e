"""Whole drives of one robot, and what sensors show of them; compiled where numba is installed."""

import math
from typing import Any

from tomr_power_model.dynamics.contacts import Mutable, Numbers
from tomr_power_model.dynamics.layout import (
    AUXILIARY,
    COMMAND,
    HEADER,
    INPUT_HEADER,
    INPUT_WHEEL,
    OUT_CURRENT,
    OUT_HEADER,
    OUT_POWER,
    OUT_SHOWN,
    OUT_TILT,
    OUT_VOLTAGE,
    OUT_WHEEL,
    OUT_YAW,
    POWER_BIAS,
    POWER_DELAY,
    POWER_LAG,
    POWER_SCALE,
    RESISTING,
    STEP,
    STRIDE,
    SUPPLY_SCALE,
)
from tomr_power_model.dynamics.start import begin
from tomr_power_model.dynamics.step import advance

# Kinds of channels, as numbers that compiled code can hold.
SPEED, POWER, TOTAL, SUPPLY_VOLTAGE, YAW, CURRENT = range(6)


def run(
    p: Numbers, s: Mutable, inputs: Any, resisting: Any, late: int, out: Any, scratch: Any, n: int
) -> None:
    """Drive through all periods.

    Args:
        p: numbers of the robot.
        s: state at the start, at the end afterwards.
        inputs: of each period, (count, input_size).
        resisting: torques that resist besides [N m], (count, n), or (0, n) for none.
        late: periods by which the commands come later than the inputs have them.
        out: of each period, (count, steps * output_size).
        scratch: as long as a period's inputs.
        n: wheels.
    """
    extra = len(resisting) > 0
    for k in range(len(inputs)):
        for j in range(inputs.shape[1]):
            scratch[j] = inputs[k, j]
        asked = min(max(k - late, 0), len(inputs) - 1)
        for j in range(3):
            scratch[COMMAND + j] = inputs[asked, COMMAND + j]
        if extra:
            for i in range(n):
                scratch[INPUT_HEADER + i * INPUT_WHEEL + RESISTING] += resisting[k, i]
        advance(p, s, scratch, out[k], n)


def series(p: Numbers, steps: Any, kind: int, wheel: int, value: Any, tilt: Any, n: int) -> None:
    """What a channel of a kind sees, step by step: means and their change within a step.

    Args:
        p: numbers of the robot.
        steps: outputs of all steps, (m, output_size).
        kind: of the channel.
        wheel: of the channel, any number where it has none.
        value: means, (m,), written.
        tilt: change from a step's start to its end, (m,), written.
        n: wheels.
    """
    own = OUT_HEADER + wheel * OUT_WHEEL
    for k in range(len(steps)):
        tilt[k] = 0.0
        if kind == SPEED:
            value[k] = steps[k, own + OUT_SHOWN]
        elif kind == POWER:
            value[k], tilt[k] = steps[k, own + OUT_POWER], steps[k, own + OUT_TILT]
        elif kind == TOTAL:
            total, change = p[AUXILIARY], 0.0
            for i in range(n):
                total += steps[k, OUT_HEADER + i * OUT_WHEEL + OUT_POWER]
                change += steps[k, OUT_HEADER + i * OUT_WHEEL + OUT_TILT]
            value[k], tilt[k] = total, change
        elif kind == SUPPLY_VOLTAGE:
            value[k] = steps[k, OUT_VOLTAGE]
        elif kind == YAW:
            value[k] = steps[k, OUT_YAW]
        else:
            value[k] = steps[k, own + OUT_CURRENT]


def follow(value: Any, tilt: Any, share: float) -> None:
    """First-order lag of a series; `share` is its step over the time constant."""
    keep = math.exp(-share)
    seen = value[0]
    for k in range(len(value)):
        seen = value[k] + keep * (seen - value[k])
        value[k], tilt[k] = seen, 0.0


def integral_at(value: Any, tilt: Any, total: Any, step: float, time: float) -> float:
    """Integral of a series from its start to a time; `total` to the start of each step.

    Within a step the quantity runs straight through its mean, by `tilt` from start to end.
    """
    place = min(max(time / step, 0.0), len(value) - 1e-6)
    k = int(place)
    part = place - k
    return float(total[k] + step * (part * value[k] - 0.5 * part * (1.0 - part) * tilt[k]))


def read(
    p: Numbers,
    out: Any,
    start: float,
    later: float,
    channels: Any,
    time: Any,
    span: Any,
    found: Any,
    work: Any,
    n: int,
) -> None:
    """Means of each channel over the spans that end at its times, as its sensor shows them.

    Args:
        p: numbers of the robot.
        out: of all periods.
        start: of the first period [s].
        later: by which everything happened later than simulated [s].
        channels: kind, wheel, first and last row of each, (c, 4).
        time: ends of the spans [s], (rows,).
        span: s, 0 for an instant, (rows,).
        found: values, (rows,), written.
        work: (3, steps + 1).
        n: wheels.
    """
    width = OUT_HEADER + n * OUT_WHEEL
    steps = out.reshape(-1, width)
    count, step, stride = len(steps), p[STEP], int(p[STRIDE])
    value, tilt, total = work[0, :count], work[1, :count], work[2]
    for c in range(len(channels)):
        kind, wheel = channels[c, 0], channels[c, 1]
        series(p, steps, kind, wheel, value, tilt, n)
        shift, scale, bias = later, 1.0, 0.0
        if kind == POWER:
            w = HEADER + wheel * stride
            shift += p[w + POWER_DELAY]
            scale, bias = p[w + POWER_SCALE], p[w + POWER_BIAS]
            if p[w + POWER_LAG] > 0.0:
                follow(value, tilt, step / p[w + POWER_LAG])
        elif kind == TOTAL:
            scale = p[SUPPLY_SCALE]
        total[0] = 0.0
        for k in range(count):
            total[k + 1] = total[k] + step * value[k]
        for row in range(channels[c, 2], channels[c, 3]):
            # What has no span is read at an instant: a mean around it, not before it.
            wide = span[row] if span[row] > 0.0 else step
            end = time[row] - shift - start + (0.0 if span[row] > 0.0 else 0.5 * step)
            change = integral_at(value, tilt, total, step, end)
            change -= integral_at(value, tilt, total, step, end - wide)
            found[row] = scale * change / wide + bias


def predict(
    p: Numbers,
    s: Mutable,
    inputs: Any,
    resisting: Any,
    late: int,
    start: float,
    later: Any,
    channels: Any,
    time: Any,
    span: Any,
    found: Any,
    out: Any,
    work: Any,
    scratch: Any,
    n: int,
) -> None:
    """Begin, drive and read: `found` (l, rows) has the channels for each of `later` (l,)."""
    begin(p, s, scratch[1], scratch[2], n)
    run(p, s, inputs, resisting, late, out, scratch[0], n)
    for number in range(len(later)):
        read(p, out, start, later[number], channels, time, span, found[number], work, n)
