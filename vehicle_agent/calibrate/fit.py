"""Identifies a car's parameters from its commands and the Eye's poses.

The car's own kernel simulates the drive, with other parameters in every row of one fleet. The drive
is cut into windows, a leg each. In each window the path is shifted to where it fits best, so that
old errors do not count; the rest is the residual. Gauss-Newton moves the parameters.

Intervals are 90 %: the wider of what white residuals give and of a jackknife over the windows, so
that correlated errors of the Eye do not make them too narrow, with Student's t for the number of
windows that inform a parameter. The parameters describe the best line through a firmware's rounded
commands: the intervals include the effect of the published firmware's rounding on this drive, which
legs that are all rounded alike hardly show, and for both gains the uncertainty of the Eye's scale.
The Eye's delay cannot be separated from that of both actuators: the delays found are sums, from
which `eye_delay_s` is subtracted.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats
from scm.errors import RecordingError
from scm.geometry import Pose2
from scm.vehicles.car import Car
from scm.vehicles.compiler.vector_code import LANES
from scm.vehicles.fleet import Fleet

TERMS = ("steer_trim", "steer_gain", "drive_deadband", "drive_gain")
STEP_S = 0.001  # coarser steps shift the delay of a servo at its rate limit
STEPS_PER_SAMPLE = 10  # integration steps from one stored pose to the next
WINDOW_S = 2.5  # of driving without a rest
MIN_WINDOW_S, MAX_WINDOW_S = 1.0, 3.0
MIN_DRIVE_S = 20.0  # shorter drives leave every interval too wide
DELAYS = ("drive.delay_s", "steering.delay_s")
PRIOR = 100.0  # prior std of a parameter, in steps of its derivative
SILENT_S = 0.1  # longer without a command: the agent stalled, commands unknown
STEER_TRANSIENT_S = 0.2  # after a stall, until the wheels are where they were commanded
MIN_WINDOW_POSES = 5  # fewer poses make a window useless
MIN_DIFFERENCE = 0.05  # of those steps: smaller differences are rounding errors
MAX_ITERATIONS = 20
STEP_FRACTIONS = (1.0, 0.5, 0.2, 0.05)
Z_90 = 1.645  # standard deviations from the middle to the end of a 90 % interval
STUDENT_DOF = 8.0  # degrees of freedom of the Student-t loss: robust to outliers
NORMAL_CONSISTENCY = 0.7572  # mean of r^2 / (1 + r^2 / STUDENT_DOF) over a normal r
MAX_EFFECTIVE_WINDOWS = 1e6  # windows, for a parameter that none informs
SCALE_STD = 2e-3  # of the Eye's scale: an error of all poses alike, which no residual shows
EYE_SCALED = ("steering.gain", "drive.gain")  # curvature and speed depend on the Eye's scale
FIRMWARE_STEPS = np.array(
    [1.0 / 255.0, 1.0 / 30.0]
)  # of the published firmware: throttle, steering
ROUNDING_OFFSETS = 8  # offsets of a firmware's steps that are tried
CONVERGED = 0.01  # of half an interval: largest last step
POSITION_STD_M, YAW_STD_RAD = 5e-3, 1e-2
WIDEST = {
    "steering.trim_rad": 0.01,
    "steering.gain": 0.05,
    "drive.deadband": 0.005,
    "drive.gain": 0.02,
}
"""Half of a 90 % interval: three to five times what a short drive gives."""
SILENT_SHARE = 0.25
"""Maximum share of legs without commands to the board."""


@dataclass(frozen=True, slots=True)
class Number:
    """One parameter of the fit.

    Attributes:
        key: In the car file; `start`: initial value, times the file's value if `scales`.
        step: Of its derivative.
    """

    key: str
    start: float
    step: float
    low: float
    high: float
    scales: bool = False


NUMBERS = (
    Number("steering.trim_rad", 0.0, 2e-3, -0.3, 0.3),
    Number("steering.gain", 1.0, 1e-2, 0.2, 2.0),
    Number("drive.deadband", 0.1, 4e-3, 0.0, 0.6),
    Number("drive.gain", 1.0, 1e-2, 0.1, 3.0),
    Number("drive.delay_s", 0.1, 4e-3, -0.1, 0.5),  # below 0: the clocks of car and Eye differ
    Number("steering.delay_s", 0.1, 4e-3, -0.1, 0.5),
    Number("steering.rate_rad_s", 1.0, 2e-2, 0.2, 20.0, scales=True),
)


@dataclass(frozen=True, slots=True)
class Found:
    """One fitted parameter with its 90 % interval."""

    value: float
    low: float
    high: float

    @property
    def std(self) -> float:
        """Standard deviation of a normal distribution with this interval."""
        return (self.high - self.low) / (2.0 * Z_90)


@dataclass(frozen=True, slots=True)
class Resimulation:
    """The drive as measured, and simulated window by window with the file's and the new parameters.

    Attributes:
        commands: Time [s], throttle and steering from then on, (n, 3).
        t: Of all poses used [s], (m,).
        paths: As measured, by the file (with the delays found), as found: poses shifted to the best
            fit in each window [m, m, rad], (3, m, 3).
    """

    commands: Floats
    t: Floats
    paths: Floats

    @property
    def missed_m(self) -> tuple[float, float]:
        """RMS distance from the measured path [m]: with the file's parameters, and with the new."""
        away = self.paths[1:, :, :2] - self.paths[0, :, :2]
        by_file, found = np.sqrt((away**2).sum(axis=2).mean(axis=1))
        return float(by_file), float(found)


@dataclass(frozen=True, slots=True)
class Fit:
    """Result of a calibration.

    Attributes:
        numbers: By key of the car file.
        position_rms_m: Residual; likewise `yaw_rms_rad`.
        windows: Number of windows used.
        silent: Number of windows not used, because nothing was commanded for a while.
        resimulated: The drive, simulated again.
    """

    numbers: Mapping[str, Found]
    position_rms_m: float
    yaw_rms_rad: float
    windows: int
    silent: int
    resimulated: Resimulation


class _Model:
    """Simulates the drive with the car's kernel: residuals for many parameter sets at once."""

    def __init__(self, car: Car, commands: Floats, poses: Floats) -> None:
        self._car = car.with_terms(TERMS)
        self.commands = commands
        inside = (poses[:, 0] >= commands[0, 0]) & (poses[:, 0] <= commands[-1, 0])
        self._poses = poses[inside].copy()
        self._poses[:, 3] = np.unwrap(self._poses[:, 3])
        self.begin_s = float(commands[0, 0])
        steps = STEPS_PER_SAMPLE * int(
            (commands[-1, 0] - self.begin_s) / (STEPS_PER_SAMPLE * STEP_S)
        )
        self._edges = self.begin_s + STEP_S * np.arange(steps + 1)
        self._sample_t = self._edges[::STEPS_PER_SAMPLE]
        t = self._poses[:, 0]
        which = np.searchsorted(_window_edges(commands), t, side="right")
        parts = [np.flatnonzero(which == w) for w in np.unique(which)]
        gaps = np.diff(commands[:, 0])
        silent = (
            commands[:-1, 0][gaps > SILENT_S],
            commands[1:, 0][gaps > SILENT_S] + STEER_TRANSIENT_S,
        )
        whole = [part for part in parts if len(part) >= MIN_WINDOW_POSES]
        self.windows = [
            part for part in whole
            if not ((t[part[0]] < silent[1]) & (t[part[-1]] > silent[0])).any()
        ]  # fmt: skip
        self.silent = len(whole) - len(self.windows)
        self.stds = np.array([POSITION_STD_M, POSITION_STD_M, YAW_STD_RAD])
        row = np.searchsorted(self._sample_t, t, side="right") - 1
        self._row = np.clip(row, 0, len(self._sample_t) - 2)
        since = (t - self._sample_t[self._row]) / (STEPS_PER_SAMPLE * STEP_S)
        self._since = np.clip(since, 0.0, 1.0)[:, None]
        self._fleet = Fleet(self._car, LANES)

    def values(self, z: Floats) -> Floats:
        """Return the car file's values for parameters in units of their steps."""
        own = [self._car.value(n.key) if n.scales else 1.0 for n in NUMBERS]
        scaled = [n.start + n.step * each for n, each in zip(NUMBERS, z, strict=True)]
        return np.asarray(np.array(scaled) * np.array(own))

    def residuals(
        self, sets: Sequence[Floats], commands: Sequence[Floats] = ()
    ) -> list[list[Floats]]:
        """Return the residuals of each set, window by window, in standard deviations.

        Args:
            sets: Parameters in units of their steps, at most LANES sets.
            commands: Of each set; empty: those of the drive for all.
        """
        values = np.array([self.values(z) for z in sets])
        driven = self._drive(values, commands or [self.commands] * len(sets))
        i = self._row
        paths = np.stack([each[i] + self._since * (each[i + 1] - each[i]) for each in driven], -1)
        left = [self._left(paths[part], self._poses[part, None, 1:]) for part in self.windows]
        return [[window[:, row] for window in left] for row in range(len(sets))]

    def resimulated(self, z: Floats) -> Resimulation:
        """Return the drive as measured, by the file's parameters, and by these."""
        by_file = z.copy()
        for i, n in enumerate(NUMBERS):
            if n.key not in DELAYS:
                own = 1.0 if n.scales else self._car.value(n.key)
                by_file[i] = (own - n.start) / n.step
        which = np.concatenate(self.windows)
        seen = self._poses[which, 1:]
        left = [np.concatenate(each) for each in self.residuals([np.array(by_file), z])]
        paths = np.array([seen, *(seen - self.stds * each for each in left)])
        return Resimulation(self.commands, self._poses[which, 0], paths)

    def rounded(self, offset: float) -> Floats:
        """Return the commands as applied by a firmware that truncates to its steps.

        Args:
            offset: Of its steps from the commands, 0 to 1 of one; the mean is restored.
        """
        commands = self.commands[:, 1:]
        cut = FIRMWARE_STEPS * (np.floor(commands / FIRMWARE_STEPS + offset) + 0.5 - offset)
        rests = (commands == 0.0) & np.array([True, False])
        return np.column_stack([self.commands[:, 0], np.where(rests, 0.0, cut)])

    def _drive(self, values: Floats, commands: Sequence[Floats]) -> list[Floats]:
        """Return x, y and yaw of each row's car at the stored times, (times, rows)."""
        fleet, rows = self._fleet, len(values)
        at = {n.key: i for i, n in enumerate(NUMBERS)}
        start = Pose2(*self._poses[0, 1:])
        delayed = []
        for column, key in enumerate(DELAYS, start=1):
            delayed.append(np.zeros((len(self._edges) - 1, LANES)))
            known = dict[tuple[int, float], Floats]()
            for row, each in enumerate(commands):
                which = id(each), float(values[row, at[key]])
                if which not in known:
                    known[which] = self._delayed(each, column, which[1])
                delayed[-1][:, row] = known[which]
        for row in range(LANES):
            fleet.remove(row)
        for row in range(rows):
            fleet.add(start)
            for key in at.keys() - set(DELAYS):
                fleet.set_parameter(row, key, float(values[row, at[key]]))
        done = fleet.rollout(delayed[0], delayed[1], STEP_S, ("x", "y", "yaw"))
        x, y, yaw = (
            np.vstack(
                [
                    np.full((1, rows), at_start),
                    done[name][STEPS_PER_SAMPLE - 1 :: STEPS_PER_SAMPLE, :rows],
                ]
            )
            for name, at_start in zip(("x", "y", "yaw"), start, strict=True)
        )
        return [x, y, np.unwrap(yaw, axis=0)]

    def _delayed(self, commands: Floats, column: int, delay_s: float) -> Floats:
        """Return the mean of a delayed command over each step, (steps,)."""
        t, held = commands[:, 0], commands[:-1, column]
        whole = np.concatenate([[0.0], np.cumsum(held * np.diff(t))])
        return np.asarray(np.diff(np.interp(self._edges - delay_s, t, whole)) / STEP_S)

    def _left(self, paths: Floats, seen: Floats) -> Floats:
        """Return the residual of each path, shifted to where it fits best, (n, paths, 3).

        Args:
            paths: (n, paths, 3).
            seen: Measured path, (n, 1, 3).
        """
        away = paths[..., :2] - paths[..., :2].mean(axis=0)
        there = seen[..., :2] - seen[..., :2].mean(axis=0)
        turned = seen[..., 2] - paths[..., 2]
        turn = turned.mean(axis=0)
        for _ in range(3):
            c, s = np.cos(turn), np.sin(turn)
            x = c * away[..., 0] - s * away[..., 1]
            y = s * away[..., 0] + c * away[..., 1]
            rest = np.stack([there[..., 0] - x, there[..., 1] - y, turned - turn], axis=-1)
            lever = np.stack([-y, x, np.ones_like(x)], axis=-1) / self.stds
            rest /= self.stds
            slip = (lever * rest).sum(axis=(0, 2)) / (lever * lever).sum(axis=(0, 2))
            turn = turn + slip
        return np.asarray(rest - slip[:, None] * lever)


def fit(car: Car, commands: Floats, poses: Floats, eye_delay_s: float = 0.0) -> Fit:
    """Return the parameters identified from a drive.

    Args:
        car: The car to calibrate.
        commands: Time [s], throttle and steering from then on, (n, 3).
        poses: Time [s] and pose of the rear axle [m, m, rad], (m, 4), on the same clock.
        eye_delay_s: Share of the delays found that is the Eye's.

    Raises:
        RecordingError: when the drive is too short.
    """
    length_s = float(commands[-1, 0] - commands[0, 0]) if len(commands) else 0.0
    if length_s < MIN_DRIVE_S:
        msg = f"calibration: got a drive of {length_s:.1f} s, expected at least {MIN_DRIVE_S:g} s"
        raise RecordingError(msg)
    model = _Model(car, commands, poses)
    if len(model.windows) <= len(NUMBERS):
        msg = (
            f"calibration: got poses in {len(model.windows)} windows of 1 to 3 s, "
            f"expected more than {len(NUMBERS)}"
        )
        raise RecordingError(msg)
    z, apart = np.zeros(len(NUMBERS)), np.ones(len(NUMBERS))
    for _ in range(MAX_ITERATIONS):
        left, slopes = _slopes(model, z, apart)
        step, halves = _solve(left, slopes, z)
        moved = _stepped(model, z, step) - z
        z = z + moved
        model.stds = model.stds * _rms(left)
        apart = np.clip(halves, MIN_DIFFERENCE, 1.0)
        if (np.abs(moved) < CONVERGED * halves).all():
            break
    left, slopes = _slopes(model, z, apart)
    _, halves = _solve(left, slopes, z)
    halves = np.hypot(halves, Z_90 * _rounding(model, z, left, slopes))
    return _result(model, z, halves, left, eye_delay_s)


def _window_edges(commands: Floats) -> list[float]:
    """Return where windows begin: with each leg, since the error of a rounded command lasts one.

    A leg begins where throttle follows zero throttle; longer stretches without are cut by time.
    """
    t, throttle = commands[:, 0], commands[:, 1]
    begins = t[1:][(throttle[:-1] == 0.0) & (throttle[1:] != 0.0)]
    edges = [float(t[0])]
    for begin in (*begins.tolist(), float(t[-1])):
        while begin - edges[-1] > MAX_WINDOW_S:
            edges.append(edges[-1] + WINDOW_S)
        if begin - edges[-1] >= MIN_WINDOW_S:
            edges.append(begin)
    return edges


def _slopes(model: _Model, z: Floats, apart: Floats) -> tuple[list[Floats], list[Floats]]:
    """Return residuals and their derivatives, window by window, (3 n,) and (3 n, parameters).

    Derivatives are central differences over `apart` on either side, in units of the steps.
    """
    units = np.diag(apart)
    driven = model.residuals([z, *(z + units), *(z - units)])
    sides = driven[1 : len(z) + 1], driven[len(z) + 1 :]
    slopes = [
        np.column_stack([(up - down).ravel() for up, down in zip(*both, strict=True)])
        / (2.0 * apart)
        for both in zip(*(zip(*side, strict=True) for side in sides), strict=True)
    ]
    return driven[0], slopes


def _solve(left: Sequence[Floats], slopes: Sequence[Floats], z: Floats) -> tuple[Floats, Floats]:
    """Return the Gauss-Newton step, and half of each 90 % interval, in units of their steps."""
    prior = np.eye(len(z)) / PRIOR**2
    normals, pulls = [], []
    count, total = 0, 0.0
    for rest, slope in zip(left, slopes, strict=True):
        r = rest.ravel()
        weight = 1.0 / (1.0 + r * r / STUDENT_DOF)
        normals.append((slope * weight[:, None]).T @ slope)
        pulls.append(slope.T @ (weight * r))
        count, total = count + len(r) - 3, total + float((weight * r * r).sum())
    normal = prior + sum(normals)
    inverse = np.asarray(np.linalg.inv(normal), dtype=np.float64)
    white = inverse.diagonal() * max(1.0, total / (count - len(z)))
    without = [np.linalg.solve(normal - n, p) for n, p in zip(normals, pulls, strict=True)]
    jackknife = (len(left) - 1) * np.var(without, axis=0)
    share = np.array([(inverse @ n @ inverse).diagonal() for n in normals]) / inverse.diagonal()
    free = 1.0 / np.maximum((share * share).sum(axis=0), 1.0 / MAX_EFFECTIVE_WINDOWS) - 1.0
    halves = np.maximum(Z_90 * np.sqrt(white), _student(free) * np.sqrt(jackknife))
    return -inverse @ (prior @ z + sum(pulls)), halves


def _rounding(model: _Model, z: Floats, left: Sequence[Floats], slopes: Sequence[Floats]) -> Floats:
    """Return the RMS error of the parameters from a firmware's rounding, in units of their steps.

    Each of several roundings changes the residuals, and so the parameters by one Gauss-Newton step.
    """
    slope = np.concatenate(slopes)
    weight = 1.0 / (1.0 + np.concatenate([rest.ravel() for rest in left]) ** 2 / STUDENT_DOF)
    normal = np.eye(len(z)) / PRIOR**2 + (slope * weight[:, None]).T @ slope
    before = np.concatenate([rest.ravel() for rest in left])
    offsets = (np.arange(ROUNDING_OFFSETS) + 0.5) / ROUNDING_OFFSETS
    firmwares = [model.rounded(float(offset)) for offset in offsets]
    shifts = []
    for after in model.residuals([z] * ROUNDING_OFFSETS, firmwares):
        moved = np.concatenate([rest.ravel() for rest in after]) - before
        shifts.append(np.linalg.solve(normal, slope.T @ (weight * moved)))
    return np.asarray(np.sqrt(np.mean(np.square(shifts), axis=0)))


def _student(free: Floats) -> Floats:
    """Return the 95 % point of Student's t, by its expansion about the normal's; at least two."""
    n, z = np.maximum(free, 2.0), Z_90
    second = (5.0 * z**5 + 16.0 * z**3 + 3.0 * z) / 96.0
    third = (3.0 * z**7 + 19.0 * z**5 + 17.0 * z**3 - 15.0 * z) / 384.0
    return np.asarray(z + (z**3 + z) / (4.0 * n) + second / n**2 + third / n**3)


def _stepped(model: _Model, z: Floats, step: Floats) -> Floats:
    """Return the best of several step lengths, zero included."""
    low = np.array([(n.low - n.start) / n.step for n in NUMBERS])
    high = np.array([(n.high - n.start) / n.step for n in NUMBERS])
    trials = [np.clip(z + share * step, low + 1.0, high - 1.0) for share in STEP_FRACTIONS]
    losses = [_loss(windows) for windows in model.residuals([z, *trials])]
    return [z, *trials][int(np.argmin(losses))]


def _loss(windows: Sequence[Floats]) -> float:
    return float(sum(STUDENT_DOF * np.log1p(rest * rest / STUDENT_DOF).sum() for rest in windows))


def _rms(left: Sequence[Floats]) -> Floats:
    """Return the RMS of the residuals, in x and y together and in yaw, (3,)."""
    rest = np.concatenate(left)
    weighted = rest * rest / (1.0 + rest * rest / STUDENT_DOF)
    mean = weighted.mean(axis=0)
    position = (mean[0] + mean[1]) / 2.0
    return np.asarray(np.sqrt(np.array([position, position, mean[2]]) / NORMAL_CONSISTENCY))


def _result(
    model: _Model, z: Floats, halves: Floats, left: Sequence[Floats], eye_delay_s: float
) -> Fit:
    values = model.values(z)
    scale = [Z_90 * SCALE_STD * v / n.step for v, n in zip(values, NUMBERS, strict=True)]
    metres = np.array([n.key in EYE_SCALED for n in NUMBERS])
    halves = np.hypot(halves, metres * scale)
    ends = [model.values(z + way * halves) for way in (-1.0, 1.0)]
    found = {}
    for n, *numbers in zip(NUMBERS, values, *ends, strict=True):
        off = eye_delay_s if n.key in DELAYS else 0.0
        value, low, high = (float(number) - off for number in numbers)
        found[n.key] = Found(max(0.0, value) if n.key in DELAYS else value, low, high)
    position, _, yaw = model.stds * _rms(left)
    return Fit(found, float(position), float(yaw), len(left), model.silent, model.resimulated(z))


def unsure(found: Fit) -> list[str]:
    """Return what is wrong with a drive, a line each; empty: its parameters may be used."""
    lines = []
    legs = found.windows + found.silent
    if found.silent > SILENT_SHARE * legs:
        lines.append(
            f"in {found.silent} of {legs} legs no command left for the board for 0.1 s: "
            "the computer was too busy, or the cable was disconnected"
        )
    for key, widest in WIDEST.items():
        one = found.numbers[key]
        half = (one.high - one.low) / 2.0
        if half > widest:
            lines.append(f"{key} is known to {half:.3g} only, expected {widest:g}")
    return lines
