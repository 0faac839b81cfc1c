"""A car's own numbers from its commands and the Eye's poses.

The drive is driven again by the car's own kernel, with other numbers in every row of one fleet,
and cut into windows, a leg each. In each window the drive may lie wherever it fits best, so that
errors of long ago do not count; what is left over is the residual. Gauss-Newton moves the numbers.

Intervals are 90 %: the wider of what white residuals say and of what the windows' own scatter says
(a jackknife that leaves out a window at a time), so that an Eye whose errors last for a while does
not make them too narrow; Student's t of as many windows as bear on a number. The numbers are those
of the line that lies best through what a firmware that rounds makes of commands: added is what the
published one's steps would do to this drive, of which legs that are all rounded alike show little;
and to both gains that the Eye's metre is unsure. The Eye's own delay cannot be told from that of
both actuators: the delays found are sums, and `eye_delay_s` of them is taken off as the Eye's.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats
from scm.errors import RecordingError
from scm.geometry import Pose2
from scm.vehicles.car import Car
from scm.vehicles.fleet import Fleet
from scm.vehicles.lanes import LANES

TERMS = ("steer_trim", "steer_gain", "drive_deadband", "drive_gain")
STEP_S = 0.001  # a servo at its rate moves by when it is told: coarser steps shift its delay
KEPT = 10  # steps from pose to pose that is kept
WINDOW_S = 2.5  # of what no rest parts
SHORTEST_S, LONGEST_S = 1.0, 3.0
LEAST_S = 20.0
DELAYS = ("drive.delay_s", "steering.delay_s")
PRIOR = 100.0  # steps of its derivative that a number may be from where it begins
SILENT_S = 0.1  # without a command: who stalled does not know what the wheels were told meanwhile
SETTLES_S = 0.2
FEWEST = 5  # poses of a window that counts
NEAREST = 0.05  # of those steps: nearer than that differences are the kernel's own rounding
ROUNDS = 20
SHARES = (1.0, 0.5, 0.2, 0.05)
WIDE = 1.645  # standard deviations from the middle to the end of a 90 % interval
TAIL = 8.0  # degrees of freedom of the Student-t loss: a few wild poses prove nothing
OF_NORMAL = 0.7572  # mean of r^2 / (1 + r^2 / TAIL) over a normal r
MANY = 1e6  # windows, where none bears on a number
SCALE_STD = 2e-3  # of the Eye's metre: what all poses are wrong by alike, no residual shows
METRES = ("steering.gain", "drive.gain")  # curvature and speed: numbers that are read off it
STEPS = np.array([1.0 / 255.0, 1.0 / 30.0])  # of the published firmware: throttle, steering
FIRMWARES = 8
SETTLED = 0.01  # of half an interval that a last step may move a number
POSITION_STD_M, YAW_STD_RAD = 5e-3, 1e-2


@dataclass(frozen=True, slots=True)
class Number:
    """One number that is fitted.

    Attributes:
        key: In the car file; `start`: where the fit begins, times the file's value if `scales`.
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
    """One number as it was fitted, with its 90 % interval."""

    value: float
    low: float
    high: float

    @property
    def std(self) -> float:
        """Standard deviation of a normal belief with this interval."""
        return (self.high - self.low) / (2.0 * WIDE)


@dataclass(frozen=True, slots=True)
class Again:
    """The drive as seen, and driven again window by window by the file and by what was found.

    Attributes:
        commands: Time [s], throttle and steering from then on, (n, 3).
        t: Of all poses that count [s], (m,).
        paths: As seen, by the file (the delays found count there too), as found: poses that lie in
            each window where they fit best [m, m, rad], (3, m, 3).
    """

    commands: Floats
    t: Floats
    paths: Floats

    @property
    def missed_m(self) -> tuple[float, float]:
        """Root mean square distance from what was seen [m]: by the file, and as found."""
        away = self.paths[1:, :, :2] - self.paths[0, :, :2]
        by_file, found = np.sqrt((away**2).sum(axis=2).mean(axis=1))
        return float(by_file), float(found)


@dataclass(frozen=True, slots=True)
class Fit:
    """What a drive says.

    Attributes:
        numbers: By key of the car file.
        position_rms_m: What is left over; likewise `yaw_rms_rad`.
        windows: How many counted.
        silent: How many did not, because nothing was commanded for a while.
        again: The drive, driven again.
    """

    numbers: Mapping[str, Found]
    position_rms_m: float
    yaw_rms_rad: float
    windows: int
    silent: int
    again: Again


class _Model:
    """The drive by the car's kernel: residuals of many sets of numbers at once."""

    def __init__(self, car: Car, commands: Floats, poses: Floats) -> None:
        self._car = car.with_terms(TERMS)
        self.commands = commands
        inside = (poses[:, 0] >= commands[0, 0]) & (poses[:, 0] <= commands[-1, 0])
        self._poses = poses[inside].copy()
        self._poses[:, 3] = np.unwrap(self._poses[:, 3])
        self.begin_s = float(commands[0, 0])
        steps = KEPT * int((commands[-1, 0] - self.begin_s) / (KEPT * STEP_S))
        self._edges = self.begin_s + STEP_S * np.arange(steps + 1)
        self._kept = self._edges[::KEPT]
        t = self._poses[:, 0]
        which = np.searchsorted(_window_edges(commands), t, side="right")
        parts = [np.flatnonzero(which == w) for w in np.unique(which)]
        told = np.diff(commands[:, 0])
        silent = commands[:-1, 0][told > SILENT_S], commands[1:, 0][told > SILENT_S] + SETTLES_S
        whole = [part for part in parts if len(part) >= FEWEST]
        self.windows = [
            part for part in whole
            if not ((t[part[0]] < silent[1]) & (t[part[-1]] > silent[0])).any()
        ]  # fmt: skip
        self.silent = len(whole) - len(self.windows)
        self.stds = np.array([POSITION_STD_M, POSITION_STD_M, YAW_STD_RAD])
        row = np.searchsorted(self._kept, t, side="right") - 1
        self._row = np.clip(row, 0, len(self._kept) - 2)
        since = (t - self._kept[self._row]) / (KEPT * STEP_S)
        self._since = np.clip(since, 0.0, 1.0)[:, None]
        self._fleet = Fleet(self._car, LANES)

    def values(self, z: Floats) -> Floats:
        """Return the numbers of the car file for numbers in units of their steps."""
        own = [self._car.value(n.key) if n.scales else 1.0 for n in NUMBERS]
        scaled = [n.start + n.step * each for n, each in zip(NUMBERS, z, strict=True)]
        return np.asarray(np.array(scaled) * np.array(own))

    def residuals(
        self, sets: Sequence[Floats], commands: Sequence[Floats] = ()
    ) -> list[list[Floats]]:
        """Return the residuals of each set, window by window, in standard deviations.

        Args:
            sets: Numbers in units of their steps, LANES sets at most.
            commands: Of each set; empty: all obey those of the drive.
        """
        values = np.array([self.values(z) for z in sets])
        driven = self._drive(values, commands or [self.commands] * len(sets))
        i = self._row
        paths = np.stack([each[i] + self._since * (each[i + 1] - each[i]) for each in driven], -1)
        left = [self._left(paths[part], self._poses[part, None, 1:]) for part in self.windows]
        return [[window[:, row] for window in left] for row in range(len(sets))]

    def again(self, z: Floats) -> Again:
        """Return the drive as seen, by the file's own numbers, and by these."""
        by_file = z.copy()
        for i, n in enumerate(NUMBERS):
            if n.key not in DELAYS:
                own = 1.0 if n.scales else self._car.value(n.key)
                by_file[i] = (own - n.start) / n.step
        which = np.concatenate(self.windows)
        seen = self._poses[which, 1:]
        left = [np.concatenate(each) for each in self.residuals([np.array(by_file), z])]
        paths = np.array([seen, *(seen - self.stds * each for each in left)])
        return Again(self.commands, self._poses[which, 0], paths)

    def rounded(self, offset: float) -> Floats:
        """Return the commands as a firmware obeys them that cuts off behind each of its steps.

        Args:
            offset: Of its steps from the commands, 0 to 1 of one; the mean is put back.
        """
        told = self.commands[:, 1:]
        cut = STEPS * (np.floor(told / STEPS + offset) + 0.5 - offset)
        rests = (told == 0.0) & np.array([True, False])
        return np.column_stack([self.commands[:, 0], np.where(rests, 0.0, cut)])

    def _drive(self, values: Floats, commands: Sequence[Floats]) -> list[Floats]:
        """Return x, y and yaw of each row's car at the times that are kept, (kept, rows)."""
        fleet, rows = self._fleet, len(values)
        at = {n.key: i for i, n in enumerate(NUMBERS)}
        start = Pose2(*self._poses[0, 1:])
        late = []
        for column, key in enumerate(DELAYS, start=1):
            late.append(np.zeros((len(self._edges) - 1, LANES)))
            known = dict[tuple[int, float], Floats]()
            for row, told in enumerate(commands):
                which = id(told), float(values[row, at[key]])
                if which not in known:
                    known[which] = self._late(told, column, which[1])
                late[-1][:, row] = known[which]
        for row in range(LANES):
            fleet.remove(row)
        for row in range(rows):
            fleet.add(start)
            for key in at.keys() - set(DELAYS):
                fleet.set_parameter(row, key, float(values[row, at[key]]))
        done = fleet.rollout(late[0], late[1], STEP_S, ("x", "y", "yaw"))
        x, y, yaw = (
            np.vstack([np.full((1, rows), at_start), done[name][KEPT - 1 :: KEPT, :rows]])
            for name, at_start in zip(("x", "y", "yaw"), start, strict=True)
        )
        return [x, y, np.unwrap(yaw, axis=0)]

    def _late(self, commands: Floats, column: int, delay_s: float) -> Floats:
        """Return the mean of a command over each step, so much later, (steps,)."""
        t, held = commands[:, 0], commands[:-1, column]
        whole = np.concatenate([[0.0], np.cumsum(held * np.diff(t))])
        return np.asarray(np.diff(np.interp(self._edges - delay_s, t, whole)) / STEP_S)

    def _left(self, paths: Floats, seen: Floats) -> Floats:
        """Return what is left over once each path lies where it fits best, (n, paths, 3).

        Args:
            paths: (n, paths, 3).
            seen: What each is to lie on, (n, 1, 3).
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
    """Return the numbers that a drive shows.

    Args:
        car: Whose file is to be made better.
        commands: Time [s], throttle and steering from then on, (n, 3).
        poses: Time [s] and pose of the rear axle [m, m, rad], (m, 4), on the same clock.
        eye_delay_s: Of the delays found so much is the Eye's.

    Raises:
        RecordingError: when the drive is too short to say anything.
    """
    length_s = float(commands[-1, 0] - commands[0, 0]) if len(commands) else 0.0
    if length_s < LEAST_S:
        msg = f"calibration: got a drive of {length_s:.1f} s, expected at least {LEAST_S:g} s"
        raise RecordingError(msg)
    model = _Model(car, commands, poses)
    if len(model.windows) <= len(NUMBERS):
        msg = (
            f"calibration: got poses in {len(model.windows)} windows of 1 to 3 s, "
            f"expected more than {len(NUMBERS)}"
        )
        raise RecordingError(msg)
    z, apart = np.zeros(len(NUMBERS)), np.ones(len(NUMBERS))
    for _ in range(ROUNDS):
        left, slopes = _slopes(model, z, apart)
        step, halves = _solve(left, slopes, z)
        moved = _stepped(model, z, step) - z
        z = z + moved
        model.stds = model.stds * _rms(left)
        apart = np.clip(halves, NEAREST, 1.0)
        if (np.abs(moved) < SETTLED * halves).all():
            break
    left, slopes = _slopes(model, z, apart)
    _, halves = _solve(left, slopes, z)
    halves = np.hypot(halves, WIDE * _rounding(model, z, left, slopes))
    return _told(model, z, halves, left, eye_delay_s)


def _window_edges(commands: Floats) -> list[float]:
    """Return where windows begin: with each leg, for what a rounded command is wrong by lasts one.

    A leg begins where throttle follows upon none; what lasts longer without is cut by the clock.
    """
    t, throttle = commands[:, 0], commands[:, 1]
    begins = t[1:][(throttle[:-1] == 0.0) & (throttle[1:] != 0.0)]
    edges = [float(t[0])]
    for begin in (*begins.tolist(), float(t[-1])):
        while begin - edges[-1] > LONGEST_S:
            edges.append(edges[-1] + WINDOW_S)
        if begin - edges[-1] >= SHORTEST_S:
            edges.append(begin)
    return edges


def _slopes(model: _Model, z: Floats, apart: Floats) -> tuple[list[Floats], list[Floats]]:
    """Return residuals and their derivatives, window by window, (3 n,) and (3 n, numbers).

    Derivatives are differences between numbers `apart` on either side, in units of their steps.
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
        weight = 1.0 / (1.0 + r * r / TAIL)
        normals.append((slope * weight[:, None]).T @ slope)
        pulls.append(slope.T @ (weight * r))
        count, total = count + len(r) - 3, total + float((weight * r * r).sum())
    normal = prior + sum(normals)
    inverse = np.asarray(np.linalg.inv(normal), dtype=np.float64)
    white = inverse.diagonal() * max(1.0, total / (count - len(z)))
    without = [np.linalg.solve(normal - n, p) for n, p in zip(normals, pulls, strict=True)]
    scatter = (len(left) - 1) * np.var(without, axis=0)
    share = np.array([(inverse @ n @ inverse).diagonal() for n in normals]) / inverse.diagonal()
    free = 1.0 / np.maximum((share * share).sum(axis=0), 1.0 / MANY) - 1.0
    halves = np.maximum(WIDE * np.sqrt(white), _student(free) * np.sqrt(scatter))
    return -inverse @ (prior @ z + sum(pulls)), halves


def _rounding(model: _Model, z: Floats, left: Sequence[Floats], slopes: Sequence[Floats]) -> Floats:
    """Return how far off the numbers are where the firmware rounds, in units of their steps (rms).

    Each of several firmwares moves the residuals, and so the numbers by one Gauss-Newton step.
    """
    slope = np.concatenate(slopes)
    weight = 1.0 / (1.0 + np.concatenate([rest.ravel() for rest in left]) ** 2 / TAIL)
    normal = np.eye(len(z)) / PRIOR**2 + (slope * weight[:, None]).T @ slope
    before = np.concatenate([rest.ravel() for rest in left])
    offsets = (np.arange(FIRMWARES) + 0.5) / FIRMWARES
    firmwares = [model.rounded(float(offset)) for offset in offsets]
    shifts = []
    for after in model.residuals([z] * FIRMWARES, firmwares):
        moved = np.concatenate([rest.ravel() for rest in after]) - before
        shifts.append(np.linalg.solve(normal, slope.T @ (weight * moved)))
    return np.asarray(np.sqrt(np.mean(np.square(shifts), axis=0)))


def _student(free: Floats) -> Floats:
    """Return the 95 % point of Student's t, by its expansion about the normal's; two at least."""
    n, z = np.maximum(free, 2.0), WIDE
    second = (5.0 * z**5 + 16.0 * z**3 + 3.0 * z) / 96.0
    third = (3.0 * z**7 + 19.0 * z**5 + 17.0 * z**3 - 15.0 * z) / 384.0
    return np.asarray(z + (z**3 + z) / (4.0 * n) + second / n**2 + third / n**3)


def _stepped(model: _Model, z: Floats, step: Floats) -> Floats:
    """Return the best of several lengths of a step, none included."""
    low = np.array([(n.low - n.start) / n.step for n in NUMBERS])
    high = np.array([(n.high - n.start) / n.step for n in NUMBERS])
    trials = [np.clip(z + share * step, low + 1.0, high - 1.0) for share in SHARES]
    losses = [_loss(windows) for windows in model.residuals([z, *trials])]
    return [z, *trials][int(np.argmin(losses))]


def _loss(windows: Sequence[Floats]) -> float:
    return float(sum(TAIL * np.log1p(rest * rest / TAIL).sum() for rest in windows))


def _rms(left: Sequence[Floats]) -> Floats:
    """Return the root mean square of what is left over, in x and y together and in yaw, (3,)."""
    rest = np.concatenate(left)
    weighted = rest * rest / (1.0 + rest * rest / TAIL)
    mean = weighted.mean(axis=0)
    position = (mean[0] + mean[1]) / 2.0
    return np.asarray(np.sqrt(np.array([position, position, mean[2]]) / OF_NORMAL))


def _told(
    model: _Model, z: Floats, halves: Floats, left: Sequence[Floats], eye_delay_s: float
) -> Fit:
    values = model.values(z)
    scale = [WIDE * SCALE_STD * v / n.step for v, n in zip(values, NUMBERS, strict=True)]
    metres = np.array([n.key in METRES for n in NUMBERS])
    halves = np.hypot(halves, metres * scale)
    ends = [model.values(z + way * halves) for way in (-1.0, 1.0)]
    found = {}
    for n, *numbers in zip(NUMBERS, values, *ends, strict=True):
        off = eye_delay_s if n.key in DELAYS else 0.0
        value, low, high = (float(number) - off for number in numbers)
        found[n.key] = Found(max(0.0, value) if n.key in DELAYS else value, low, high)
    position, _, yaw = model.stds * _rms(left)
    return Fit(found, float(position), float(yaw), len(left), model.silent, model.again(z))
