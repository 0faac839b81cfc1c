"""Operations on session of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.operation import Noun, operation
from scm.records.session import Ended, Session


class SessionNoun(Noun):
    """Operations on session."""

    @operation("GET", "/api/v1/session")
    def session(self) -> Session:
        """The owner and role of this key."""

    @operation("PUT", "/api/v1/session")
    def begin(self) -> Session:
        """Keep this key as a cookie, good for reading."""

    @operation("DELETE", "/api/v1/session")
    def end(self) -> Ended:
        """Forget the cookie."""
