"""Operations on health of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.operation import Noun, operation
from scm.records.health import Alive, Ready


class HealthNoun(Noun):
    """Operations on health."""

    @operation("GET", "/healthz")
    def healthz(self) -> Alive:
        """The server answers."""

    @operation("GET", "/readyz")
    def readyz(self) -> Ready:
        """The router, the world, all parts and the disk are there."""

    @operation("GET", "/metrics")
    def all_metrics(self) -> bytes:
        """Metrics, as Prometheus reads them."""
