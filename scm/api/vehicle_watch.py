"""What cars send only while somebody subscribes: LIDAR scans, what a network sees.

It is received of the cars that somebody watches.
"""

from collections import Counter
from collections.abc import Iterator
from typing import Generic, TypeVar

from scm.api.picture import Held
from scm.runtime.part import Subscription
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.network_view import NetworkView

V = TypeVar("V", LidarScan, NetworkView)


class VehicleWatch(Generic[V]):
    """Who watches whose messages of a class, and the newest of each car; not safe between threads.

    Args:
        kind: The class.
    """

    def __init__(self, kind: type[V]) -> None:
        self._kind: type[V] = kind
        self._watched: Counter[str] = Counter()
        self._newest: dict[str, Held[V]] = {}

    def watch(self, vehicle: str, more: int) -> None:
        """Count `more` watchers of a car; without any its message is dropped."""
        self._watched[vehicle] += more
        if self._watched[vehicle] <= 0:
            del self._watched[vehicle]
            self._newest.pop(vehicle, None)

    def receive(self, message: V, t_ns: int) -> None:
        """Store a message of a watched car."""
        if message.vehicle in self._watched:
            self._newest[message.vehicle] = Held(message, t_ns)

    def newest(self, vehicle: str) -> Held[V] | None:
        """Return the newest message of a watched car; None: none yet."""
        return self._newest.get(vehicle)

    def subscriptions(self) -> Iterator[Subscription]:
        """Yield the subscriptions that present viewers need."""
        return (Subscription(self._kind, {"vehicle": vehicle}) for vehicle in self._watched)
