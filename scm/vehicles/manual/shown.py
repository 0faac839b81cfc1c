"""What each effect's picture compares, from `shown.toml`: a drive, a plot, and the numbers."""

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from scm.vehicles.manual.manoeuvres import MANOEUVRES
from scm.vehicles.param import LogNormal, Normal, Param
from scm.vehicles.term import Term

DROPPED: Mapping[str, float] = {"": 0.0}  # the other car does not have the effect


@dataclass(frozen=True, slots=True)
class Shown:
    """One picture.

    Attributes:
        manoeuvre: Name in `MANOEUVRES`.
        see: The plotted quantity, a name in `picture.PLOTS`.
        numbers: Of the effect's curve, by `section.key`.
        other: Numbers of the dashed curve; None: the effect's neutral ones.
        car: Name of the car.
        beside: Further effects of both cars, which this one needs.
        both: Numbers of both cars.
        instead: Effects that this one replaces.
    """

    manoeuvre: str
    see: str
    numbers: Mapping[str, float] = field(default_factory=dict)
    other: Mapping[str, float] | None = None
    car: str = "nigel"
    beside: tuple[str, ...] = ()
    both: Mapping[str, float] = field(default_factory=dict)
    instead: tuple[str, ...] = ()


def _table() -> dict[str, Shown]:
    path = Path(__file__).with_name("shown.toml")
    return {
        name: Shown(
            row["drive"],
            row["see"],
            row.get("numbers", {}),
            DROPPED if row.get("other") == "dropped" else row.get("other"),
            row.get("car", "nigel"),
            tuple(row.get("beside", ())),
            row.get("both", {}),
            tuple(row.get("instead", ())),
        )
        for name, row in tomllib.loads(path.read_text(encoding="utf-8")).items()
    }


def shown_of(term: Term) -> Shown:
    """Return the picture's definition for an effect; the default shows its prior's edge."""
    chosen = _table().get(term.name)
    if chosen is not None:
        return chosen
    known = [name for name in term.shows_in if name in MANOEUVRES]
    numbers = {p.key: strong(p) for p in term.params if p.name in term.neutral}
    name = known[0] if known else "throttle_step"
    plot = "yaw_rate" if "steer" in name or "circle" in name else "speed"
    return Shown(name, plot, numbers, None if numbers else DROPPED)


def strong(param: Param) -> float:
    """Return a number at the prior's edge, inside the bounds, that makes the effect visible."""
    low, high = param.bounds
    match param.prior:
        case Normal(mean, std):
            return min(max(mean + 2.0 * std, low), high)
        case LogNormal(median, sigma):
            return min(max(median * math.exp(1.5 * sigma), low), high)
    return param.default
