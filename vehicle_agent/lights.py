"""Which lamps of a car are on; hazard lights flash half a second on, half a second off."""

from scm.clock import NS_PER_S
from scm.vehicles.guard import Guarded

SLOW = 0.05
BACKWARD = -0.02


def lights(guarded: Guarded, speed: float, now_ns: int) -> tuple[str, ...]:
    """Return the names of the lamps that are on."""
    shown = ["tail"]
    if guarded.brake or (guarded.throttle == 0.0 and abs(speed) < SLOW):
        shown.append("brake")
    if speed < BACKWARD:
        shown.append("reverse")
    if guarded.hazard and now_ns % NS_PER_S < NS_PER_S // 2:
        shown += ["left", "right"]
    return tuple(shown)
