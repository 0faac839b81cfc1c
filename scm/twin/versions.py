"""The versions of one car's file: one is in force, one at most is a candidate.

A candidate is adopted when it predicts driving better that no fit has seen, and nothing worse. On
later driving it is compared with the version that it replaced, and rolled back if that was better.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from msgspec.structs import replace

from scm.records.twins import TwinParameter, TwinVersion
from scm.twin.investigation import Compared, Explained
from scm.vehicles.car import Car

SEEN_S = (120.0, 240.0)  # of driving, after which a candidate is compared
PROBATION_S = (150.0, 300.0)  # likewise, after it was adopted
MOST_SENT = 20
ERRORS = {"position_m": ("position", "mm", 1e3), "yaw_rad": ("heading", "mrad", 1e3)}
BY_TWIN = "twin"


@dataclass(slots=True)
class Trial:
    """A version on new driving, compared with the one before it.

    Attributes:
        since_s: From when on driving is new.
        driven_s: How long the car had been driven then.
        done: How many comparisons were made.
    """

    since_s: float
    driven_s: float
    done: int = 0


class CarVersions:
    """The versions of one car's file.

    Args:
        car: Name or path of the file that the car came with.
        stored: As an earlier process left them; those of another file do not count.
    """

    def __init__(self, car: str, stored: Iterable[TwinVersion] = ()) -> None:
        self._car = car
        first = TwinVersion(number=0, car=car, file=car, made_ns=0, state="adopted")
        self._by_number = {0: first} | {one.number: one for one in stored if one.car == car}

    def __getitem__(self, number: int) -> TwinVersion:
        return self._by_number[number]

    def __contains__(self, number: int) -> bool:
        return number in self._by_number

    @property
    def newest(self) -> tuple[TwinVersion, ...]:
        """The newest, by number; at most as many as a message has."""
        return tuple(self._by_number[number] for number in sorted(self._by_number)[-MOST_SENT:])

    @property
    def in_force(self) -> TwinVersion:
        """By which the car is predicted."""
        return next(one for one in reversed(self.newest) if one.state == "adopted")

    @property
    def candidate(self) -> TwinVersion | None:
        """That is compared with it."""
        return next((one for one in self.newest if one.state == "candidate"), None)

    def propose(self, found: Explained, report: str, made_ns: int) -> TwinVersion:
        """Add the car file that a search found as a candidate, and return it."""
        made = TwinVersion(
            number=max(self._by_number) + 1, car=self._car, file=str(found.car_file),
            made_ns=made_ns, state="candidate", after=self.in_force.number,
            effects=tuple(one.name for one in found.effects), report=report,
            abilities=found.abilities,
        )  # fmt: skip
        return self._put(made)

    def reject(self, reason: str, compared: Compared | None = None) -> TwinVersion | None:
        """Reject the candidate, if there is one, and return it."""
        if self.candidate is None:
            return None
        return self._put(_judged(self.candidate, "rejected", BY_TWIN, reason, compared))

    def put_in_force(
        self, number: int, by: str, reason: str, compared: Compared | None = None
    ) -> list[TwinVersion]:
        """Put a version in force, and return all that this changed."""
        changed, before = list[TwinVersion](), self.in_force.number
        for one in self.newest:
            if one.number == number:
                continue
            if one.state == "adopted" and one.number > number:
                changed.append(self._put(replace(one, state="rolled_back", by=by, reason=reason)))
            elif one.state == "adopted" and number > before:
                changed.append(self._put(replace(one, state="replaced")))
        return [*changed, self._put(_judged(self[number], "adopted", by, reason, compared))]

    def _put(self, version: TwinVersion) -> TwinVersion:
        self._by_number[version.number] = version
        return version


def _judged(
    version: TwinVersion,
    state: Literal["adopted", "rejected"],
    by: str,
    reason: str,
    compared: Compared | None,
) -> TwinVersion:
    changed = replace(version, state=state, by=by, reason=reason)
    if compared is None:
        return changed
    return replace(changed, windows=compared.windows, errors=compared.errors)


def verdict(compared: Compared, *, is_last: bool) -> tuple[str, str]:
    """Return what becomes of a candidate, `adopt`, `reject` or `wait`, and why."""
    errors = in_words(compared)
    if compared.worse:
        reason = f"{', '.join(map(_name, compared.worse))} worse on new driving: {errors}"
        return ("reject" if is_last else "wait"), reason
    if compared.better:
        return "adopt", f"{', '.join(map(_name, compared.better))} better on new driving: {errors}"
    return ("reject" if is_last else "wait"), f"no better on new driving: {errors}"


def is_worse(compared: Compared) -> bool:
    """Return whether a version in force predicts the pose worse than the one before it."""
    return bool(set(ERRORS) & set(compared.worse))


def in_words(compared: Compared) -> str:
    """Return the errors of two versions after 3 s."""
    shown = [
        f"{word} {per_unit * one.before:.3g} to {per_unit * one.now:.3g} {unit}"
        for one in compared.errors
        if one.name in ERRORS
        for word, unit, per_unit in (ERRORS[one.name],)
    ]
    return f"{', '.join(shown)} after 3 s, {compared.windows} windows"


def _name(error: str) -> str:
    return ERRORS[error][0] if error in ERRORS else error.rpartition("_")[0].replace("_", " ")


def meaning(abilities: Iterable[TwinParameter]) -> list[str]:
    """Return what a version means for driving: abilities whose interval leaves out the one before.

    Order and names are those of `scm.twin.abilities`.
    """
    words = {
        "cruise_mps": ("drives {:.3g} m/s at 0.8 of its throttle", 1.0),
        "stopping_m": ("needs {:.3g} mm from there to stop", 1e3),
        "turning_radius_m": ("turns in a radius of {:.0f} mm at best", 1e3),
    }
    found = list[str]()
    for one in abilities:
        if one.before is not None and not one.low <= one.before <= one.high:
            text, per_unit = words[one.name]
            before = f"{per_unit * one.before:.3g}"
            found.append(f"{text.format(per_unit * one.value)}, {before} before")
    return found


def differences(before: Car, now: Car) -> list[str]:
    """Return how a car file differs from another, a line an effect or number.

    Numbers that moved by less than their standard deviation are counted, not listed.
    """
    lines, little = list[str](), 0
    names = [{one.name for one in car.terms} | {one.kind.name for one in car.measures}
             for car in (before, now)]  # fmt: skip
    lines += [f"with {name}" for name in sorted(names[1] - names[0])]
    lines += [f"without {name}" for name in sorted(names[0] - names[1])]
    for key in sorted(now.values):
        new, old = now.values[key], before.values.get(key)
        if not isinstance(new.value, float) or (old is not None and old.value == new.value):
            continue
        unit = "" if new.unit == "1" else f" {new.unit}"
        if old is None:
            lines.append(f"{key} {new.value:.4g}{unit}")
        elif not isinstance(old.value, float):
            continue
        elif old.std is not None and abs(new.value - old.value) < old.std:
            little += 1
        else:
            lines.append(f"{key} {old.value:.4g} to {new.value:.4g}{unit}")
    if little:
        lines.append(f"{little} numbers moved by less than their standard deviation")
    return lines
