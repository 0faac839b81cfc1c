"""Slow down who guesses keys: so many wrong ones an address, then one every few seconds."""

import ipaddress
from collections import OrderedDict

from scm.clock import Clock, seconds

BURST = 10.0
REFILL_PER_S = 0.2
ADDRESSES_KEPT = 4096


class Brake:
    """A bucket of tries for each address; a wrong key takes one, time gives it back."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._buckets: OrderedDict[str, tuple[float, int]] = OrderedDict()

    def wait_s(self, address: str) -> float:
        """Return how long an address has to wait before it may try a key again; 0: not at all."""
        return max(0.0, (1.0 - self._tries(_whose(address))) / REFILL_PER_S)

    def note_wrong(self, address: str) -> None:
        """Take a try away."""
        whose = _whose(address)
        self._buckets[whose] = (self._tries(whose) - 1.0, self._clock.now_ns())
        self._buckets.move_to_end(whose)
        if len(self._buckets) > ADDRESSES_KEPT:
            self._buckets.popitem(last=False)

    def _tries(self, whose: str) -> float:
        left, at_ns = self._buckets.get(whose, (BURST, 0))
        return min(BURST, left + REFILL_PER_S * seconds(self._clock.now_ns() - at_ns))


def _whose(address: str) -> str:
    """Return the address, or the network of one household: IPv6 gives each 2^64 of them."""
    try:
        version = ipaddress.ip_address(address).version
    except ValueError:
        return address
    return address if version == 4 else str(ipaddress.ip_network((address, 64), strict=False))
