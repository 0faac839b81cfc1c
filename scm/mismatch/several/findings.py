"""What several cars show together: the contract between their comparison and its page."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from scm.mismatch.findings import Estimate


class Cause(StrEnum):
    """What several cars may have in common."""

    CAMERA = "camera"
    TAGS = "tags"
    FLOOR = "floor"


class Sight(StrEnum):
    """What one car's recordings say of an effect at the value that the others share.

    `SEES`: they are explained better by more than its numbers cost. `ADDS`: by less, yet all cars'
    sum pays. `CANNOT_TELL`: they fit with it and without. `OTHERWISE`: they contradict the value.
    """

    SEES = "sees"
    ADDS = "adds"
    CANNOT_TELL = "cannot tell"
    OTHERWISE = "otherwise"


@dataclass(frozen=True, slots=True, kw_only=True)
class CarSight:
    """How one car sees an effect.

    Attributes:
        alone: Whether its own diagnosis had found the effect.
        gain: Decrease of the objective at the shared value, in squared standard deviations;
            `needed`: what the effect's numbers cost, for nobody searched for them here.
        misses: Squared deviation of the car's own value from that of the others, in standard
            deviations; `parameters` of them would be usual.
        own: What the car's recordings alone say of the effect's numbers.
    """

    car: str
    sight: Sight
    alone: bool
    gain: float
    needed: float
    misses: float
    own: Mapping[str, Estimate]


@dataclass(frozen=True, slots=True, kw_only=True)
class Common:
    """An effect of what cars may share.

    Attributes:
        shared: Whether it is what several cars have in common, and not one's own.
        parameters: That all who see it share, or of the one that sees it.
        said: Of the effect, for a mechanic; `conclusion`: whose it is.
        cars: In the recordings' order.
    """

    name: str
    cause: Cause
    shared: bool
    parameters: Mapping[str, Estimate]
    said: str
    conclusion: str
    cars: tuple[CarSight, ...]
