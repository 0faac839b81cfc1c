"""Faults so gross that nothing else can be measured beside them: units, signs, clocks far apart.

Each is told by two signals of the same motion: how much alike they are, how large one is against
the other, and how late. What is found can be undone; see `corrected.py`.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from scm.arrays import Floats
from scm.data_quality.clock_offsets import STEP_S, WIDTH_S, Lag, lag_between, size_where
from scm.data_quality.pose_track import Series, Track, between_gaps_s, grid, inside, long_gaps
from scm.data_quality.problem import Span
from scm.recording.units import G

DEGREES = math.degrees(1.0)
SHIFTED = {10.0**k: "a shifted decimal point" for k in (-3, -2, -1, 1, 2, 3)}
FACTORS: Mapping[str, Mapping[float, str]] = {
    "angular speed": {
        **SHIFTED, DEGREES: "deg/s", 1.0 / DEGREES: "rad/s labelled deg/s",
        1e2 * DEGREES: "hundredths of deg/s", 1e3 * DEGREES: "mdeg/s", 1e3: "mrad/s",
        60.0 / math.tau: "rpm", math.tau / 60.0: "rad/s labelled rpm",
    },
    "speed": {
        **SHIFTED, 3.6: "km/h", 1.0 / 3.6: "m/s labelled km/h", 1e3: "mm/s",
        1e-3: "m/s labelled mm/s", 1e2: "cm/s", 1e-2: "m/s labelled cm/s",
        1.0 / 0.44704: "mph", 0.44704: "m/s labelled mph",
        2.0: "twice the counts a turn", 4.0: "four times the counts a turn",
        0.5: "half the counts a turn", 0.25: "a quarter of the counts a turn",
    },
    "acceleration": {
        1.0 / G: "g", G: "m/s^2 labelled g", 1e3 / G: "mg", 1e3: "mm/s^2",
        1e-3: "m/s^2 labelled mm/s^2", 1e2: "cm/s^2", 1e-2: "m/s^2 labelled cm/s^2",
    },
}  # fmt: skip
MAX_LOG_DISTANCE = 0.08  # of a size from the factor of a unit that explains it
MIN_OVERLAP_S = 4.0  # of two signals that are compared
MAX_POINTS = 20_000  # of a comparison: slower steps show a long drive as well
RELATED = 0.6
LEVEL, BETTER = 0.95, 0.05  # wheels that spin follow the car that badly
UNLIKE = 0.35
MIN_CLOCK_OFFSET_S = 0.2  # less may be a latency
MAX_UNKNOWN_FACTOR = (
    1500.0  # a factor that is no unit's: beyond milli-units one signal hardly moves
)
SMALLEST_SIZE, LARGEST_SIZE = 0.6, 1.0 / 0.6


@dataclass(frozen=True, slots=True)
class Pair:
    """Two signals of one motion, compared.

    Attributes:
        first, second: Their channels; the first is the pose's wherever it takes part.
        what: `angular speed`, `speed`, `acceleration`.
        lag: Of the first behind the second, its size over the second's.
        shift_s: Added to the second's stamps so that both could be laid side by side at all.
    """

    first: tuple[str, ...]
    second: tuple[str, ...]
    what: str
    lag: Lag
    shift_s: float = 0.0

    @property
    def is_related(self) -> bool:
        """Return whether both show the same motion."""
        return abs(self.lag.correlation) > RELATED

    @property
    def factor(self) -> float:
        """By how much the second is too large, signed; 1 where a mere scale fault explains it."""
        size = 1.0 / self.lag.size if self.lag.size else 1.0
        if SMALLEST_SIZE < size < LARGEST_SIZE:
            return 1.0
        found = nearest_factor(size, self.what)
        believable = (
            unit_of(found, self.what) or 1.0 / MAX_UNKNOWN_FACTOR < abs(size) < MAX_UNKNOWN_FACTOR
        )
        return found if believable else math.copysign(1.0, size)

    @property
    def far_s(self) -> float:
        """How far the first's clock is ahead [s]; 0 where a latency, or slip, may explain it."""
        least, gain = (LEVEL, BETTER) if self.what == "speed" else (RELATED, 0.0)
        certain = self.lag.sure and abs(self.lag.correlation) >= least
        if not self.shift_s and not (certain and self.lag.gain > gain):
            return 0.0
        total = self.lag.delay_s + self.shift_s
        return total if abs(total) > MIN_CLOCK_OFFSET_S else 0.0


@dataclass(frozen=True, slots=True)
class MotionSignal:
    """One signal of the car's motion: its channels, and what it shows."""

    channels: tuple[str, ...]
    what: str
    signal: Series
    order: int = field(default=0)


def compare(first: MotionSignal, second: MotionSignal, clipped: Sequence[Span] = ()) -> Pair | None:
    """Hold two signals of one motion against each other; None where either hardly moves.

    Args:
        first: One signal, the pose's wherever it takes part.
        second: The other.
        clipped: Spans in which the second was at the end of its range: its size is taken outside.
    """
    a, b, shift = first.signal, second.signal, 0.0
    overlap = min(a.t[-1], b.t[-1]) - max(a.t[0], b.t[0])
    if overlap < 0.5 * min(np.ptp(a.t), np.ptp(b.t)):
        shift = float(a.t[0] - b.t[0])
        b = Series(b.t + shift, b.values)
        overlap = min(a.t[-1], b.t[-1]) - max(a.t[0], b.t[0])
    if overlap < MIN_OVERLAP_S:
        return None
    start = max(a.t[0], b.t[0])
    gaps = long_gaps(a.t, b.t)
    end = start + overlap
    length_s = between_gaps_s(start, end, gaps) if gaps else overlap
    step = max(STEP_S, length_s / MAX_POINTS)
    on = grid(start, end, step, max(WIDTH_S, 2.0 * step), gaps)
    if len(on.t) * step < MIN_OVERLAP_S:
        return None
    left, right = on.smooth(a, first.order), on.smooth(b, second.order)
    if left.std() < 1e-9 or right.std() < 1e-9:
        return None
    lag = lag_between(left, right, on)
    if clipped:
        known = ~inside(on.t - shift, [(a - WIDTH_S, b + WIDTH_S) for a, b in clipped])
        lag = replace(lag, size=size_where(left, right, lag, known, on.step_s))
    return Pair(first.channels, second.channels, first.what, lag, shift)


def nearest_factor(size: float, what: str) -> float:
    """Return the unit's factor that explains a size, or the size itself where none does."""
    known = (1.0, *FACTORS[what])
    best = min(known, key=lambda f: abs(math.log(abs(size) / f)))
    exact = best if abs(math.log(abs(size) / best)) < MAX_LOG_DISTANCE else abs(size)
    return math.copysign(exact, size)


def unit_of(factor: float, what: str) -> str:
    """Return what a factor means, such as `deg/s`; empty where it is no unit's."""
    return FACTORS[what].get(abs(factor), "")


def heading_fault(poses: Track, raw: Floats) -> float:
    """Return the factor by which a pose's yaw is wrong against its own direction of travel.

    57.3 where degrees were taken for radians, -1 where it turns the other way, 1 where it is right
    or cannot be told.

    Args:
        poses: With positions that can be trusted.
        raw: Yaw as it was recorded, at the poses' stamps.
    """
    step_s, width_s = max(STEP_S, 0.5 * poses.period_s), max(0.1, 1.5 * poses.period_s)
    on = grid(poses.t[0], poses.t[-1], step_s, width_s, long_gaps(poses.t))
    if len(on.t) == 0:
        return 1.0
    vx, vy = (on.smooth(Series(poses.t, v), 1) for v in (poses.x, poses.y))
    at = np.clip(
        np.rint(np.interp(poses.t, on.t, np.arange(len(on.t)))).astype(int), 0, len(on.t) - 1
    )
    vx, vy = vx[at], vy[at]
    weight = np.hypot(vx, vy)
    travel = np.arctan2(vy, vx)
    if abs(np.sum(weight * np.exp(2j * travel))) > 0.9 * weight.sum():
        return 1.0
    fits = {
        factor: abs(np.sum(weight * np.exp(2j * (travel - raw / factor)))) / (weight.sum() + 1e-12)
        for factor in (1.0, -1.0, DEGREES, -DEGREES, 1.0 / DEGREES)
    }
    best = max(fits, key=lambda factor: fits[factor])
    return best if fits[best] > 0.85 and fits[1.0] < 0.6 else 1.0
