"""Costmaps of the cars for which somebody requests them: agents make them for subscribers."""

from collections.abc import Iterator

from scm.api.picture import Held
from scm.clock import NS_PER_S
from scm.runtime.part import Subscription
from scm.v2x.messages.costmap import Costmap

WATCHED_NS = 5 * NS_PER_S
"""How long after a request costmaps are received."""


class CostmapWatch:
    """Whose costmap was requested until when, and the newest; not safe between threads."""

    def __init__(self) -> None:
        self._until_ns: dict[str, int] = {}
        self._newest: dict[str, Held[Costmap]] = {}

    def subscribe(self, vehicle: str, now_ns: int) -> bool:
        """Receive a car's costmaps from now on; return whether they were not received before."""
        is_new = vehicle not in self._until_ns
        self._until_ns[vehicle] = now_ns + WATCHED_NS
        return is_new

    def receive(self, costmap: Costmap, t_ns: int) -> None:
        """Store a costmap that is watched."""
        if costmap.vehicle in self._until_ns:
            self._newest[costmap.vehicle] = Held(costmap, t_ns)

    def newest(self, vehicle: str) -> Costmap | None:
        """Return the newest costmap of a car; None: none yet."""
        held = self._newest.get(vehicle)
        return None if held is None else held.message

    def forget(self, now_ns: int) -> bool:
        """Drop what nobody requests any more; return whether there was any."""
        over = [vehicle for vehicle, until_ns in self._until_ns.items() if until_ns <= now_ns]
        for vehicle in over:
            del self._until_ns[vehicle]
            self._newest.pop(vehicle, None)
        return bool(over)

    def subscriptions(self) -> Iterator[Subscription]:
        """Yield the subscriptions needed now."""
        return (Subscription(Costmap, {"vehicle": vehicle}) for vehicle in self._until_ns)
