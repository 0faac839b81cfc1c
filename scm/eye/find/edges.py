"""Locates the sides of a tag, to hundredths of a pixel, from their predicted places.

In three passes. The whole tag is shifted to where its four sides show the strongest step from black
to white. Each side is then fitted to the steepest places along it. Finally its offset is computed
from the mean grey between the centres of the border and of the margin:

    e = 2 h (mid - mean) / (white - black)      mean: of the grey over [-h, h] along the normal

This is exact for any symmetric blur, of a lens, of pixels or of motion.
"""

import math

from scm.arrays import Floats, Image
from scm.eye.find.lines import cell_px, look_across, move_sides
from scm.vehicles.jit import array_kernel

SAMPLES = 24
"""Sample positions along each side."""
MAX_PROFILE = 96
"""Maximum number of grey values along a normal."""
WORK_ROWS = 8
"""Rows of the work array."""

_SPAN = 0.80
"""Share of a side that is sampled; its ends belong to the corners."""
_SQUEEZE = 2
"""Maximum relative shift of opposite sides in the first pass [px]."""
_FINE_STEPS = 8  # of the step that refines an edge
_MIN_INLIERS = 0.6  # share of the samples on one line
_MIN_STEP = 4.0  # grey levels between the two sides of an edge
_NO_EDGE = 1.0e3  # offset of a sample without an edge


@array_kernel
def shift_whole(grey: Image, quad: Floats, work: Floats, lines: Floats, ends: Floats) -> bool:
    """Shift a tag to where its sides show the strongest outward steps.

    Its corners are changed in place; `work` (WORK_ROWS, MAX_PROFILE), `lines` (4, 3) and `ends`
    (4, 2) are work arrays.
    """
    cell = cell_px(quad)
    reach = int(min(max(5.0, 1.75 * cell), (MAX_PROFILE - 1) // 2 - 1))
    count = 2 * reach + 1
    wide = max(1, int(0.3 * cell))
    for side in range(4):
        _mean_profile(grey, quad, side, float(reach), work[side, :count], work[4, :count])
        _steps(work[side, :count], work[4, :count], wide)
    for one in range(2):
        other = one + 2
        _best_shift(work[one, :count], work[other, :count], ends[one], ends[other])
    return move_sides(quad, ends, lines)


@array_kernel
def _mean_profile(
    grey: Image, quad: Floats, side: int, reach: float, out: Floats, one: Floats
) -> None:
    for m in range(len(out)):
        out[m] = 0.0
    for k in range(8):
        look_across(grey, quad, side, 0.5 + _SPAN * (k - 3.5) / 8.0, reach, one)
        for m in range(len(out)):
            out[m] += one[m] / 8.0


@array_kernel
def _steps(profile: Floats, spare: Floats, wide: int) -> None:
    """Convert a profile to its step: how much lighter it is outside of each place than inside."""
    count = len(profile)
    for m in range(count):
        spare[m] = profile[m]
    for m in range(count):
        total = 0.0
        for d in range(1, wide + 1):
            total += spare[min(m + d, count - 1)] - spare[max(m - d, 0)]
        profile[m] = total / wide


@array_kernel
def _best_shift(one: Floats, other: Floats, here: Floats, there: Floats) -> None:
    """Write the offsets of two opposite sides with the strongest combined step."""
    reach = (len(one) - 1) // 2
    best = -1.0e9
    for shift in range(-reach, reach + 1):
        for squeeze in range(-_SQUEEZE, _SQUEEZE + 1):
            a, b = shift + squeeze, -shift + squeeze
            if abs(a) <= reach and abs(b) <= reach:
                score = one[a + reach] + other[b + reach]
                if score > best:
                    best = score
                    here[0], here[1] = float(a), float(a)
                    there[0], there[1] = float(b), float(b)


@array_kernel
def lay_coarse(
    grey: Image, quad: Floats, window: float, work: Floats, lines: Floats, ends: Floats
) -> bool:
    """Fit each side to the steepest places within `window` cells of its place."""
    cell = cell_px(quad)
    reach = min(max(2.0, window * cell), 40.0)
    count = 2 * math.ceil(reach) + 1
    wide = max(1, int(0.35 * cell))
    profile, steps, at, offset = (
        work[0, :count],
        work[1, :count],
        work[2, :SAMPLES],
        work[3, :SAMPLES],
    )
    for side in range(4):
        for k in range(SAMPLES):
            at[k] = 0.5 + _SPAN * ((k + 0.5) / SAMPLES - 0.5)
            look_across(grey, quad, side, at[k], reach, profile)
            for m in range(count):
                steps[m] = profile[m]
            _steps(steps, profile, wide)
            offset[k] = _steepest(steps) * 2.0 * reach / (count - 1) - reach
        if not _agreed_line(at, offset, max(0.7, 0.15 * cell), ends[side]):
            return False
    return move_sides(quad, ends, lines)


@array_kernel
def _steepest(steps: Floats) -> float:
    """Return the place of the largest value, interpolated by a parabola."""
    best = 0
    for m in range(len(steps)):
        if steps[m] > steps[best]:
            best = m
    if best == 0 or best == len(steps) - 1:
        return float(best)
    before, after = steps[best - 1], steps[best + 1]
    bend = 2.0 * steps[best] - before - after
    return best + (0.5 * (after - before) / bend if bend > 0.0 else 0.0)


@array_kernel
def _agreed_line(at: Floats, offset: Floats, near: float, ends: Floats) -> bool:
    """Write the end offsets of the line that most places agree on."""
    half = len(at) // 2
    most, a, b = 0, 0.0, 0.0
    for k in range(half):
        slope = (offset[k + half] - offset[k]) / (at[k + half] - at[k])
        level = offset[k] - slope * at[k]
        agree = 0
        for m in range(len(at)):
            if abs(offset[m] - level - slope * at[m]) <= near:
                agree += 1
        if agree > most:
            most, a, b = agree, level, slope
    if most < 0.4 * len(at):
        return False
    n, st, so, stt, sto = 0.0, 0.0, 0.0, 0.0, 0.0
    for m in range(len(at)):
        if abs(offset[m] - a - b * at[m]) <= near:
            n += 1.0
            st += at[m]
            so += offset[m]
            stt += at[m] * at[m]
            sto += at[m] * offset[m]
    spread = n * stt - st * st
    if spread > 1e-9:
        b = (n * sto - st * so) / spread
        a = (so - b * st) / n
    ends[0], ends[1] = a, a + b
    return True


@array_kernel
def lay_fine(grey: Image, quad: Floats, work: Floats, lines: Floats, ends: Floats) -> bool:
    """Fit each side by the mean grey across it.

    Returns:
        Whether most of each side agrees on one line.
    """
    cell = cell_px(quad)
    h = min(max(1.5, 0.5 * cell), 6.0)
    at, low, high, mean = work[0, :SAMPLES], work[1, :SAMPLES], work[2, :SAMPLES], work[3, :SAMPLES]
    offset, weight, spare = work[4, :SAMPLES], work[5, :SAMPLES], work[6, :SAMPLES]
    profile = work[7, : 2 * _FINE_STEPS + 1]
    for side in range(4):
        for k in range(SAMPLES):
            at[k] = 0.5 + _SPAN * ((k + 0.5) / SAMPLES - 0.5)
            look_across(grey, quad, side, at[k], h, profile)
            low[k], high[k] = profile[0], profile[2 * _FINE_STEPS]
            total = 0.5 * (low[k] + high[k])
            for m in range(1, 2 * _FINE_STEPS):
                total += profile[m]
            mean[k] = total / (2 * _FINE_STEPS)
        _areas(low, high, mean, h, offset)
        if not _robust_line(at, offset, weight, spare, ends[side]):
            return False
    return move_sides(quad, ends, lines)


@array_kernel
def _areas(low: Floats, high: Floats, mean: Floats, h: float, offset: Floats) -> None:
    """Write each place's offset; black and white are means of it and its four neighbours."""
    count = len(low)
    for k in range(count):
        first, last = max(0, k - 2), min(count, k + 3)
        black, white = 0.0, 0.0
        for m in range(first, last):
            black += low[m] / (last - first)
            white += high[m] / (last - first)
        step = white - black
        if step > _MIN_STEP:
            moved = 2.0 * h * (0.5 * (black + white) - mean[k]) / step
            offset[k] = min(max(moved, -h), h)
        else:
            offset[k] = _NO_EDGE


@array_kernel
def _robust_line(at: Floats, offset: Floats, weight: Floats, away: Floats, ends: Floats) -> bool:
    """Write the end offsets of a robust line fit (Tukey's weights)."""
    count = len(at)
    level, slope = _median(offset, away), 0.0
    for _ in range(4):
        for k in range(count):
            weight[k] = abs(offset[k] - level - slope * at[k])
        scale = 4.0 * max(0.12, 1.4826 * _median(weight, away))
        n, st, so, stt, sto, close = 0.0, 0.0, 0.0, 0.0, 0.0, 0
        for k in range(count):
            u = weight[k] / scale
            w = (1.0 - u * u) ** 2 if u < 1.0 else 0.0
            close += 1 if u < 1.0 else 0
            n += w
            st += w * at[k]
            so += w * offset[k]
            stt += w * at[k] * at[k]
            sto += w * at[k] * offset[k]
        spread = n * stt - st * st
        if close < _MIN_INLIERS * count or not spread > 1e-9:
            return False
        slope = (n * sto - st * so) / spread
        level = (so - slope * st) / n
    ends[0], ends[1] = level, level + slope
    return True


@array_kernel
def _median(values: Floats, spare: Floats) -> float:
    """Return the median, by sorting a copy."""
    for k in range(len(values)):
        value, m = values[k], k
        while m > 0 and spare[m - 1] > value:
            spare[m] = spare[m - 1]
            m -= 1
        spare[m] = value
    return float(spare[len(values) // 2])
