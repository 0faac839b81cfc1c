"""Level of service by control delay, as the Highway Capacity Manual grades full-size junctions.

Time is not scaled here: a car of 1:14 waits for real seconds, and the limits are taken as they are.
They are a convention for full-size roads; on the floor they compare approaches with each other.
"""

from collections.abc import Sequence

SIGNAL_S = (10.0, 20.0, 35.0, 55.0, 80.0)
SIGN_S = (10.0, 15.0, 25.0, 35.0, 50.0)
LEVELS = "ABCDEF"


def level_of(delay_s: float, *, signal: bool, saturation: float | None = None) -> str:
    """Return `A` to `F` of a mean control delay; over saturation it is `F` whatever the delay."""
    if saturation is not None and saturation > 1.0:
        return LEVELS[-1]
    limits = SIGNAL_S if signal else SIGN_S
    return LEVELS[sum(1 for limit in limits if delay_s > limit)]


def share_below(samples: Sequence[int], share: float) -> int:
    """Return the least value that this share of the samples does not exceed; 0 without any."""
    if not samples:
        return 0
    ordered = sorted(samples)
    return ordered[min(len(ordered) - 1, max(0, -int(-share * len(ordered) // 1) - 1))]
