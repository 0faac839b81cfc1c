"""A parameter of a physical effect: its meaning, unit, bounds, and where a car file writes it."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Normal:
    """A belief of mean and standard deviation, both in the parameter's unit."""

    mean: float
    std: float


@dataclass(frozen=True, slots=True)
class LogNormal:
    """A belief about a positive quantity: median in its unit, `sigma` of its logarithm."""

    median: float
    sigma: float


@dataclass(frozen=True, slots=True)
class Param:
    """One number that an effect reads.

    Attributes:
        name: The law's argument name, without the unit.
        default: Taken where a car file is silent, in `unit`.
        unit: SI, as `N*m*s`; "1" where there is none.
        key: `section.key` in a car file; two effects with the same key share the number.
        bounds: Lowest and highest value that makes physical sense.
        prior: What is believed before any recording; None leaves only the bounds.
        fit: False for numbers of the method, which no recording may move.
        required: A car file without this key is refused.
        about: The meaning in a few words.
        report: Its public name, with the unit, in reports; empty where that is `name`.
    """

    name: str
    default: float
    unit: str
    key: str
    bounds: tuple[float, float]
    about: str
    prior: Normal | LogNormal | None = None
    fit: bool = True
    required: bool = False
    report: str = ""

    @property
    def reported(self) -> str:
        """The name that reports and results use."""
        return self.report or self.name
