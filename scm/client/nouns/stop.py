"""Operations on stop of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.operation import Noun, operation
from scm.v2x.messages.city_stop import CityStop


class StopNoun(Noun):
    """Operations on stop."""

    @operation("GET", "/api/v1/stop")
    def stop(self) -> CityStop:
        """Whether the city-wide stop is engaged."""

    @operation("PUT", "/api/v1/stop")
    def set_stop(
        self, *, engaged: bool, by: str = "", reason: str = "", idempotency_key: str = ""
    ) -> CityStop:
        """Engage or release the city-wide stop.

        Args:
            engaged: true: stop every car
            by: who requests it, for the log; empty: the caller
            reason: why, for the log
        """
