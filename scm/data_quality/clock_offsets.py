"""How late one signal is against another, by correlation: all at once, and window by window."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scm.arrays import Bools, Floats
from scm.data_quality.pose_track import FEWEST, Grid

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
