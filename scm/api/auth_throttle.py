"""Slow down who guesses a key: so many wrong ones an address, then one every few seconds.

Only for that key, by its public part: a page left open with an expired key keeps requesting, and
must not block others at the same address from the city stop.
"""

import ipaddress
from collections import OrderedDict

from scm.api.keys import public_part
from scm.clock import Clock, seconds

BURST = 10.0
REFILL_PER_S = 0.2
MAX_ADDRESSES = 4096


class Brake:
    """A bucket of tries for each address and key; a wrong one takes a try, time gives it back."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._buckets: OrderedDict[str, tuple[float, int]] = OrderedDict()

    def wait_s(self, address: str, key: str) -> float:
        """Return how long an address has to wait before it may try a key again; 0: not at all."""
        return max(0.0, (1.0 - self._tries(_whose(address, key))) / REFILL_PER_S)

    def note_wrong(self, address: str, key: str) -> None:
        """Take a try away."""
        whose = _whose(address, key)
        self._buckets[whose] = (self._tries(whose) - 1.0, self._clock.now_ns())
        self._buckets.move_to_end(whose)
        if len(self._buckets) > MAX_ADDRESSES:
            self._buckets.popitem(last=False)

    def _tries(self, whose: str) -> float:
        left, at_ns = self._buckets.get(whose, (BURST, 0))
        return min(BURST, left + REFILL_PER_S * seconds(self._clock.now_ns() - at_ns))


def _whose(address: str, key: str) -> str:
    """Return who guesses which key: the household of an address, IPv6 gives each 2^64 of them."""
    try:
        if ipaddress.ip_address(address).version == 6:
            address = str(ipaddress.ip_network((address, 64), strict=False))
    except ValueError:
        pass  # no address: as it is called
    return f"{address} {public_part(key)}"
