"""The cases of a study: by number, the value of each factor and the seed.

Case numbers count through all combinations of one replication before the next: whatever part of a
study has run, all combinations are equally far.
"""

import hashlib
import inspect
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from statistics import NormalDist
from typing import cast

import numpy as np

from scm.arrays import Floats
from scm.errors import StudyError
from scm.study.study_file import MAX_CASES, Sampling, Study, StudyFile, Value
from scm.study.targets import Axis, Setting, axes_of

INNERMOST = 1e-15  # a normal distribution has no share 0 and 1


@dataclass(frozen=True, slots=True)
class Design:
    """All cases of a study.

    Attributes:
        factorial: The factors of which each value is used.
        drawn: Those whose values are drawn.
    """

    name: str
    study: Study
    axes: tuple[Axis, ...]

    @property
    def factorial(self) -> list[Axis]:
        """The factors of which each value is used."""
        return [axis for axis in self.axes if not axis.factor.is_drawn]

    @property
    def drawn(self) -> list[Axis]:
        """The factors whose values are drawn."""
        return [axis for axis in self.axes if axis.factor.is_drawn]

    @property
    def points(self) -> int:
        """Cases of one replication."""
        combinations = math.prod(len(axis.factor.levels) for axis in self.factorial)
        return combinations * (self.study.samples if self.drawn else 1)

    def __len__(self) -> int:
        """Return the number of cases."""
        return self.points * self.study.replications

    def replication(self, number: int) -> int:
        """Return which replication a case is of."""
        return number // self.points

    def seed(self, number: int) -> int:
        """Return the seed of a case: of its number, or of its replication if cases are paired."""
        of = f"replication {self.replication(number)}" if self.study.paired else str(number)
        return hashed(f"{self.study.seed}/{self.name}/{of}")

    def values(self, number: int) -> dict[str, Value]:
        """Return the value of each factor in a case."""
        point = number % self.points
        samples = self.study.samples if self.drawn else 1
        combination, sample = divmod(point, samples)
        found: dict[str, Value] = {}
        for axis in reversed(self.factorial):
            levels = axis.factor.levels
            combination, level = divmod(combination, len(levels))
            found[axis.path] = levels[level]
        if self.drawn:
            draws = f"{self.study.seed}/{self.name}/draws {self.replication(number)}"
            shares = _shares(self.study.sampling, samples, len(self.drawn), draws)
            for axis, share in zip(self.drawn, shares[sample].tolist(), strict=True):
                found[axis.path] = value_at(axis, share)
        return {axis.path: found[axis.path] for axis in self.axes}

    def setting(self, values: Mapping[str, Value], base: Setting) -> Setting:
        """Return the setting of a case.

        Raises:
            StudyError: when the values do not fit.
        """
        for axis in self.axes:
            base = axis.put(base, values[axis.path])
        return base


def design_of(
    file: StudyFile, base: Setting, parameters: Mapping[str, inspect.Parameter]
) -> Design:
    """Return the cases of a study file.

    Raises:
        StudyError: naming everything wrong with its factors.
    """
    try:
        axes = axes_of(file.factors, base, parameters)
    except StudyError as cause:
        lines = (f"{file.folder / file.name}.toml: {line}" for line in str(cause).splitlines())
        raise StudyError("\n".join(lines)) from None
    design = Design(file.name, file.study, tuple(axes))
    if len(design) > MAX_CASES:
        msg = f"{file.name}: {len(design)} cases, expected at most {MAX_CASES}"
        raise StudyError(msg)
    return design


def hashed(text: str) -> int:
    """Return 48 bits that belong to a text: whole in JSON, Parquet and every language."""
    digest = hashlib.blake2s(text.encode(), digest_size=6).digest()
    return int.from_bytes(digest, "big")


def value_at(axis: Axis, share: float) -> float:
    """Return the value of a drawn factor below which a share (0 to 1) of its draws are."""
    factor = axis.factor
    if factor.uniform is not None:
        low, high = factor.uniform
        return low + (high - low) * share
    if factor.log_uniform is not None:
        low, high = map(math.log, factor.log_uniform)
        return math.exp(low + (high - low) * share)
    mean, std = spread_of(axis)
    low, high = limits_of(axis)
    normal = NormalDist(mean, std)
    below, above = normal.cdf(low), normal.cdf(high)
    within = min(max(below + (above - below) * share, INNERMOST), 1.0 - INNERMOST)
    return min(max(normal.inv_cdf(within), low), high)


def spread_of(axis: Axis) -> tuple[float, float]:
    """Return mean and standard deviation of a factor that is drawn from a normal distribution."""
    factor, target = axis.factor, axis.targets[0]
    if factor.normal is not None:
        return factor.normal
    scale = (factor.std or 1.0) * (target.std or 0.0)
    if factor.apply == "set":
        return cast("float", target.nominal), scale
    return (0.0, scale) if factor.apply == "add" else (1.0, scale / cast("float", target.nominal))


def limits_of(axis: Axis) -> tuple[float, float]:
    """Return the lowest and highest draw that every target of a factor allows."""
    lows, highs = list[float](), list[float]()
    for target in axis.targets:
        low, high = target.bounds
        if axis.factor.apply == "add" and target.nominal is not None:
            low, high = low - cast("float", target.nominal), high - cast("float", target.nominal)
        elif axis.factor.apply == "scale" and target.nominal:
            ends = low / cast("float", target.nominal), high / cast("float", target.nominal)
            low, high = min(ends), max(ends)
        lows.append(low)
        highs.append(high)
    return max(lows), min(highs)


@lru_cache(maxsize=8)
def _shares(sampling: Sampling, samples: int, factors: int, draws: str) -> Floats:
    """Return the draws of one replication, (samples, factors), each from 0 to 1.

    `draws` names them: equal names, equal draws.
    """
    rng = np.random.default_rng(hashed(draws))
    if sampling == "random":
        return rng.random((samples, factors))
    from scipy.stats import qmc  # noqa: PLC0415  a second, at the start of each case process

    if sampling == "latin_hypercube":
        shares: Floats = qmc.LatinHypercube(factors, rng=rng).random(samples)
    else:
        shares = qmc.Sobol(factors, rng=rng).random(samples)
    return shares
