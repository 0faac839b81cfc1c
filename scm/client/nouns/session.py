"""Operations on session of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.connection import Connection
from scm.records.session import Ended, Session


class SessionNoun:
    """Operations on session."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def session(self) -> Session:
        """Who this key says you are."""
        return self._connection.request("GET", "/api/v1/session", Session)

    def begin(self) -> Session:
        """Keep this key as a cookie, good for reading."""
        return self._connection.request("PUT", "/api/v1/session", Session)

    def end(self) -> Ended:
        """Forget the cookie."""
        return self._connection.request("DELETE", "/api/v1/session", Ended)
