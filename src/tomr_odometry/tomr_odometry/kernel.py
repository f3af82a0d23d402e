"""One step of the filter, as functions of arrays.

State (18): pose in the odometry frame; twist and its rate in base_link; way of each rim as far as
its contact gave it to the body; biases of accelerometer and gyro; pull of the floor's slope in the
odometry frame; creep.

An encoder counts its rim's way, always: the measurement is never rejected. What slips is the
process that ties the rim to the body, d(rim_i) = (row_i v + creep_i) dt + noise, whose noise
is small while the wheel grips and large while it slides. So counts do not turn into velocities,
their quantum does not random-walk, and where nothing slides the pose is that of plain wheel
odometry.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.slides.body import ContactBody

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

X, Y, YAW, VX, VY, WZ, AX, AY, AW = range(9)
RIM, ACCELEROMETER, GYRO, SLOPE, CREEP = 9, 12, 14, 15, 17
SIZE = 18
_ONE = np.eye(SIZE)
_DIAGONAL = np.diag_indices(SIZE)
SURE = 1.0 - 1e-6  # probability that counts as one
TAILS = 2.0  # of the encoders' variance, where sliding is looked for


class Noise(NamedTuple):
    """Standard deviations: of what begins unknown, of what drives the states, of sensors."""

    start_twist: float = 0.02  # m/s, rad/s
    accelerometer_bias: float = 0.15  # m/s^2
    gyro_bias: float = 0.015  # rad/s
    slope: float = 0.02  # m/s^2
    creep: float = 0.1
    rate: float = 1.5  # m/s^2, of the body's acceleration
    turn_rate: float = 6.0  # rad/s^2, of its turning
    rate_time: float = 0.25  # s, over which both are forgotten
    grip: float = 2e-4  # m/s/sqrt(Hz): of a rim against the ground
    grip_share: float = 5e-4  # of its speed, the same
    doubt: float = 10.0  # factor on both where a wheel slid a moment ago
    doubt_time: float = 0.5  # s, over which that is forgotten
    recent: float = 0.2  # doubt, beyond which a slide was a moment ago
    slide: float = 0.4  # m/s, of sliding
    slide_time: float = 0.1  # s, over which sliding stays the same
    slip_rate: float = 0.05  # 1/s, at which wheels lose grip
    grip_rate: float = 3.0  # 1/s, at which they find it again
    regrip_time: float = 0.03  # s, over which steps that speak for grip after a slide are one
    way: float = 0.005  # m/s/sqrt(Hz) per m/s of travel, of the pose
    turn: float = 0.005  # rad/s/sqrt(Hz) per m/s, of the heading
    unaided_way: float = 1.0  # the same without an IMU
    unaided_turn: float = 0.3
    slid: float = 0.03  # m/s/sqrt(Hz), of the pose while a wheel slides
    slid_yaw: float = 0.04  # rad/s/sqrt(Hz)
    walk_bias: float = 2e-3  # m/s^2/sqrt(s)
    walk_gyro: float = 1e-4
    walk_slope: float = 2e-4
    accelerometer: float = 0.06  # m/s^2
    gyro: float = 4e-3  # rad/s
    gate: float = 1000.0  # squared normalised innovation of the IMU, beyond which it counts less:
    # far out, as contacts that chatter are felt one way and the other and have to cancel
    jitter: float = 1e-4  # s, of the encoders' stamps
    rim: float = 3e-5  # m, of a rim besides the quantum


def predict(
    x: Array, P: Array, b: ContactBody, n: Noise, mode: Array, used: Array, dt: float
) -> Array:
    """Go on by dt [s]; returns the covariance.

    mode: probabilities that the wheels slide, and whether one did a moment ago (1 to 0), (4,).
    used: how fast each wheel creeps per unit of the creep's coefficient [m/s], (3,).
    """
    keep, half = math.exp(-dt / n.rate_time), 0.5 * dt * dt
    # The twist's rate changes before it moves the robot: what the IMU measures between two encoder
    # samples is what moved the robot between them. Otherwise its velocity lags, like creep.
    P = P.copy()
    x[AX : AW + 1] *= keep
    P[AX : AW + 1] *= keep
    P[:, AX : AW + 1] *= keep
    P[AX, AX] += n.rate**2 * (1.0 - keep * keep)
    P[AY, AY] += n.rate**2 * (1.0 - keep * keep)
    P[AW, AW] += n.turn_rate**2 * (1.0 - keep * keep)
    v, a = x[VX : WZ + 1].copy(), x[AX : AW + 1].copy()
    step = v * dt + a * half
    sx, sy, turned = step.tolist()
    yaw = float(x[YAW]) + 0.5 * turned
    c, s = math.cos(yaw), math.sin(yaw)
    dx, dy = c * sx - s * sy, s * sx + c * sy
    f = _ONE.copy()
    f[X, YAW], f[Y, YAW] = -dy, dx
    turn = np.array([[c, -s, -0.5 * dy], [s, c, 0.5 * dx], [0.0, 0.0, 1.0]])
    f[X : YAW + 1, VX : WZ + 1] = turn * dt
    f[X : YAW + 1, AX : AW + 1] = turn * half
    f[RIM : RIM + 3, VX : WZ + 1] = b.rows * dt
    f[RIM : RIM + 3, AX : AW + 1] = b.rows * half
    f[VX, AX] = f[VY, AY] = f[WZ, AW] = dt
    if n.slip_rate > 0.0:  # unaided, creep looks like travel: it is taken as known
        f[RIM : RIM + 3, CREEP] = used * dt
    q = np.zeros(SIZE)
    grip = n.grip**2 + (n.grip_share * (b.rows @ v)) ** 2
    slides = mode[:3] * (n.slide**2 * n.slide_time * dt)
    q[RIM : RIM + 3] = grip * ((1.0 + n.doubt * mode[3]) ** 2 * dt) + slides
    x[RIM : RIM + 3] += b.rows @ step + x[CREEP] * used * dt
    x[VX : WZ + 1] += a * dt
    x[X] += dx
    x[Y] += dy
    x[YAW] += turned
    travel = math.hypot(v[0], v[1])
    # What the model leaves out adds up along the way, and while wheels slide.
    lost = (n.way * travel) ** 2 + (n.slid * mode[3]) ** 2
    q[X] = q[Y] = lost * dt
    q[YAW] = ((n.turn * travel) ** 2 + (n.slid_yaw * mode[3]) ** 2) * dt
    q[ACCELEROMETER] = q[ACCELEROMETER + 1] = n.walk_bias**2 * dt
    q[GYRO] = n.walk_gyro**2 * dt
    q[SLOPE] = q[SLOPE + 1] = n.walk_slope**2 * dt
    P = f @ P @ f.T
    P[_DIAGONAL] += q
    return P


def judge(x: Array, P: Array, n: Noise, mode: Array, rims: Array, dt: float, slid: Flags) -> None:
    """Bayes' rule on whether each wheel slides; its rim is loosened accordingly.

    rims: ways by the encoders [m] and their variances, (2, 3). slid: wheels known to slide, (3,).
    """
    if n.slip_rate == 0.0:  # nothing shows it: the wheels are taken for gripping
        mode[:3] = 0.0
        return
    # A step shows what slides within it; that it goes on as it slid makes steps less than many.
    wide, loose = (n.slide * dt) ** 2, n.slide**2 * n.slide_time * dt
    apart, variance = (rims[0] - x[RIM : RIM + 3]).tolist(), rims[1].tolist()
    for i, was in enumerate(mode[:3].tolist()):
        k = RIM + i
        grips = max(float(P[k, k]) - was * loose, 0.0) + TAILS * variance[i]
        slides = grips + wide
        exponent = min(0.5 * apart[i] * apart[i] * (1.0 / grips - 1.0 / slides), 50.0)
        odds = math.sqrt(grips / slides) * math.exp(exponent)
        if odds < 1.0 and mode[3] > n.recent:
            odds **= min(dt / n.regrip_time, 1.0)
        prior = was * (1.0 - n.grip_rate * dt) + (1.0 - was) * n.slip_rate * dt
        now = prior * odds / (prior * odds + 1.0 - prior)
        now = SURE if slid[i] else min(max(now, 1.0 - SURE), SURE)
        P[k, k] += (now - was) * loose
        mode[i] = now


def correct(
    x: Array, P: Array, h: Array, innovation: Array, variance: Array, gate: float, held: int
) -> Array:
    """Measurements made at once, (m, SIZE), (m,), (m,); returns the covariance.

    held: states from ACCELEROMETER up to this one stay as they are, and so does what is not known
    of them.
    """
    ph = P @ h.T
    s = h @ ph
    own = s.diagonal().tolist()
    noise = np.abs(variance)
    for i, (off, said) in enumerate(zip(innovation.tolist(), variance.tolist(), strict=True)):
        if said > 0.0 and off * off > gate * (own[i] + said):
            noise[i] = off * off / gate - own[i]  # an outlier counts less
    s.ravel()[:: len(s) + 1] += noise
    gain = ph / s if len(s) == 1 else np.linalg.solve(s, ph.T).T
    if held > ACCELEROMETER:
        gain = gain.copy()
        gain[ACCELEROMETER:held] = 0.0
        left = _ONE - gain @ h
        P = left @ P @ left.T + (gain * noise) @ gain.T
    else:
        P = P - gain @ ph.T
    x += gain @ innovation
    return 0.5 * (P + P.T)


def motion_rows(x: Array, n: Noise, rims: Array, inertial: Array) -> tuple[Array, Array, Array]:
    """Rows of the rims' ways and of the IMU, NaN where it says nothing.

    inertial: angular rates [rad/s] and specific forces [m/s^2] in base_link, (6,).
    """
    h, innovation, variance = np.zeros((6, SIZE)), np.zeros(6), np.zeros(6)
    for i in range(3):
        h[i, RIM + i] = 1.0
        innovation[i] = rims[0, i] - x[RIM + i]
        variance[i] = -rims[1, i]  # no gate: sliding is what `judge` knows of
    m = 3
    vx, vy, wz = x[VX], x[VY], x[WZ]
    if math.isfinite(inertial[2]):
        h[m, WZ] = h[m, GYRO] = 1.0
        innovation[m], variance[m] = inertial[2] - wz - x[GYRO], n.gyro**2
        m += 1
    if math.isfinite(inertial[3]) and math.isfinite(inertial[4]):
        c, s = math.cos(x[YAW]), math.sin(x[YAW])
        gx, gy = c * x[SLOPE] + s * x[SLOPE + 1], c * x[SLOPE + 1] - s * x[SLOPE]
        h[m, AX], h[m, VY], h[m, WZ], h[m, ACCELEROMETER] = 1.0, -wz, -vy, 1.0
        # A slope must not turn the heading: it is known far less than the gyro's integral.
        h[m, SLOPE], h[m, SLOPE + 1] = -c, -s
        innovation[m] = inertial[3] - (x[AX] - wz * vy - gx + x[ACCELEROMETER])
        k = m + 1
        h[k, AY], h[k, VX], h[k, WZ], h[k, ACCELEROMETER + 1] = 1.0, wz, vx, 1.0
        h[k, SLOPE], h[k, SLOPE + 1] = s, -c
        innovation[k] = inertial[4] - (x[AY] + wz * vx - gy + x[ACCELEROMETER + 1])
        variance[m] = variance[k] = n.accelerometer**2
        m += 2
    return h[:m], innovation[:m], variance[:m]


def held_of(n: Noise, mode: Array) -> int:
    """Up to which state nothing is learnt: wheels show nothing of biases where there is no IMU, and
    a wrong bias while a slide may not have been noticed."""
    if n.slip_rate == 0.0:
        return SIZE
    return CREEP if mode[3] > n.recent else ACCELEROMETER


def step(
    x: Array, P: Array, b: ContactBody, n: Noise, mode: Array, used: Array, dt: float,
    rims: Array, inertial: Array, slid: Flags,
) -> Array:  # fmt: skip
    """From one encoder sample to the next; `x` and `mode` go on in place; the covariance."""
    mode[3] = max(mode[3] * math.exp(-dt / n.doubt_time), mode[0], mode[1], mode[2])
    P = predict(x, P, b, n, mode, used, dt)
    judge(x, P, n, mode, rims, dt, slid)
    h, innovation, variance = motion_rows(x, n, rims, inertial)
    return correct(x, P, h, innovation, variance, n.gate, held_of(n, mode))
