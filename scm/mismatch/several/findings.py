"""What several cars show together: the contract between their comparison and its page."""

from collections.abc import Mapping
from enum import StrEnum

from msgspec import Struct, field

from scm.mismatch.findings import Estimate


class Cause(StrEnum):
    """What several cars may have in common."""

    CAMERA = "camera"
    TAGS = "tags"
    FLOOR = "floor"


class Agreement(StrEnum):
    """What one car's recordings show of an effect at the value that the others share.

    `CONFIRMS`: they are explained better by more than its numbers cost. `SUPPORTS`: by less, yet
    the sum over all cars pays. `UNDECIDED`: they fit with it and without. `CONTRADICTS`: they fit
    another value.
    """

    CONFIRMS = "sees"
    SUPPORTS = "adds"
    UNDECIDED = "cannot tell"
    CONTRADICTS = "otherwise"


class CarAgreement(Struct, kw_only=True, frozen=True):
    """How far one car agrees with an effect.

    Attributes:
        alone: Whether its own diagnosis had found the effect.
        gain: Decrease of the objective at the shared value, in squared standard deviations;
            `needed`: what the effect's numbers cost, for nobody searched for them here.
        misses: Squared deviation of the car's own value from that of the others, in standard
            deviations; the number of parameters would be usual.
        own: The effect's numbers by the car's recordings alone.
    """

    car: str
    agreement: Agreement = field(name="sight")
    alone: bool
    gain: float
    needed: float
    misses: float
    own: Mapping[str, Estimate]


class Common(Struct, kw_only=True, frozen=True):
    """An effect of what cars may share.

    Attributes:
        shared: Whether it is what several cars have in common, and not one's own.
        parameters: That all who confirm it share, or of the one that does.
        text: About the effect, for a mechanic; `conclusion`: whose it is.
        cars: In the recordings' order.
    """

    name: str
    cause: Cause
    shared: bool
    parameters: Mapping[str, Estimate]
    text: str = field(name="said")
    conclusion: str
    cars: tuple[CarAgreement, ...]
