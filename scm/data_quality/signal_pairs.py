"""Two signals of one motion, compared: how much alike, how large and how late one is.

The size tells a wrong unit or sign, the delay tells clocks that are far apart: faults so gross that
nothing else can be measured beside them. They are repaired in `repairs`.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from scm.arrays import Bools, Floats
from scm.data_quality.pose_track import (
    FEWEST,
    Grid,
    Series,
    Track,
    between_gaps_s,
    grid,
    inside,
    long_gaps,
)
from scm.data_quality.quality import Span
from scm.recording.units import G

Spectrum = NDArray[np.complex128]

STEP_S = 0.02  # of the even times on which signals are compared
WIDTH_S = 0.12  # of the Gaussian that smooths both signals
WINDOW_S = 15.0  # of each stretch in which a delay is measured for itself
LOCAL_S = 1.5  # around no delay: a peak there is preferred
MAX_DELAY_S = 20.0  # that is looked for
MIN_WINDOW_CORRELATION = 0.6  # of a window whose delay counts
MIN_GAIN = 0.05  # of correlation, by which a far peak beats the one near no delay
SURE_CORRELATION = 0.9  # from which on one window is enough
MAX_SPREAD_S = 0.06  # of the delays of windows that agree
MOST, LARGE = 98, 0.3  # a car may stand for nearly all of a recording
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
class Lag:
    """How one signal follows another.

    Attributes:
        delay_s: Of the first, at the start of what overlaps.
        rate: Seconds by which the delay grows a second.
        correlation: Correlation at best, negative where the sign is turned, -1..1.
        size: First over second, signed.
        sure: Windows all over the drive agree on the delay.
        gain: By how much the correlation is better than without any delay.
    """

    delay_s: float
    rate: float
    correlation: float
    size: float
    sure: bool
    gain: float


def lag_between(first: Floats, second: Floats, on: Grid) -> Lag:
    """Return how the first signal, on even times, lags behind the second on the same ones."""
    first, second = _clipped(first), _clipped(second)
    reach = int(min(MAX_DELAY_S, 0.4 * on.length_s) / on.step_s)
    curve = _correlations(first, second, reach)
    best = _best(curve, reach)
    sign = float(np.sign(curve[best])) or 1.0
    whole = best - reach
    delay, rate = (whole + _between(sign * curve, best)) * on.step_s, 0.0
    gain = float(abs(curve[best]) - abs(curve[reach]))
    a, b = _overlap(first, second, whole)
    windows = _windows(a, sign * b, on.step_s)
    sure = len(windows) < 3 and abs(curve[best]) > SURE_CORRELATION
    if len(windows) >= 3:
        at, late = windows.T
        slopes = [
            (late[j] - late[i]) / (at[j] - at[i])
            for i in range(len(at))
            for j in range(i + 1, len(at))
        ]
        rate = float(np.median(slopes))
        off = late - rate * at
        sure = float(np.median(np.abs(off - np.median(off)))) < MAX_SPREAD_S
        delay = whole * on.step_s + float(np.median(late - rate * at))
    if abs(rate) * on.length_s < 0.05:
        delay, rate = (whole + _between(sign * curve, best)) * on.step_s, 0.0
    a, b = _overlap(first, second, round((delay + rate * 0.5 * on.length_s) / on.step_s))
    return Lag(delay, rate, float(curve[best]), sign * _size(a, sign * b), sure, gain)


def size_where(first: Floats, second: Floats, lag: Lag, known: Bools, step_s: float) -> float:
    """Return how large the first is against the second, signed, while the second is known."""
    steps = round(lag.delay_s / step_s)
    a, b = _overlap(first, second, steps)
    rows = _overlap(first, known.astype(np.float64), steps)[1] > 0.0
    sign = float(np.sign(lag.correlation)) or 1.0
    return sign * _size(a[rows], sign * b[rows]) if rows.sum() > FEWEST else lag.size


def _clipped(values: Floats) -> Floats:
    """Return values without spikes, that one glitch may not outweigh a whole drive."""
    middle = float(np.median(values))
    high = 2.0 * float(np.percentile(np.abs(values - middle), MOST))
    return np.clip(values, middle - high, middle + high)


def _size(first: Floats, second: Floats) -> float:
    """Return how large the first is against the second: the middle of many ratios, both ways."""

    def ratio(over: Floats, under: Floats) -> float:
        usual, most = np.percentile(np.abs(under), (70, MOST))
        large = np.abs(under) >= max(usual, LARGE * most, 1e-30)  # a clipped signal has no more
        return max(float(np.median(over[large] / under[large])), 1e-12) if large.any() else 1e-12

    return float(np.sqrt(ratio(first, second) / ratio(second, first)))


def _best(curve: Floats, reach: int) -> int:
    """Return the strongest peak, but the one next to no delay unless another is clearly better."""
    size = np.abs(curve)
    best, near = int(np.argmax(size)), round(LOCAL_S / STEP_S)
    low, high = max(1, reach - near), min(len(curve) - 1, reach + near + 1)
    middle = size[low:high]
    peaks = np.flatnonzero(
        (middle >= size[low - 1 : high - 1]) & (middle >= size[low + 1 : high + 1])
    )
    if len(peaks) == 0:
        return best
    here = low + int(peaks[np.argmax(middle[peaks])])
    return best if size[best] > size[here] + MIN_GAIN else here


def _correlations(first: Floats, second: Floats, reach: int) -> Floats:
    """Return the correlation for delays of -reach..reach steps, each over what overlaps."""
    n = len(first)
    size = 1 << (2 * n).bit_length()
    a, b = first - first.mean(), second - second.mean()
    one_, a_, b_, a2_, b2_ = (np.fft.rfft(x, size) for x in (np.ones(n), a, b, a * a, b * b))

    def against(x: Spectrum, y: Spectrum) -> Floats:
        product = np.fft.irfft(x * np.conj(y), size)
        return np.concatenate((product[size - reach :], product[: reach + 1]))

    count = against(one_, one_)
    mean_a, mean_b = against(a_, one_) / count, against(one_, b_) / count
    spread_a = against(a2_, one_) / count - mean_a**2
    spread_b = against(one_, b2_) / count - mean_b**2
    joint = against(a_, b_) / count - mean_a * mean_b
    least = 1e-6 * float(np.sqrt((a * a).mean() * (b * b).mean())) + 1e-30
    return joint / np.maximum(np.sqrt(np.maximum(spread_a * spread_b, 0.0)), least)


def _between(curve: Floats, best: int) -> float:
    """Return where the parabola through a peak is highest, in steps from it."""
    if not 0 < best < len(curve) - 1:
        return 0.0
    before, here, after = curve[best - 1 : best + 2]
    bend = before - 2.0 * here + after
    return float(np.clip(0.5 * (before - after) / bend, -0.5, 0.5)) if bend < 0.0 else 0.0


def _overlap(first: Floats, second: Floats, steps: int) -> tuple[Floats, Floats]:
    if steps >= 0:
        return first[steps:], second[: len(second) - steps]
    return first[:steps], second[-steps:]


def _windows(first: Floats, second: Floats, step_s: float) -> Floats:
    """Return rows of (middle of a window, delay in it) for windows that correlate, [s]."""
    length, near = round(WINDOW_S / step_s), round(LOCAL_S / step_s)
    whole = np.array([float(first.std()), float(second.std())])
    found = []
    for start in range(0, len(first) - length + 1, length // 2):
        a, b = first[start : start + length], second[start : start + length]
        if np.any(np.array([a.std(), b.std()]) < 0.3 * whole):
            continue
        curve = _correlations(a, b, near)
        best = int(np.argmax(curve))
        if curve[best] > MIN_WINDOW_CORRELATION and 0 < best < len(curve) - 1:
            late = (best - near + _between(curve, best)) * step_s
            found.append(((start + 0.5 * length) * step_s, late))
    return np.array(found).reshape(-1, 2)


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

    The first is the pose's wherever it takes part. The second's size is taken outside spans in
    which it was `clipped` at the end of its range.
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
    or cannot be known. `raw` is the yaw as it was recorded, at the poses' stamps.
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
