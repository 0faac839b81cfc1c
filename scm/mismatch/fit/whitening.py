"""What is left of the measurements after a prediction, weighed: innovations of a Kalman filter.

The filter allows for slow disturbances of speed, side speed and yaw rate that all channels share,
of each wheel or accelerometer alone, and for noise of poses that lasts (all first-order
Gauss-Markov). It is linear and its gains do not depend on the prediction, so one pass weighs the
residuals of many parameter sets: innovations are independent of unit variance where the prediction
is right, and no derivative is ever taken.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats, Ints
from scm.mismatch.fit.noise import Noise
from scm.replay.commands import Commanded
from scm.replay.drive import Drive
from scm.vehicles.jit import array_kernel

EX, EY, EPSI, DV, DY, DR = range(6)
BODY = 6
LOST = 1e5, 100.0  # of a pose that was not seen for long: position by its noise, yaw [rad]
FELT_S = 0.1
AT_ONCE = 64  # sets weighed together: what is worked on stays small
SLOW = 0.12  # of the usual speed: below it dry friction decides, to the moment, when a car halts
HALT, HALTING = 0.3, 3.0  # as a leap of so much throttle; of an accelerometer's own disturbance
SHORT_S = 0.3  # how long an accelerometer's own disturbance lasts
POSES = {"pose.x": EX, "pose.y": EY, "pose.yaw": EPSI}
RATES = {"imu.gyro_z": DR, "yaw_rate": DR, "velocity.x": DV, "speed": DV, "velocity.y": DY}


@dataclass(frozen=True, slots=True)
class _System:
    """The filter's matrices: couplings (i, j, a) beside pose and heading, decays, observations."""

    size: int
    rows: Ints
    columns: Ints
    factors: Floats
    lasts: Floats
    spread: Floats
    start: Floats
    see: Floats
    variance: Floats
    slips: Floats


def _system(drive: Drive, noise: Noise) -> _System:
    radius, half = drive.car.value("wheel.radius_m"), 0.5 * drive.car.value("body.track_m")
    couple: list[tuple[int, int, float]] = [(EPSI, DR, 1.0)]
    lasts, spread = (
        [0.0] * 3 + [noise.lasts_s] * 3,
        [0.0] * 3 + [noise.speed, noise.side, noise.yaw_rate],
    )
    start = [1e4 * drive.stream("pose.x").std, 1e4 * drive.stream("pose.y").std, 10.0]
    start += [noise.speed, noise.side, noise.yaw_rate]
    see, variance, wheels = list[dict[int, float]](), list[float](), list[int]()

    def add(last: float, std: float, first: float) -> int:
        lasts.append(last)
        spread.append(std)
        start.append(first)
        return len(lasts) - 1

    for s in drive.streams:
        lasting = s.correlated.share * s.std**2
        variance.append((s.std * noise.scale.get(s.name, 1.0)) ** 2 - lasting)
        own = noise.own.get(s.name, 0.0)
        left = 1.0 if s.name.endswith(("left", "fl", "rl")) else -1.0
        if s.name in POSES:
            see.append({POSES[s.name]: 1.0})
            if lasting:
                see[-1][add(s.correlated.lasts_s, lasting**0.5, lasting**0.5)] = 1.0
        elif s.name in RATES:
            see.append({RATES[s.name]: 1.0, add(noise.lasts_s, own, own): 1.0})
        elif s.name.startswith("encoder."):
            counts = drive.car.value("encoder.counts_per_revolution") / (2.0 * np.pi) / radius
            total, slip = add(0.0, 0.0, 1e5), add(noise.lasts_s, own, own)
            couple += [
                (total, DV, counts),
                (total, DR, -left * half * counts),
                (total, slip, counts),
            ]
            see.append({total: 1.0})
            wheels.append(slip)
        elif s.name.startswith("wheel_speed."):
            slip = add(noise.lasts_s, own, own)
            see.append({DV: 1.0 / radius, DR: -left * half / radius, slip: 1.0 / radius})
            wheels.append(slip)
        else:
            see.append({add(SHORT_S, own, own): 1.0})
    size = len(lasts)
    slips = np.zeros(size - BODY)
    slips[[i - BODY for i in wheels]] = 1.0
    matrix = np.zeros((len(see), size))
    for i, row in enumerate(see):
        for j, value in row.items():
            matrix[i, j] = value
    rows, columns, factors = (np.array(x) for x in zip(*couple, strict=True))
    return _System(
        size, rows.astype(np.int64), columns.astype(np.int64), factors.astype(float),
        np.array(lasts), np.array(spread), np.array(start), matrix, np.array(variance), slips,
    )  # fmt: skip


class Events:
    """What a drive's innovations are, whatever the noise model.

    Attributes:
        order: Of the streams' samples, one stream after the other, by their time.
        t, stream, unsure: Of each innovation, (events,).
        halting: 1 where the car hardly moves or is not seen, else 0, (events,).
        cos, sin: Of the measured heading; `since`: time from the one before [s].
        launched, turned: Squared leaps of throttle and steering as they are still felt.
        seen_again: Numbers of the first ones after the camera lost the car.
    """

    def __init__(self, drive: Drive) -> None:
        counts = [len(s.t) for s in drive.streams]
        t = np.concatenate([s.t for s in drive.streams])
        self.order = np.argsort(t, kind="stable")
        self.t: Floats = t[self.order]
        self.stream: Ints = np.repeat(np.arange(len(counts)), counts)[self.order]
        self.unsure = np.concatenate([s.unsure for s in drive.streams])[self.order]
        x, y = drive.smoothed["pose.x"], drive.smoothed["pose.y"]
        speed = np.hypot(x.rate_at(self.t), y.rate_at(self.t))
        slow = (speed < SLOW * np.percentile(speed, 90)) | drive.is_blind(self.t)
        self.halting = slow.astype(np.float64)
        psi = drive.smoothed["pose.yaw"].at(self.t)
        self.cos, self.sin = np.cos(psi), np.sin(psi)
        self.since = np.diff(self.t, prepend=self.t[0])
        self.launched = _felt(drive.throttle, self.t) + HALT**2 * self.halting
        self.turned = _felt(drive.steering, self.t)
        self.seen_again = np.searchsorted(self.t, [last for _, last in drive.blind])


class Whitener:
    """Weighs residuals of one drive under one noise model.

    Attributes:
        t: Time of each innovation, (events,) [s]; `stream`: the number of its stream.
        log_size: Logarithms of the innovations' variances, (events,); NaN where a noise model
            is beyond what numbers can hold.
    """

    def __init__(self, drive: Drive, noise: Noise, events: Events | None = None) -> None:
        self.drive, self.noise = drive, noise
        self._events = its = events or Events(drive)
        self.t, self.stream = its.t, its.stream
        jolt = np.array([noise.own.get(s.name, 0.0) for s in drive.streams])
        jolt *= [s.name.startswith("imu.") for s in drive.streams]
        unsure = np.hypot(its.unsure, HALTING * jolt[self.stream] * its.halting)
        self._system = system = _system(drive, noise)
        leaps = self._leaps(noise, system.size)
        n, count = system.size, len(self.t)
        self._gain, self._variance = np.zeros((count, n)), np.zeros(count)
        self._keep = np.zeros((count, n))
        p = np.diag(system.start**2)
        _gains(
            self.t, self.stream, its.cos, its.sin, system.rows, system.columns,
            system.factors, system.lasts, system.spread, system.see, system.variance, unsure,
            leaps, p, self._gain, self._variance, self._keep,
        )  # fmt: skip
        self.log_size = np.log(np.where(self._variance > 0.0, self._variance, np.nan))

    def under(self, noise: Noise) -> "Whitener":
        """Return what weighs residuals of the same drive under another noise model."""
        return Whitener(self.drive, noise, self._events)

    def _leaps(self, noise: Noise, size: int) -> Floats:
        """Return the variance that leaps of commands add to each state before each event.

        Of where a car is when it is seen again after long, nothing is known.
        """
        its, out = self._events, np.zeros((len(self.t), size))
        launch = noise.launch**2 * its.launched * its.since / FELT_S
        out[:, DV] = launch
        out[:, BODY:] = launch[:, None] * self._system.slips
        out[:, DR] = noise.turn**2 * its.turned * its.since / FELT_S
        for name, state in (("pose.x", EX), ("pose.y", EY)):
            out[its.seen_again, state] = (LOST[0] * self.drive.stream(name).std) ** 2
        out[its.seen_again, EPSI] = LOST[1] ** 2
        return out

    def innovations(self, residuals: Sequence[Floats]) -> Floats:
        """Return unit innovations, (events, sets), of measured minus predicted of each stream."""
        sets, system, its = residuals[0].shape[1], self._system, self._events
        found = np.empty((len(self.t), sets))
        for first in range(0, sets, AT_ONCE):
            some = slice(first, first + AT_ONCE)
            stacked = np.concatenate([r[:, some] for r in residuals], axis=0)[its.order]
            _innovations(
                self.t, self.stream, its.cos, its.sin, system.rows, system.columns,
                system.factors, system.see, self._gain, self._variance, self._keep,
                np.zeros((system.size, stacked.shape[1])), stacked,
            )  # fmt: skip
            found[:, some] = stacked
        return found


def _felt(command: Commanded, t: Floats) -> Floats:
    """Return the squared leaps of a command as they are still felt, fading, at given times."""
    felt = np.zeros(len(command.t))
    _fade(np.abs(np.diff(command.values)), np.exp(-np.diff(command.t) / FELT_S), felt)
    row = np.maximum(np.searchsorted(command.t, t, side="right") - 1, 0)
    now = felt[row] * np.exp(-np.maximum(t - command.t[row], 0.0) / FELT_S)
    return np.asarray(now * now)


@array_kernel
def _fade(leaps: Floats, fade: Floats, felt: Floats) -> None:
    """Write how much of all leaps so far is still felt at each of them and the start."""
    for k in range(1, len(felt)):
        felt[k] = felt[k - 1] * fade[k - 1] + leaps[k - 1]


@array_kernel
def _gains(
    t: Floats, stream: Ints, cos: Floats, sin: Floats, rows: Ints, columns: Ints, factors: Floats,
    lasts: Floats, spread: Floats, see: Floats, variance: Floats, unsure: Floats, leaps: Floats,
    p: Floats, gain: Floats, total: Floats, keep: Floats,
) -> None:  # fmt: skip
    """Run the covariance alone: gains, innovation variances and decays of each event.

    What is coupled to others never decays, and what others are coupled to is coupled to nothing.
    """
    n = p.shape[0]
    for k in range(len(t)):
        dt = t[k] - t[k - 1] if k > 0 else 0.0
        if dt == 0.0:  # sampled with the one before: nothing has moved
            for i in range(n):
                keep[k, i] = 1.0
                p[i, i] += leaps[k, i]
            total[k] = variance[stream[k]] + unsure[k] * unsure[k]
            total[k] = _seen(p, see[stream[k]], total[k], gain[k])
            continue
        for i in range(n):
            if i > 0 and lasts[i] == lasts[i - 1]:
                keep[k, i] = keep[k, i - 1]
            else:
                keep[k, i] = np.exp(-dt / lasts[i]) if lasts[i] > 0.0 else 1.0
        _couple(p, 0, 3, cos[k] * dt)
        _couple(p, 0, 4, -sin[k] * dt)
        _couple(p, 1, 3, sin[k] * dt)
        _couple(p, 1, 4, cos[k] * dt)
        for c in range(len(rows)):
            _couple(p, rows[c], columns[c], factors[c] * dt)
        for i in range(n):
            for j in range(n):
                p[i, j] *= keep[k, i] * keep[k, j]
            p[i, i] += spread[i] * spread[i] * (1.0 - keep[k, i] * keep[k, i]) + leaps[k, i]
        total[k] = variance[stream[k]] + unsure[k] * unsure[k]
        total[k] = _seen(p, see[stream[k]], total[k], gain[k])


@array_kernel
def _couple(p: Floats, i: int, j: int, factor: float) -> None:
    """Add so much of state `j` to state `i`, in the covariance."""
    n = p.shape[0]
    for m in range(n):
        p[i, m] += factor * p[j, m]
    for m in range(n):
        p[m, i] += factor * p[m, j]


@array_kernel
def _seen(p: Floats, h: Floats, noise: float, gain: Floats) -> float:
    """Take one measurement into the covariance; write its gain, return its whole variance."""
    n, s = p.shape[0], noise
    for i in range(n):
        gain[i] = 0.0
    for j in range(n):
        if h[j] != 0.0:
            for i in range(n):
                gain[i] += p[j, i] * h[j]
    for i in range(n):
        s += h[i] * gain[i]
    for i in range(n):
        part = gain[i] / s
        for j in range(n):
            p[i, j] -= part * gain[j]
    for i in range(n):
        gain[i] /= s
    return s


@array_kernel
def _innovations(
    t: Floats, stream: Ints, cos: Floats, sin: Floats, rows: Ints, columns: Ints, factors: Floats,
    see: Floats, gain: Floats, variance: Floats, keep: Floats, x: Floats, out: Floats,
) -> None:  # fmt: skip
    """Turn many sequences of residuals into innovations, through known gains."""
    n, sets = x.shape
    for k in range(len(t)):
        dt = t[k] - t[k - 1] if k > 0 else 0.0
        if dt != 0.0:
            _move(x, cos[k] * dt, sin[k] * dt, rows, columns, factors, dt, keep[k])
        _add(out[k], see[stream[k]], x)
        size = 1.0 / np.sqrt(variance[k])
        for i in range(n):
            for b in range(sets):
                x[i, b] += gain[k, i] * out[k, b]
        for b in range(sets):
            out[k, b] *= size


@array_kernel
def _move(
    x: Floats, c: float, s: float, rows: Ints, columns: Ints, factors: Floats, dt: float,
    keep: Floats,
) -> None:  # fmt: skip
    """Carry the states of all sets over a step."""
    n, sets = x.shape
    for b in range(sets):
        x[0, b] += c * x[3, b] - s * x[4, b]
        x[1, b] += s * x[3, b] + c * x[4, b]
    for m in range(len(rows)):
        for b in range(sets):
            x[rows[m], b] += factors[m] * dt * x[columns[m], b]
    for i in range(3, n):
        if keep[i] != 1.0:
            for b in range(sets):
                x[i, b] *= keep[i]


@array_kernel
def _add(out: Floats, h: Floats, x: Floats) -> None:
    """Take what the states predict off a measurement's residuals."""
    for i in range(len(h)):
        if h[i] != 0.0:
            for b in range(len(out)):
                out[b] -= h[i] * x[i, b]
