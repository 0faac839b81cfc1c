"""What many cases say: shares of success, means, and which factor matters, with 95 % intervals."""

import math
from collections import defaultdict
from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import NamedTuple, TypeVar

import numpy as np
from scipy.special import fdtrc, stdtrit

from scm.study.design import Design
from scm.study.row import Row
from scm.study.study_file import Value
from scm.study.targets import Axis

CONFIDENCE = 0.95
Z = NormalDist().inv_cdf(0.5 + 0.5 * CONFIDENCE)
BINS = 5  # of a drawn factor, for its effect
SUCCESS = "success"

K = TypeVar("K", bound=Hashable)


class Interval(NamedTuple):
    """An estimate with its 95 % interval, from so many cases."""

    value: float
    low: float
    high: float
    cases: int

    @property
    def half_width(self) -> float:
        """Half of the interval's width."""
        return 0.5 * (self.high - self.low)


@dataclass(frozen=True, slots=True)
class MainEffect:
    """How one factor moves one measure, averaged over all other factors.

    Attributes:
        lowest, highest: Of the measure's means over the factor's levels; `at_lowest` and
            `at_highest` are these levels, in words.
        share: Of the measure's variance that the factor alone explains, 0 to 1.
        p: Probability of so large a share by chance (F test); NaN: too few cases.
    """

    factor: str
    measure: str
    lowest: float
    at_lowest: str
    highest: float
    at_highest: str
    share: float
    p: float


def wilson(successes: int, count: int) -> Interval:
    """Return a share with Wilson's interval (1927): right also near 0 and 1, and for few cases."""
    if count == 0:
        return Interval(math.nan, 0.0, 1.0, 0)
    share, z2 = successes / count, Z * Z
    middle = (share + z2 / (2 * count)) / (1 + z2 / count)
    spread = Z / (1 + z2 / count) * math.sqrt(share * (1 - share) / count + z2 / (4 * count**2))
    return Interval(share, max(0.0, middle - spread), min(1.0, middle + spread), count)


def mean_of(values: Sequence[float]) -> Interval:
    """Return a mean with Student's interval; NaN values do not count."""
    known = np.array([value for value in values if math.isfinite(value)])
    count = len(known)
    if count == 0:
        return Interval(math.nan, math.nan, math.nan, 0)
    mean = float(known.mean())
    if count == 1:
        return Interval(mean, -math.inf, math.inf, 1)
    spread = float(known.std(ddof=1)) / math.sqrt(count)
    half = float(stdtrit(count - 1, 0.5 + 0.5 * CONFIDENCE)) * spread
    return Interval(mean, mean - half, mean + half, count)


def estimate(rows: Sequence[Row], measure: str) -> Interval:
    """Return the mean of a measure, or of `success` the share of all cases."""
    if measure == SUCCESS:
        return wilson(sum(row.outcome == "success" for row in rows), len(rows))
    return mean_of([row.measures[measure] for row in rows if measure in row.measures])


def grouped(rows: Iterable[Row], key: Callable[[Row], K]) -> dict[K, list[Row]]:
    """Return rows by a key, in the order in which keys come."""
    found: dict[K, list[Row]] = defaultdict(list)
    for row in rows:
        found[key(row)].append(row)
    return dict(found)


def by_level(rows: Sequence[Row], axis: Axis) -> dict[str, list[Row]]:
    """Return rows by the level of a factor, in words; of a drawn one by fifths of its draws."""
    if not axis.factor.is_drawn:
        groups = grouped(rows, lambda row: row.values[axis.path])
        if all(isinstance(level, int | float) for level in groups):
            groups = dict(sorted(groups.items(), key=lambda item: float(item[0])))
        return {level_text(level): group for level, group in groups.items()}
    draws = np.array([float(row.values[axis.path]) for row in rows])
    if not len(draws):
        return {}
    edges = np.unique(np.quantile(draws, np.linspace(0.0, 1.0, BINS + 1)))
    bins = np.clip(np.searchsorted(edges, draws, side="right") - 1, 0, max(0, len(edges) - 2))
    found = {}
    for number in range(max(1, len(edges) - 1)):
        inside = [row for row, own in zip(rows, bins, strict=True) if own == number]
        if inside:
            ends = edges[number], edges[min(number + 1, len(edges) - 1)]
            found[f"{ends[0]:.4g} to {ends[1]:.4g}"] = inside
    return found


def level_text(level: Value) -> str:
    """Return a factor's value as people read it."""
    return f"{level:.6g}" if isinstance(level, float) else str(level)


def half_width(rows: Sequence[Row], measure: str, design: Design) -> float:
    """Return the half width of a measure's interval in that combination where it is widest."""
    factorial = [axis.path for axis in design.factorial]
    groups = grouped(rows, lambda row: tuple(row.values[path] for path in factorial))
    return max((estimate(group, measure).half_width for group in groups.values()), default=math.inf)


def is_known(width: float, wanted: float) -> bool:
    """Return whether an interval is narrow enough; an unknown width never is."""
    return math.isfinite(width) and width <= wanted


def main_effects(rows: Sequence[Row], axes: Sequence[Axis], measure: str) -> list[MainEffect]:
    """Return how each factor with several levels moves a measure, the strongest first."""
    found = []
    for axis in axes:
        groups = {
            level: [value for row in group if math.isfinite(value := _value(row, measure))]
            for level, group in by_level(rows, axis).items()
        }
        groups = {level: values for level, values in groups.items() if values}
        if len(groups) < 2 or len({value for values in groups.values() for value in values}) < 2:
            continue
        means = {level: float(np.mean(values)) for level, values in groups.items()}
        low, high = min(means, key=means.__getitem__), max(means, key=means.__getitem__)
        share, p = _explained([np.array(values) for values in groups.values()])
        found.append(MainEffect(axis.path, measure, means[low], low, means[high], high, share, p))
    return sorted(found, key=lambda effect: -effect.share)


def _value(row: Row, measure: str) -> float:
    if measure == SUCCESS:
        return float(row.outcome == "success")
    return row.measures.get(measure, math.nan)


def _explained(groups: Sequence[np.ndarray]) -> tuple[float, float]:
    """Return the share of variance between groups, and its p value by the F test."""
    values = np.concatenate(groups)
    total = float(((values - values.mean()) ** 2).sum())
    between = sum(len(group) * float(group.mean() - values.mean()) ** 2 for group in groups)
    more, rest = len(groups) - 1, len(values) - len(groups)
    if total <= 0.0:
        return 0.0, math.nan
    share = min(1.0, between / total)
    if rest <= 0 or share >= 1.0:
        return share, math.nan
    return share, float(fdtrc(more, rest, share / more / ((1.0 - share) / rest)))
