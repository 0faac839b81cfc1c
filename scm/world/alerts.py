"""Events of the world, and conditions that are reported once: warnings, batteries, lanes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from scm.v2x.etsi.events import CarWarnings, DenmReceiver
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.denm import DenmTx
from scm.world.stuck import Stuck

NAME = "world"
LOW_CHARGE = 0.2  # a battery below this is reported
RECHARGED = 0.3  # above this it may be reported again


def city_event(
    severity: Literal["info", "warning", "error"],
    name: str,
    text: str,
    now_ns: int,
    vehicle: str | None = None,
) -> CityEvent:
    """Return an event of the world."""
    return CityEvent(
        severity=severity, source=NAME, t_ns=now_ns, name=name, text=text, vehicle=vehicle
    )


@dataclass(slots=True)
class WarningState:
    """Warnings by radio.

    Attributes:
        braked: Indices of hosted cars that have braked hard since the last check.
        warners: What hosted cars warn of, by name.
        denms: What all stations warn of.
        due: DENMs of hosted cars to be sent in this tick, by station.
    """

    braked: set[int] = field(default_factory=set)
    warners: dict[str, CarWarnings] = field(default_factory=dict)
    denms: DenmReceiver = field(default_factory=DenmReceiver)
    due: Sequence[DenmTx] = ()


class LowBatteries:
    """Which cars were reported with a low battery."""

    def __init__(self) -> None:
        self._low: set[str] = set()

    def is_low(self, name: str) -> bool:
        """Return whether a car was reported and has not been recharged since."""
        return name in self._low

    def note(self, name: str, *, is_low: bool) -> None:
        """Note that a car was reported elsewhere, or that it was not."""
        (self._low.add if is_low else self._low.discard)(name)

    def news(self, charges: Mapping[str, float | None]) -> list[str]:
        """Return who is low since the last call, of all cars; a charge is None where unknown."""
        known = {name: charge for name, charge in charges.items() if charge is not None}
        self._low = {
            name for name in self._low & charges.keys() if known.get(name, LOW_CHARGE) < RECHARGED
        }
        news = [
            name for name, charge in known.items() if charge < LOW_CHARGE and name not in self._low
        ]
        self._low.update(news)
        return news


@dataclass(slots=True)
class Alerts:
    """Problems of cars that were reported.

    Attributes:
        stuck: Which cars push in vain.
        low_batteries: Which cars were reported with a low battery.
        checked_files: Car files whose fit to the lanes was checked.
    """

    stuck: Stuck
    low_batteries: LowBatteries = field(default_factory=LowBatteries)
    checked_files: set[str] = field(default_factory=set)
