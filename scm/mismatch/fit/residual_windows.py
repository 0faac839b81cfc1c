"""Residual windows: what a car with given numbers misses in each second of a recording.

Where a simulator lacks many things at once, no noise model can separate their shapes from slow
disturbances: it would absorb them. Then what counts is how far each second's drive strays, along
the body, across it and in heading, and what every other sensor shows in that second. How far is
usual for each sensor is fitted too.

A window starts on the measured pose; the car's own motion, its wheels and actuators are those of
one drive through the whole recording. All of it is linear in the residuals, as in `whiten`.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from scm.arrays import Floats, Ints
from scm.mismatch.fit.data_split import blocks
from scm.mismatch.fit.fitter import TAIL
from scm.mismatch.fit.likelihood import TRANSIENT_S, Likelihood
from scm.mismatch.fit.noise import Noise, usual_noise
from scm.mismatch.fit.whitening import Whitener
from scm.replay.drive import Drive

LENGTH_S, SHORT_S = 1.0, 0.5  # of a window, and where all drives are shorter than ten
OVERLAP = 2  # windows begin so many times within one's length
MAX_TRANSIENT_SHARE = 0.1  # of a drive that is shorter than ten seconds
ROUNDS = 20
_POSES = ("pose.x", "pose.y", "pose.yaw")


class WindowWhitener:
    """Weighs residuals of one drive, window by window.

    Attributes:
        begin_s: Of each window, (windows,); `streams`: in the order of the values.
        t: Middle of the window of each value, (events,) [s]; `stream`: the number of its stream;
            `pose.x` stands for the way along the body, `pose.y` for that across it.
        log_size: Logarithm of each value's variance, (events,).
    """

    def __init__(
        self, drive: Drive, noise: Noise, cuts: Floats, length_s: float = LENGTH_S
    ) -> None:
        self.drive = drive
        names = drive.names
        self.begin_s = _begins(drive, cuts, length_s)
        self._end = self.begin_s + length_s
        self.streams = (*_POSES, *(n for n in names if n not in _POSES))
        middle, count = self.begin_s + 0.5 * length_s, len(self.begin_s)
        self.t: Floats = np.tile(middle, len(self.streams))
        self.stream: Ints = np.repeat([names.index(n) for n in self.streams], count)
        size = np.array([noise.own[name] for name in self.streams])
        # windows overlap, so each counts for the part that is its own
        self._weight = np.repeat(np.sqrt(1.0 / OVERLAP) / size, count)
        self.log_size: Floats = np.repeat(2.0 * np.log(size), count) / OVERLAP
        x, y, psi = (drive.smoothed[name] for name in _POSES)
        self._cos, self._sin = np.cos(psi.at(middle)), np.sin(psi.at(middle))
        yaw_t = drive.stream("pose.yaw").t
        self._aside = np.stack((-y.at(yaw_t), x.at(yaw_t)))

    def innovations(self, residuals: Sequence[Floats]) -> Floats:
        """Return unit misses, (events, sets), of measured minus predicted of each stream."""
        return np.asarray(self.misses(residuals) * self._weight[:, None])

    def misses(self, residuals: Sequence[Floats]) -> Floats:
        """Return misses in their own units, (events, sets); rates as means over a window."""
        left = dict(zip(self.drive.names, residuals, strict=True))
        along_x, along_y, turn = self._poses(left)
        found = [
            self._cos[:, None] * along_x + self._sin[:, None] * along_y,
            self._cos[:, None] * along_y - self._sin[:, None] * along_x,
            turn,
        ]
        found += [self._sensor(name, left[name]) for name in self.streams[len(_POSES) :]]
        return np.concatenate(found, axis=0)

    def _poses(self, left: dict[str, Floats]) -> tuple[Floats, Floats, Floats]:
        """Return what windows miss along x and y, a wrong heading's way included, and in turn."""
        x, y, yaw = (self._grown(name, left[name]) for name in _POSES)
        t, r = self.drive.stream("pose.yaw").t, left["pose.yaw"]
        first = _at(t, r, self.begin_s)
        ways = []
        for aside in self._aside:
            steps = 0.5 * (r[1:] + r[:-1]) * np.diff(aside)[:, None]
            way = np.concatenate((np.zeros((1, r.shape[1])), np.cumsum(steps, axis=0)))
            moved = np.interp(self._end, t, aside) - np.interp(self.begin_s, t, aside)
            ways.append(_at(t, way, self._end) - _at(t, way, self.begin_s) - first * moved[:, None])
        return x + ways[0], y + ways[1], yaw

    def _grown(self, name: str, left: Floats) -> Floats:
        t = self.drive.stream(name).t
        return _at(t, left, self._end) - _at(t, left, self.begin_s)

    def _sensor(self, name: str, left: Floats) -> Floats:
        if name.startswith("encoder."):
            return self._grown(name, left)
        t = self.drive.stream(name).t
        total = np.concatenate((np.zeros((1, left.shape[1])), np.cumsum(left, axis=0)))
        first, last = np.searchsorted(t, self.begin_s), np.searchsorted(t, self._end)
        return np.asarray((total[last] - total[first]) / np.maximum(last - first, 1)[:, None])


class WindowedLikelihood(Likelihood):
    """Recordings judged by residual windows; the noise model is how far each sensor strays."""

    def _allowed(self, noise: Noise) -> Noise:
        least = least_sizes(self.drives)
        own = {name: max(noise.own.get(name, 0.0), size) for name, size in least.items()}
        return Noise(noise.speed, noise.side, noise.yaw_rate, own, noise.scale)

    def _whiteners(self, like: Sequence[Whitener]) -> Sequence[Whitener]:
        del like
        return [
            WindowWhitener(drive, self.noise, cuts, length_of(self.drives))  # type: ignore[misc]
            for drive, cuts in zip(self.drives, blocks(self.drives), strict=True)
        ]

    def _valid(self) -> Floats:
        return np.ones(len(self.t))


def least_sizes(drives: Sequence[Drive]) -> dict[str, float]:
    """Return how far a window strays at least, by stream: sensor noise and a car's usual error."""
    usual, drive = usual_noise(drives), drives[0]
    sizes = dict[str, float]()
    for s in drive.streams:
        within = np.sqrt(LENGTH_S / max(float(np.median(np.diff(s.t))), 1e-3))
        grows = s.name.startswith(("pose.", "encoder."))
        noise = 1.4 * s.std if grows else s.std / within
        model = {"pose.x": usual.speed, "pose.y": usual.speed, "pose.yaw": usual.yaw_rate,
                 "imu.gyro_z": usual.yaw_rate, "yaw_rate": usual.yaw_rate}  # fmt: skip
        usually = model.get(s.name, usual.own.get(s.name, usual.speed))
        sizes[s.name] = float(np.hypot(noise, usually))
    return sizes


def fit_sizes(
    model: Likelihood, residuals: Sequence[Sequence[Floats]], rounds: int = ROUNDS
) -> Likelihood:
    """Return the likelihood whose noise model is how far each sensor most likely strays."""
    every = np.concatenate(_by_stream(model, model.weigh(residuals)[:, 0]), axis=0)
    now, names = model.noise, model.drives[0].names
    own = {
        name: now.own[name] * _size(column, max(rounds, ROUNDS)) * np.sqrt(OVERLAP)
        for name, column in zip(names, every.T, strict=True)
    }
    return model.under(Noise(now.speed, now.side, now.yaw_rate, own, now.scale))


def independent_share(model: Likelihood, innovations: Floats) -> float:
    """Return the share of unit misses, (events,), that is independent of the others.

    What a wrong model misses comes together: in several sensors, and window after window.
    """
    clipped = [np.clip(one, -3.0, 3.0) for one in _by_stream(model, innovations)]
    every = np.concatenate(clipped, axis=0)
    together = np.atleast_2d(np.corrcoef(every.T))
    of_streams = len(together) / float((together * together).sum())
    again = sum(float((one[OVERLAP:] * one[:-OVERLAP]).sum()) for one in clipped)
    again = min(max(again / float((every * every).sum()), 0.0), 0.9)
    return of_streams * (1.0 - again) / (1.0 + again)


def _by_stream(model: Likelihood, e: Floats) -> list[Floats]:
    """Return unit misses of each drive by window and stream, (windows, streams)."""
    found, at = list[Floats](), 0
    for weigher in model.whiteners:
        mine, streams = e[at : at + len(weigher.t)], range(len(weigher.drive.streams))
        found.append(np.stack([mine[weigher.stream == number] for number in streams], axis=1))
        at += len(mine)
    return found


def _size(misses: Floats, rounds: int) -> float:
    """Return the most likely size of misses whose tail is that of the loss."""
    square = float(np.median(misses * misses)) + 1e-18
    for _ in range(rounds):
        square = float(np.mean(misses * misses / (1.0 + misses * misses / (TAIL * square))))
    return float(np.sqrt(square))


def length_of(drives: Sequence[Drive]) -> float:
    """Return how long windows are."""
    longest = max(float(drive.edges[-1] - drive.edges[0]) for drive in drives)
    return LENGTH_S if longest > TRANSIENT_S / MAX_TRANSIENT_SHARE else SHORT_S


def _begins(drive: Drive, cuts: Floats, length_s: float) -> Floats:
    """Return when windows begin: in one block, with poses, none in a drive's first transient."""
    begins = [np.arange(a, b - length_s + 1e-6, length_s / OVERLAP) for a, b in pairwise(cuts)]
    every, length = np.concatenate(begins), float(drive.edges[-1] - drive.edges[0])
    begun = every >= drive.edges[0] + min(TRANSIENT_S, MAX_TRANSIENT_SHARE * length)
    return np.asarray(every[begun & ~drive.is_blind(every, length_s)])


def _at(t: Floats, values: Floats, when: Floats) -> Floats:
    """Return values (samples, sets) at other times, by straight lines."""
    row = np.clip(np.searchsorted(t, when, side="right") - 1, 0, len(t) - 2)
    share = ((when - t[row]) / (t[row + 1] - t[row]))[:, None]
    return np.asarray(values[row] + share * (values[row + 1] - values[row]))
