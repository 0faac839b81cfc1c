"""What several cars show together: the contract between their comparison and its page."""

from collections.abc import Mapping, Sequence
from enum import StrEnum
from typing import NamedTuple

from msgspec import Struct, field

from scm.mismatch.findings import Estimate
from scm.mismatch.report.wording import capital, joined


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


class Wording(NamedTuple):
    """What is written of a cause: whose an effect is if it is shared, if it is not, and if unsure.

    Attributes:
        verb: What cars do with it; `alike`: how several of them do.
    """

    whose: str
    own: str
    unsure: str
    alike: str
    verb: str


WORDING: Mapping[Cause, Wording] = {
    Cause.CAMERA: Wording(
        "it is the camera, not the cars",
        "it is that car's own (its tag, its mounting, its clock), not the camera",
        "whether it is the camera or that car's own", "seen by the same camera", "see",
    ),
    Cause.TAGS: Wording(
        "the tags sit alike on all of them, or the description's point is wrong; or the camera is "
        "off by as much",
        "it is that car's own tag or its mounting, not the camera",
        "whether it is that car's tag or the camera", "seen alike by the same camera", "see",
    ),
    Cause.FLOOR: Wording(
        "it is the floor, or what acts on all cars there", "it is that car's own, not the floor",
        "whether it is the floor or that car's own", "on the same floor", "feel",
    ),
}  # fmt: skip


def conclusion(cause: Cause, cars: Sequence[CarAgreement], *, shared: bool) -> str:
    """Return whose an effect is, as the cars together say."""
    seeing = [c.car for c in cars if c.agreement in (Agreement.CONFIRMS, Agreement.SUPPORTS)]
    against = [c.car for c in cars if c.agreement is Agreement.CONTRADICTS]
    silent = [c.car for c in cars if c.agreement is Agreement.UNDECIDED]
    words = WORDING[cause]
    if not shared:
        return _of_one(cause, cars, against, silent)
    if against:
        by_others = [c.car for c in cars if c.car in against and c.alone]
        none = [name for name in against if name not in by_others]
        also = [f"{joined(none)} {_would(none)}"] if none else []
        also += [f"{joined(by_others)} by another amount"] if by_others else []
        return (
            f"{joined(seeing)} {words.verb} it alike, {joined(also)}: it is something that only "
            f"{joined(seeing)} have in common."
        )
    if silent:
        return (
            f"{joined(seeing)} {words.verb} it alike: {words.whose}. {capital(_drives_of(silent))} "
            f"cannot tell, and {'do' if len(silent) > 1 else 'does'} not contradict."
        )
    every = "both cars" if len(cars) == 2 else f"all {len(cars)} cars"
    if any(c.agreement is Agreement.SUPPORTS for c in cars):
        return f"Too weak for one car alone, {every} together show it: {words.whose}."
    return f"{capital(every)} {words.verb} it alike: {words.whose}."


def _of_one(
    cause: Cause, cars: Sequence[CarAgreement], against: Sequence[str], silent: Sequence[str]
) -> str:
    finders = [c.car for c in cars if c.alone]
    words = WORDING[cause]
    if len(finders) > 1:
        return (
            f"{joined(finders)} {words.verb} it each by another amount: it is each car's own, "
            "nothing that they have in common."
        )
    who = joined(finders) or "one car"
    others = [name for name in against if name not in finders]
    if others:
        return f"Only {who} {words.verb}s it, {joined(others)} {_would(others)}: {words.own}."
    unsure = [name for name in silent if name not in finders]
    return f"Only {who} {words.verb}s it; {_drives_of(unsure)} cannot tell {words.unsure}."


def _drives_of(names: Sequence[str]) -> str:
    return ("the drives of " if len(names) > 1 else "the drive of ") + joined(names)


def _would(names: Sequence[str]) -> str:
    return "would have to and " + ("do not" if len(names) > 1 else "does not")


def all_alike(common: Common, name: str) -> str:
    """Return in a sentence for one car's report who else sees what it sees."""
    seeing = (Agreement.CONFIRMS, Agreement.SUPPORTS)
    others = [c.car for c in common.cars if c.agreement in seeing and c.car != name]
    alone = any(c.alone for c in common.cars if c.car == name)
    found = "" if alone else " This car alone would not have shown it for sure."
    return f"Estimated together with {joined(others)}, {WORDING[common.cause].alike}.{found}"
