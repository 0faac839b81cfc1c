"""Operations on stop of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.connection import Connection
from scm.v2x.messages.city_stop import CityStop


class StopNoun:
    """Operations on stop."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def stop(self) -> CityStop:
        """Whether the city-wide stop is engaged."""
        return self._connection.request("GET", "/api/v1/stop", CityStop)

    def set_stop(
        self, *, engaged: bool, by: str = "", reason: str = "", idempotency_key: str = ""
    ) -> CityStop:
        """Engage or release the city-wide stop.

        Args:
            engaged: true: stop every car
            by: who requests it, for the log; empty: whoever calls
            reason: why, for the log
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "PUT",
            "/api/v1/stop",
            CityStop,
            body={"engaged": engaged, "by": by, "reason": reason},
            key=idempotency_key,
        )
