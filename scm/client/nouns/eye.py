"""Operations on eye of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.connection import Connection, part
from scm.client.records.eye import EyeTags, Overhead


class EyeNoun:
    """Operations on eye."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def cameras(self) -> Overhead:
        """All cameras, with tags and poses seen."""
        return self._connection.ask("GET", "/api/v1/eye", Overhead)

    def frame(self, name: str, *, t_ns: int | None = None) -> bytes:
        """A camera's newest picture.

        Args:
            name: a name on the bus
            t_ns: exposure of the picture; none: the newest
        """
        return self._connection.fetch(
            f"/api/v1/eye/cameras/{part(name)}/frame.jpg", query={"t_ns": t_ns}
        )

    def tags(self, name: str) -> EyeTags:
        """The tags found in a camera's newest picture.

        Args:
            name: a name on the bus
        """
        return self._connection.ask("GET", f"/api/v1/eye/cameras/{part(name)}/tags", EyeTags)
