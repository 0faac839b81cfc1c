"""Which lamps of a car are on: two are commanded, three follow from its motion.

    headlights   off, low, high (the low beam stays on with the high one)          commanded
    indicators   off, left, right, hazard: 500 ms on, 500 ms off, all cars alike   commanded
    tail         with the headlights                                               automatic
    brake        |v| < 0.05 m/s, no throttle, or throttle against the motion       automatic
    reverse      v < -0.01 m/s                                                     automatic

Source: the AutoDRIVE paper and simulator (dual-mode headlights, triple-mode indicators at 1 Hz,
brake lamps below 0.05 m/s, reverse lamps at v < 0), the lights sketch of the testbed (500 ms,
high = low + high, hazard = both sides). At zero throttle the motors brake: so do the lamps. The
simulator's reverse lamp has no dead band; 1 cm/s keeps a standing car's from flickering.
"""

from dataclasses import dataclass
from typing import Literal

from scm.clock import NS_PER_MS

Headlights = Literal["off", "low", "high"]
Indicators = Literal["off", "left", "right", "hazard"]

HALF_PERIOD_NS = 500 * NS_PER_MS
HOLDING_MPS = 0.05
REVERSING_MPS = -0.01


@dataclass(frozen=True, slots=True)
class Switches:
    """The commanded lights of a car."""

    headlights: Headlights = "off"
    indicators: Indicators = "off"

    def updated(self, headlights: Headlights | None, indicators: Indicators | None) -> "Switches":
        """Return the switches after a command; None leaves one unchanged."""
        if headlights is None and indicators is None:
            return self
        return Switches(headlights or self.headlights, indicators or self.indicators)


OFF = Switches()

TURNS: dict[int, Indicators] = {1: "left", -1: "right", 0: "off"}
"""Indicator by direction of the next turn."""

_HEAD: dict[Headlights, tuple[str, ...]] = {
    "off": (),
    "low": ("head_low", "tail"),
    "high": ("head_low", "head_high", "tail"),
}
_SIDES: dict[Indicators, tuple[str, ...]] = {
    "off": (),
    "left": ("left",),
    "right": ("right",),
    "hazard": ("left", "right"),
}


def lamps(
    switches: Switches,
    throttle: float,
    speed: float,
    now_ns: int,
    *,
    hazard: bool = False,
    turn: Indicators = "off",
) -> tuple[str, ...]:
    """Return the names of the lamps that are on.

    Args:
        switches: Commanded lights.
        throttle: As the motors get it, -1 to 1.
        speed: Along the body [m/s].
        now_ns: The city's time; indicators are lit in the first half of each of its seconds.
        hazard: Whether both indicators must flash regardless of commands: the car is lost.
        turn: The next turn of the car's own driver; a commanded indicator has priority.
    """
    shown = _HEAD[switches.headlights]
    if abs(speed) < HOLDING_MPS or throttle * speed <= 0.0:
        shown += ("brake",)
    if speed < REVERSING_MPS:
        shown += ("reverse",)
    if now_ns // HALF_PERIOD_NS % 2:
        return shown
    wanted = turn if switches.indicators == "off" else switches.indicators
    return shown + _SIDES["hazard" if hazard else wanted]
