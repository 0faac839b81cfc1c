"""Operations on traffic of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.operation import Noun, operation
from scm.records.traffic import Counts, Violations


class TrafficNoun(Noun):
    """Operations on traffic."""

    @operation("GET", "/api/v1/traffic")
    def counts(self) -> Counts:
        """Counts, delays, queues and level of service."""

    @operation("GET", "/api/v1/traffic/violations")
    def violations(self, *, vehicle: str = "", limit: int = 100) -> Violations:
        """Violations, newest first, with their evidence.

        Args:
            vehicle: of this car alone
        """
