"""The witness: a kinematic bicycle fitted by least squares, which knows nothing of the simulator.

It is the plain model that an engineer writes in ten minutes. A car that strays farther than it on
driving that neither has seen was not found, whatever explains the rest.

    angle = gain * steering(t - delay) + offset
    yaw' = v * tan(angle) / (wheelbase * (1 + understeer * v^2))
    v' = (speed_gain * throttle(t - delay), past a dead-band, - v) / time_constant

Where the measured speed drives the car, the witness gets it too, and has the first four numbers.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.mismatch.evidence import FreeRuns
from scm.mismatch.findings import Witness
from scm.replay.commands import FULL_SPEED, Commanded
from scm.replay.drive import STEP_S, Drive, is_led
from scm.replay.free_run import Replay
from scm.vehicles.car import Car

NAMES = (
    "steering_gain_rad", "steering_offset_rad", "steering_delay_s", "understeer_s2_per_m2",
    "speed_gain_mps", "dead_band", "throttle_delay_s", "time_constant_s",
)  # fmt: skip
GAIN, OFFSET, LATE, UNDERSTEER, SPEED, DEAD_BAND, THROTTLE_LATE, TIME = range(len(NAMES))
OF_STEERING = slice(0, 4)
STEPS = np.array((0.01, 0.005, 0.005, 1e-3, 0.02, 0.01, 0.005, 0.02))  # of derivatives
MAX_DELAY_S, MAX_ANGLE_RAD = 0.8, 1.3
LONGEST_STEP_S = 0.05  # of the integration: a midpoint rule, and exact for the speed
SOFT = 0.02  # of the throttle: the change of its sign
UNDELAYED_S = 1e-3
FEWEST_WINDOWS = 6
MAX_WINDOWS, MAX_COARSE_WINDOWS = 240, 60  # more cost time and hardly move the numbers
COARSE_ROUNDS, FINE_ROUNDS, POLISHED = 15, 30, 2
FIRST_DAMPING, LESS, MORE, TINY = 0.1, 0.3, 4.0, 1e-9
SHARE, YAW_RAD = 0.1, 0.1  # errors at which the robust loss bends: of the way driven, and of yaw
SHORTEST_WAY_M, SLOWEST_MPS, USUAL_LIMIT_RAD = 0.02, 0.05, 0.5
UNSEEN = "confirm"


@dataclass(frozen=True, slots=True)
class Windows:
    """Windows of all recordings as the bicycle sees them.

    Attributes:
        areas: Integrals of throttle and steering over the steps of all recordings, (2, edges).
        edge: Where each window begins among the edges, (windows,).
        start: Measured x, y [m], yaw [rad] and speed there, (4, windows).
        real: Measured x, y and yaw half-way and at the end, (2, 3, windows).
        top_mps: The highest usual speed.
        led_mps: What a throttle of 1 is where the measured speed drives the car, or None.
    """

    areas: Floats
    edge: Floats
    start: Floats
    real: Floats
    horizon_s: float
    wheelbase_m: float
    limit_rad: float
    top_mps: float
    led_mps: float | None

    def of(self, which: Bools) -> "Windows":
        """Return some of the windows."""
        return replace(self, edge=self.edge[which], start=self.start[:, which],
                       real=self.real[:, :, which])  # fmt: skip


def witness_of(drives: Sequence[Drive], car: Car, runs: FreeRuns) -> Witness | None:
    """Return a bicycle fitted to the parts that fit and choose, judged on the one that confirms.

    Args:
        drives: The recordings.
        car: As given: its wheelbase counts, and the faults of the poses that its file states.
        runs: Whose windows it is fitted and judged by.

    Returns:
        None where there are too few windows.
    """
    windows = windows_of(drives, car, runs.recording, runs.stamp_s, float(runs.t_s[-1]))
    unseen = np.array(runs.part) == UNSEEN
    if (~unseen).sum() < FEWEST_WINDOWS or not unseen.any():
        return None
    found = fit(windows.of(~unseen))
    errors = {name: rms(far) for name, far in strayed(windows.of(unseen), found).items()}
    return Witness(
        position_m=errors["position_m"], yaw_rad=errors["yaw_rad"],
        numbers={NAMES[j]: float(found[j]) for j in _free(windows)},
    )  # fmt: skip


def strayed_by(
    drives: Sequence[Drive],
    car: Car,
    starts: tuple[Ints, Floats],
    horizon_s: float,
    numbers: Mapping[str, float],
) -> dict[str, Floats]:
    """Return how far a bicycle with given numbers strays, as `strayed` does.

    Args:
        drives: The recordings.
        car: As given.
        starts: The recording and the stamp of each window, both (windows,).
        horizon_s: Their length.
        numbers: Of the bicycle, by name.
    """
    windows = windows_of(drives, car, *starts, horizon_s)
    values = _starts(windows)[0]
    values[[NAMES.index(name) for name in numbers]] = list(numbers.values())
    return strayed(windows, values)


def windows_of(
    drives: Sequence[Drive], car: Car, recording: Ints, stamp_s: Floats, horizon_s: float
) -> Windows:
    """Return windows with the commands around them.

    Args:
        drives: The recordings.
        car: As given.
        recording: Number of the recording that each window is of, (windows,).
        stamp_s: When each starts on the clock of its poses, (windows,).
        horizon_s: Their length.
    """
    areas, edge, base = list[Floats](), np.zeros(len(stamp_s)), 0
    seen: Floats = np.zeros((3, 4, len(stamp_s)))  # start, middle, end: x, y, yaw, speed
    before = round(MAX_DELAY_S / STEP_S) + 2
    for number in np.unique(recording).tolist():
        mine = recording == number
        replay = Replay(drives[number].recording, car)
        first = float(replay.drive.edges[0])
        steps = np.arange(len(replay.drive.edges) + before + 3) - before
        edges: Floats = np.asarray(first + STEP_S * steps, dtype=np.float64)
        commands = (replay.drive.throttle, replay.drive.steering)
        areas.append(np.stack([_area(command, edges) for command in commands]))
        for at, since in enumerate((0.0, 0.5 * horizon_s, horizon_s)):
            moved = replay.camera.motion(replay.true_times(stamp_s[mine] + since))
            seen[at][:, mine] = np.stack((moved.x, moved.y, moved.yaw, moved.speed))
        edge[mine] = base + before + (replay.true_times(stamp_s[mine]) - first) / STEP_S
        base += len(edges)
    top = float(np.percentile(np.concatenate([drive.pose_speed for drive in drives]), 90))
    led = car.value(FULL_SPEED) if any(map(is_led, drives)) else None
    limit = car.value("steering.limit_rad") if car.has("steering.limit_rad") else USUAL_LIMIT_RAD
    return Windows(
        np.concatenate(areas, axis=1), edge, seen[0], seen[1:, :3], horizon_s,
        car.value("body.wheelbase_m"), limit, max(top, SLOWEST_MPS), led,
    )  # fmt: skip


def _area(command: Commanded, edges: Floats) -> Floats:
    """Return a command's integral up to each edge."""
    means = command.means(edges, np.zeros(1))[:, 0]
    return np.concatenate(([0.0], np.cumsum(means * STEP_S)))


def strayed(windows: Windows, values: Floats) -> dict[str, Floats]:
    """Return `position_m` and `yaw_rad` at the windows' ends, each (windows,)."""
    x, y, yaw = apart_of(windows, values[None])[0, :, 1]
    return {"position_m": np.hypot(x, y), "yaw_rad": np.abs(yaw)}


def rms(errors: Floats) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(errors * errors)))


def apart_of(windows: Windows, sets: Floats) -> Floats:
    """Return how far bicycles are from what was measured: x, y, yaw half-way and at the end.

    Args:
        windows: The windows.
        sets: Numbers in the order of `NAMES`, (sets, 8).

    Returns:
        (sets, 3, 2, windows).
    """
    apart = driven(windows, sets) - windows.real.swapaxes(0, 1)
    apart[:, 2] = np.arctan2(np.sin(apart[:, 2]), np.cos(apart[:, 2]))
    return apart


def driven(windows: Windows, sets: Floats) -> Floats:
    """Return x, y and yaw of bicycles half-way and at the end, (sets, 3, 2, windows)."""
    half = max(1, math.ceil(0.5 * windows.horizon_s / LONGEST_STEP_S - 1e-9))
    step_s = 0.5 * windows.horizon_s / half
    times: Floats = np.asarray(step_s * np.arange(2 * half + 1), dtype=np.float64)
    number = sets.T[:, :, None, None]  # (8, sets, 1, 1)
    throttle = _means(windows, 0, times, number[THROTTLE_LATE])
    speed = _speeds(windows, _target(throttle, number), step_s, sets[:, TIME])
    steering = _means(windows, 1, times, number[LATE])
    angle = np.clip(number[GAIN] * steering + number[OFFSET], -MAX_ANGLE_RAD, MAX_ANGLE_RAD)
    turned = step_s * speed * np.tan(angle)
    turned /= windows.wheelbase_m * (1.0 + number[UNDERSTEER] * speed * speed)
    x0, y0, yaw0, _ = windows.start[:, None, :, None]
    yaw = yaw0 + np.cumsum(turned, axis=2)
    way, middle = step_s * speed, yaw - 0.5 * turned
    x = x0 + np.cumsum(way * np.cos(middle), axis=2)
    y = y0 + np.cumsum(way * np.sin(middle), axis=2)
    return np.stack((x, y, yaw), axis=1)[..., (half - 1, -1)].swapaxes(2, 3)


def _means(windows: Windows, which: int, times: Floats, late: Floats) -> Floats:
    """Return a command's means over the steps between times, (sets, windows, steps)."""
    area = windows.areas[which]
    at = windows.edge[:, None] + (times - late) / STEP_S
    row = np.clip(at.astype(np.int64), 0, len(area) - 2)
    low = area[row]
    whole = low + (at - row) * (area[row + 1] - low)
    return np.asarray(np.diff(whole, axis=2) / np.diff(times))


def _target(throttle: Floats, number: Floats) -> Floats:
    """Return the speed that a throttle leads to; a negative dead-band is a lead."""
    size = np.abs(throttle)
    past = np.maximum(size - number[DEAD_BAND] * np.tanh(size / SOFT), 0.0)
    return np.asarray(number[SPEED] * np.sign(throttle) * past)


def _speeds(windows: Windows, target: Floats, step_s: float, constants: Floats) -> Floats:
    """Return mean speeds over the steps, (sets, windows, steps)."""
    left = np.exp(-step_s / constants)[:, None]
    mean = (1.0 - left) * constants[:, None] / step_s
    out = np.empty_like(target)
    now = np.broadcast_to(windows.start[3], target.shape[:2])
    for k in range(target.shape[2]):
        beyond = now - target[:, :, k]
        out[:, :, k] = target[:, :, k] + beyond * mean
        now = target[:, :, k] + beyond * left
    return out


def fit(windows: Windows) -> Floats:
    """Return the numbers of the bicycle that follows the windows best, from several starts."""
    whole = _thinned(windows, MAX_WINDOWS)
    costs, sets = _refined(_thinned(whole, MAX_COARSE_WINDOWS), _starts(windows), COARSE_ROUNDS)
    costs, sets = _refined(whole, sets[np.argsort(costs)[:POLISHED]], FINE_ROUNDS)
    return np.asarray(sets[np.argmin(costs)])


def _free(windows: Windows) -> Ints:
    """Return the places of the numbers that are fitted."""
    every = np.arange(len(NAMES))
    return every if windows.led_mps is None else every[OF_STEERING]


def _thinned(windows: Windows, most: int) -> Windows:
    count = len(windows.edge)
    which = np.zeros(count, dtype=np.bool_)
    which[np.unique(np.linspace(0, count - 1, min(most, count)).astype(np.int64))] = True
    return windows.of(which)


def _starts(windows: Windows) -> Floats:
    """Return numbers to begin from, (starts, 8)."""
    throttle = _means(windows, 0, np.array((0.0, windows.horizon_s)), np.zeros((1, 1, 1)))[0, :, 0]
    full = windows.top_mps / max(float(np.percentile(np.abs(throttle), 90)), 0.05)
    limit, bent = windows.limit_rad, 0.5 / windows.top_mps**2
    if windows.led_mps is not None:
        led = (windows.led_mps, 0.0, 0.0, UNDELAYED_S)
        return np.array([
            (limit, 0.0, 0.05, 0.0, *led),
            (limit, 0.0, 0.3, 0.0, *led),
            (0.6 * limit, 0.0, 0.05, bent, *led),
        ])  # fmt: skip
    return np.array([
        (limit, 0.0, 0.05, 0.0, full, 0.0, 0.05, 0.3),
        (limit, 0.0, 0.3, 0.0, full, 0.0, 0.3, 1.0),
        (0.6 * limit, 0.0, 0.05, 0.0, 1.5 * full, 0.1, 0.1, 0.3),
        (0.6 * limit, 0.0, 0.3, bent, full, -0.1, 0.05, 0.1),
        (limit, 0.0, 0.1, bent, 2.0 * full, 0.05, 0.1, 3.0),
        (1.4 * limit, 0.0, 0.15, bent, 4.0 * full, 0.0, 0.2, 10.0),
    ])  # fmt: skip


def _refined(windows: Windows, sets: Floats, rounds: int) -> tuple[Floats, Floats]:
    """Return costs and numbers after damped Gauss-Newton steps under a robust loss.

    Args:
        windows: The windows to follow.
        sets: To begin from, (sets, 8); all are refined at once.
        rounds: How many steps are tried.
    """
    free, (low, high) = _free(windows), _bounds(windows)
    sets = np.clip(sets, low, high)
    costs, damping = _costs(_residuals(windows, sets)), np.full(len(sets), FIRST_DAMPING)
    for _ in range(rounds):
        moved = np.repeat(sets[:, None], len(free) + 1, axis=1)
        moved[:, 1 + np.arange(len(free)), free] += STEPS[free]
        left = _residuals(windows, moved.reshape(-1, len(NAMES))).reshape(*moved.shape[:2], -1)
        trials = sets.copy()
        for i, (e, more) in enumerate(zip(left[:, 0], left[:, 1:], strict=True)):
            trials[i, free] += STEPS[free] * _step(
                e, more - e, damping[i], (low - sets[i])[free] / STEPS[free],
                (high - sets[i])[free] / STEPS[free],
            )  # fmt: skip
        trials = np.clip(trials, low, high)
        now = _costs(_residuals(windows, trials))
        better = now < costs
        sets, costs = np.where(better[:, None], trials, sets), np.where(better, now, costs)
        damping *= np.where(better, LESS, MORE)
    return costs, sets


def _step(e: Floats, slopes: Floats, damping: float, low: Floats, high: Floats) -> Floats:
    """Return one damped step of the free numbers, of those at a bound only away from it."""
    weight = 1.0 / np.sqrt(1.0 + e * e)
    normal, down = (slopes * weight) @ slopes.T, -(slopes * weight) @ e
    moves = ((down > 0.0) & (high > 0.0)) | ((down < 0.0) & (low < 0.0))
    scale = normal.diagonal()
    normal = normal * np.outer(moves, moves) + np.diag(np.where(moves, damping * scale, 1.0) + TINY)
    return np.clip(np.linalg.solve(normal, down * moves), low, high)


def _residuals(windows: Windows, sets: Floats) -> Floats:
    """Return how far bicycles stray half-way and at the end, over usual errors, (sets, n)."""
    ways = np.hypot(*(windows.real[1, :2] - windows.start[:2]))
    metres = SHARE * max(float(np.sqrt(np.mean(ways * ways))), SHORTEST_WAY_M)
    usual = np.array((metres, metres, YAW_RAD))[:, None, None]
    return np.asarray((apart_of(windows, sets) / usual).reshape(len(sets), -1))


def _costs(residuals: Floats) -> Floats:
    return np.asarray((np.sqrt(1.0 + residuals * residuals) - 1.0).sum(axis=1))


def _bounds(windows: Windows) -> tuple[Floats, Floats]:
    """Return the least and the largest numbers, in the order of `NAMES`."""
    squared, fast = windows.top_mps**2, 60.0 * windows.top_mps
    low = (-1.5, -0.6, 0.0, -0.3 / squared, 0.0, -1.0, 0.0, UNDELAYED_S)
    high = (1.5, 0.6, MAX_DELAY_S, 20.0 / squared, fast, 0.9, MAX_DELAY_S, 30.0)
    return np.array(low), np.array(high)
