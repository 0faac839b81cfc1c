"""Operations on health of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.connection import Connection
from scm.records.health import Alive, Ready


class HealthNoun:
    """Operations on health."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def healthz(self) -> Alive:
        """The server answers."""
        return self._connection.request("GET", "/healthz", Alive)

    def readyz(self) -> Ready:
        """The router, the world, all parts and the disk are there."""
        return self._connection.request("GET", "/readyz", Ready)

    def all_metrics(self) -> bytes:
        """Metrics, as Prometheus reads them."""
        return self._connection.fetch("/metrics")
