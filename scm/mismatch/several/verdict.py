"""Whose an effect is, in one sentence: the camera's, the floor's, or one car's own."""

from collections.abc import Mapping, Sequence

from scm.mismatch.report.wording import capital, joined
from scm.mismatch.several.findings import Agreement, CarAgreement, Cause, Common

WHOSE: Mapping[Cause, str] = {
    Cause.CAMERA: "it is the camera, not the cars",
    Cause.TAGS: "the tags sit alike on all of them, or the description's point is wrong; or the "
                "camera is off by as much",
    Cause.FLOOR: "it is the floor, or what acts on all cars there",
}  # fmt: skip
OWN: Mapping[Cause, str] = {
    Cause.CAMERA: "it is that car's own (its tag, its mounting, its clock), not the camera",
    Cause.TAGS: "it is that car's own tag or its mounting, not the camera",
    Cause.FLOOR: "it is that car's own, not the floor",
}
UNSURE: Mapping[Cause, str] = {
    Cause.CAMERA: "whether it is the camera or that car's own",
    Cause.TAGS: "whether it is that car's tag or the camera",
    Cause.FLOOR: "whether it is the floor or that car's own",
}
ALIKE: Mapping[Cause, str] = {
    Cause.CAMERA: "seen by the same camera", Cause.TAGS: "seen alike by the same camera",
    Cause.FLOOR: "on the same floor",
}  # fmt: skip
TWO = 2
VERBS: Mapping[Cause, str] = {Cause.CAMERA: "see", Cause.TAGS: "see", Cause.FLOOR: "feel"}


def conclusion(cause: Cause, cars: Sequence[CarAgreement], *, shared: bool) -> str:
    """Return whose an effect is, as the cars together say."""
    seeing = [c.car for c in cars if c.agreement in (Agreement.CONFIRMS, Agreement.SUPPORTS)]
    against = [c.car for c in cars if c.agreement is Agreement.CONTRADICTS]
    silent = [c.car for c in cars if c.agreement is Agreement.UNDECIDED]
    verb = VERBS[cause]
    if not shared:
        return _of_one(cause, cars, against, silent)
    if against:
        by_others = [c.car for c in cars if c.car in against and c.alone]
        none = [name for name in against if name not in by_others]
        also = [f"{joined(none)} {_would(none)}"] if none else []
        also += [f"{joined(by_others)} by another amount"] if by_others else []
        return (
            f"{joined(seeing)} {verb} it alike, {joined(also)}: it is something that only "
            f"{joined(seeing)} have in common."
        )
    if silent:
        drives = "the drives of" if len(silent) > 1 else "the drive of"
        return (
            f"{joined(seeing)} {verb} it alike: {WHOSE[cause]}. {drives.capitalize()} "
            f"{joined(silent)} cannot tell, and {_do(silent)} not contradict."
        )
    every = "both cars" if len(cars) == TWO else f"all {len(cars)} cars"
    if any(c.agreement is Agreement.SUPPORTS for c in cars):
        return f"Too weak for one car alone, {every} together show it: {WHOSE[cause]}."
    return f"{capital(every)} {verb} it alike: {WHOSE[cause]}."


def _of_one(
    cause: Cause, cars: Sequence[CarAgreement], against: Sequence[str], silent: Sequence[str]
) -> str:
    finders = [c.car for c in cars if c.alone]
    verb = VERBS[cause]
    if len(finders) > 1:
        return (
            f"{joined(finders)} {verb} it each by another amount: it is each car's own, nothing "
            "that they have in common."
        )
    who = joined(finders) or "one car"
    others = [name for name in against if name not in finders]
    if others:
        return f"Only {who} {verb}s it, {joined(others)} {_would(others)}: {OWN[cause]}."
    drives = "the drives of" if len(silent) > 1 else "the drive of"
    return (
        f"Only {who} {verb}s it; {drives} {joined([n for n in silent if n not in finders])} cannot "
        f"tell {UNSURE[cause]}."
    )


def _do(names: Sequence[str]) -> str:
    return "do" if len(names) > 1 else "does"


def _would(names: Sequence[str]) -> str:
    return "would have to and " + ("do not" if len(names) > 1 else "does not")


def all_alike(common: Common, name: str) -> str:
    """Return in a sentence for one car's report who else sees what it sees."""
    seeing = (Agreement.CONFIRMS, Agreement.SUPPORTS)
    others = [c.car for c in common.cars if c.agreement in seeing and c.car != name]
    alone = any(c.alone for c in common.cars if c.car == name)
    found = "" if alone else " This car alone would not have shown it for sure."
    return f"Estimated together with {joined(others)}, {ALIKE[common.cause]}.{found}"
