"""Operations on events of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.connection import Connection
from scm.client.records.events import Events


class EventsNoun:
    """Operations on events."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def events(self, *, after: int = 0, limit: int = 100) -> Events:
        """Events in order of arrival.

        Args:
            after: number of the last event read
            limit: events a page
        """
        return self._connection.ask(
            "GET", "/api/v1/events", Events, query={"after": after, "limit": limit}
        )
