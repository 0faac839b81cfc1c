"""A parameter of a physical effect: its meaning, unit, bounds, and where a car file writes it."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Normal:
    """A normal prior: mean and standard deviation in the parameter's unit."""

    mean: float
    std: float


@dataclass(frozen=True, slots=True)
class LogNormal:
    """A log-normal prior of a positive quantity: median in its unit, `sigma` of its logarithm."""

    median: float
    sigma: float


@dataclass(frozen=True, slots=True)
class Param:
    """One number that an effect reads.

    Attributes:
        name: The function's argument name, without the unit.
        default: Value if a car file has none, in `unit`.
        unit: SI, such as `N*m*s`; "1": none.
        key: `section.key` in a car file; two effects with the same key share the number.
        bounds: Lowest and highest value that makes physical sense.
        prior: Before any recording; None: only the bounds.
        fit: False for numerical constants that are never fitted.
        required: Whether a car file must have this key.
        about: Short meaning.
        report: Its name in reports, with the unit; empty: `name`.
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
