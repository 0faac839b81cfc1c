"""A peer of the twin: an extended Kalman filter whose state has the car's parameters beside it.

A bicycle of forward speed, steering angle and pose: the drive is of first order with a dead time
and rolling resistance, the servo of first order below its rate. Measured are poses at their own
stamps, the yaw rate, and the speed that the encoders count.
"""

import math
from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats
from scm.recording.read import Recording
from scm.vehicles.car import Car
from scm.vehicles.jit import array_kernel, kernel_function

STEP_S, EVERY, COUNTED_S = 0.02, 25, 0.1  # a value is returned each so many steps
POSE, SPEED, ANGLE, PARAMETERS = 0, 3, 4, 5
GAIN, RATE, DRAG, DELAY, STEERING, TRIM, BIAS, WHEEL, SIZE = range(PARAMETERS, 14)
NAMES = (
    "drive_gain", "drive_lag", "rolling_resistance", "drive_delay", "steer_gain", "steer_trim",
    "gyro_bias", "wheel_radius",
)  # fmt: skip
KINDS = 5  # of innovations: along, across, heading, yaw rate, speed
SERVO_S, GATE = (
    0.03,
    4.0,
)  # time constant [s]; standard deviations that an innovation counts at most
START = (
    0.9,
    math.log(15.0),
    -0.05,
    0.02,
    1.0,
    0.0,
    0.0,
    1.0,
)  # rate: its logarithm; gains: of the file's
START_STD = (0.1, 0.3, 0.05, 0.02, 0.1, 0.03, 0.01, 0.03)
WANDER = (0.02, 0.06, 0.01, 0.004, 0.01, 0.003, 0.001, 0.003)  # standard deviation in 100 s
SPEED_NOISE, ANGLE_NOISE, WAY_NOISE, TURN_NOISE = 0.02, 0.02, 0.002, 0.003  # in a second


@dataclass(frozen=True, slots=True)
class Measured:
    """What the filter reads, on steps of `STEP_S`.

    Attributes:
        commands: Integrals of throttle and steering up to each step, (steps + 1, 2) [s].
        pose_at: Step that each pose follows, (n,); `poses`: its lateness, x, y and yaw, (n, 4).
        gyro, counted: Of each step, nan where there is none [rad/s, m/s].
    """

    begin_s: float
    commands: Floats
    pose_at: Floats
    poses: Floats
    gyro: Floats
    counted: Floats


def measured(recording: Recording, car: Car) -> Measured:
    """Return a recording as the filter reads it."""
    channels = recording.channels
    throttle, steering = (channels[f"command.{name}"] for name in ("throttle", "steering"))
    begin_s, x = float(throttle.t[0]), channels["pose.x"]
    steps = int((min(throttle.t[-1], x.t[-1]) - begin_s) / STEP_S)
    edges = begin_s + STEP_S * np.arange(steps + 1)
    held = [
        one.values[np.searchsorted(one.t, edges + 1e-6, side="right") - 1]
        for one in (throttle, steering)
    ]
    commands = STEP_S * np.cumsum(np.stack(held, axis=1), axis=0)
    commands = np.concatenate((np.zeros((1, 2)), commands[:-1]))
    at = np.floor((x.t - begin_s) / STEP_S)
    yaw = np.unwrap(channels["pose.yaw"].values)
    poses = np.stack((x.t - begin_s - STEP_S * at, x.values, channels["pose.y"].values, yaw), 1)
    here = (at >= 1) & (at < steps)
    gyro = channels["imu.gyro_z"]
    both = np.interp(edges, gyro.t, np.convolve(gyro.values, [0.25, 0.5, 0.25], "same"))
    wheels = [channels[f"encoder.{side}"] for side in ("left", "right")]
    way = sum(np.interp(edges, one.t, one.values) for one in wheels)
    way = way * math.pi * car.value("wheel.radius_m") / car.value("encoder.counts_per_revolution")
    span = round(COUNTED_S / STEP_S)
    counted = np.full(steps + 1, np.nan)
    counted[span::span] = np.diff(way[::span])[: len(counted[span::span])] / COUNTED_S
    return Measured(begin_s, commands, at[here], poses[here], both, counted)


@kernel_function
def _mean(area: Floats, which: int, at: float) -> float:
    """Return the mean of a command over the step that begins at a step number."""
    place = min(max(at, 0.0), len(area) - 2.001)
    k = int(place)
    first = area[k, which] + (place - k) * (area[k + 1, which] - area[k, which])
    last = area[k + 1, which]
    if k + 2 < len(area):
        last += (place - k) * (area[k + 2, which] - area[k + 1, which])
    return (last - first) / STEP_S


@kernel_function
def _step(s: Floats, area: Floats, k: int, car: Floats, out: Floats) -> None:
    """Write the state a step later; `car` has full speed, steering limit, its rate, wheelbase."""
    throttle = _mean(area, 0, k - s[DELAY] / STEP_S)
    steering = _mean(area, 1, float(k))
    for i in range(SIZE):
        out[i] = s[i]
    rate = math.exp(s[RATE])
    target = car[0] * s[GAIN] * throttle - s[DRAG] * math.tanh(s[SPEED] / 0.02) / rate
    out[SPEED] = s[SPEED] + (1.0 - math.exp(-STEP_S * rate)) * (target - s[SPEED])
    turn = (car[1] * s[STEERING] * steering + s[TRIM] - s[ANGLE]) * STEP_S / SERVO_S
    out[ANGLE] = s[ANGLE] + min(max(turn, -car[2] * STEP_S), car[2] * STEP_S)
    speed = 0.5 * (s[SPEED] + out[SPEED])
    yaw_rate = speed * math.tan(0.5 * (s[ANGLE] + out[ANGLE])) / car[3]
    middle = s[2] + 0.5 * STEP_S * yaw_rate
    out[0] = s[0] + STEP_S * speed * math.cos(middle)
    out[1] = s[1] + STEP_S * speed * math.sin(middle)
    out[2] = s[2] + STEP_S * yaw_rate


@kernel_function
def _update(s: Floats, p: Floats, h: Floats, off: float, variance: float, gain: Floats) -> float:
    """Take one measurement; return its innovation in standard deviations."""
    total = variance
    for i in range(SIZE):
        gain[i] = 0.0
        for j in range(SIZE):
            gain[i] += p[i, j] * h[j]
    for i in range(SIZE):
        total += h[i] * gain[i]
    size = math.sqrt(total)
    unit = min(max(off / size, -GATE), GATE)
    for i in range(SIZE):
        s[i] += gain[i] * unit / size
        for j in range(SIZE):
            p[i, j] -= gain[i] * gain[j] / total
    return unit


@kernel_function
def _add(sums: Floats, kind: int, unit: float) -> None:
    sums[0, kind] += unit
    sums[1, kind] += unit * unit


@kernel_function
def _take_pose(
    s: Floats, p: Floats, pose: Floats, car: Floats, noise: Floats, h: Floats, gain: Floats,
    sums: Floats,
) -> None:  # fmt: skip
    """Take a pose (lateness, x, y, yaw) along the body, across it, and in heading."""
    c, sine = math.cos(s[2]), math.sin(s[2])
    late, x, y = pose[0], pose[1] - s[0], pose[2] - s[1]
    h[:] = 0.0
    h[0], h[1], h[SPEED] = c, sine, late
    off = c * x + sine * y - late * s[SPEED]
    _add(sums, 0, _update(s, p, h, off, noise[SIZE], gain))
    x, y = pose[1] - s[0], pose[2] - s[1]
    h[0], h[1], h[SPEED] = -sine, c, 0.0
    _add(sums, 1, _update(s, p, h, c * y - sine * x, noise[SIZE], gain))
    turning = math.tan(s[ANGLE]) / car[3]
    h[:] = 0.0
    h[2], h[SPEED] = 1.0, late * turning
    off = pose[3] - s[2] - late * s[SPEED] * turning
    _add(sums, 2, _update(s, p, h, off, noise[SIZE + 1], gain))


@array_kernel
def _filter(
    area: Floats, pose_at: Floats, poses: Floats, gyro: Floats, counted: Floats, car: Floats,
    noise: Floats, s: Floats, p: Floats, out: Floats,
) -> None:  # fmt: skip
    """Run; write the parameters and the innovations' means and squares, a row each `EVERY` steps.

    Args:
        noise: Variances that a step adds to each of the state's, and of a pose's position, of its
            heading, of a yaw rate and of a counted speed, (SIZE + 4,).
    """
    now, moved, f = np.zeros(SIZE), np.zeros(SIZE), np.zeros((SIZE, SIZE))
    h, gain, sums, counts = np.zeros(SIZE), np.zeros(SIZE), np.zeros((2, KINDS)), np.zeros(KINDS)
    pose, before = 0, 0.0
    for k in range(len(area) - 2):
        _step(s, area, k, car, now)
        for j in range(SIZE):
            tiny = 1e-4
            s[j] += tiny
            _step(s, area, k, car, moved)
            s[j] -= tiny
            for i in range(SIZE):
                f[i, j] = (moved[i] - now[i]) / tiny
        p[:] = f @ p @ f.T
        before = s[SPEED]
        for i in range(SIZE):
            p[i, i] += noise[i]
            s[i] = now[i]
        while pose < len(pose_at) and pose_at[pose] <= k + 1:
            _take_pose(s, p, poses[pose], car, noise, h, gain, sums)
            for i in range(3):
                counts[i] += 1.0
            pose += 1
        h[:] = 0.0
        turning = math.tan(s[ANGLE]) / car[3]
        h[SPEED], h[BIAS] = turning, 1.0
        h[ANGLE] = s[SPEED] * (1.0 + math.tan(s[ANGLE]) ** 2) / car[3]
        off = gyro[k + 1] - s[SPEED] * turning - s[BIAS]
        _add(sums, 3, _update(s, p, h, off, noise[SIZE + 2], gain))
        counts[3] += 1.0
        if not math.isnan(counted[k + 1]):
            h[:] = 0.0
            middle = s[SPEED] - 0.5 * COUNTED_S * (s[SPEED] - before) / STEP_S
            h[SPEED], h[WHEEL] = s[WHEEL], middle
            off = counted[k + 1] - s[WHEEL] * middle
            _add(sums, 4, _update(s, p, h, off, noise[SIZE + 3], gain))
            counts[4] += 1.0
        if (k + 1) % EVERY == 0:
            row = (k + 1) // EVERY - 1
            out[row, : len(NAMES)] = s[PARAMETERS:]
            for i in range(KINDS):
                most = max(counts[i], 1.0)
                out[row, len(NAMES) + i] = sums[0, i] / most
                out[row, len(NAMES) + KINDS + i] = sums[1, i] / most
            sums[:] = 0.0
            counts[:] = 0.0


def filtered(recording: Recording, car: Car) -> tuple[Floats, Floats]:
    """Return times, (n,) [s], and the parameters, means and squares of innovations, (n, values)."""
    given = measured(recording, car)
    numbers = np.array(
        (
            car.value("drive.no_load_speed_rad_s") * car.value("wheel.radius_m"),
            car.value("steering.limit_rad"),
            car.value("steering.rate_rad_s"),
            car.value("body.wheelbase_m"),
        )
    )
    s, p = np.zeros(SIZE), np.zeros((SIZE, SIZE))
    s[:3], s[PARAMETERS:] = given.poses[0, 1:], START
    own = (WAY_NOISE, WAY_NOISE, TURN_NOISE, SPEED_NOISE, ANGLE_NOISE)
    np.fill_diagonal(p, np.square((0.01, 0.01, 0.05, 0.05, 0.05, *START_STD)))
    steps = [*np.square(own) * STEP_S, *np.square(WANDER) * STEP_S / 100.0]
    stds = [recording.channels[name].std or 0.01 for name in ("pose.x", "pose.yaw", "imu.gyro_z")]
    counted = 0.5 * car.value("wheel.radius_m") * 2.0 * math.pi / COUNTED_S
    counted /= car.value("encoder.counts_per_revolution")
    noise = np.array([*steps, *np.square((stds[0], stds[1], stds[2], counted + 1e-3))])
    out = np.zeros(((len(given.commands) - 2) // EVERY, len(NAMES) + 2 * KINDS))
    _filter(
        given.commands, given.pose_at, given.poses, given.gyro, given.counted, numbers, noise, s, p,
        out,
    )  # fmt: skip
    return given.begin_s + STEP_S * EVERY * np.arange(1, len(out) + 1), out
