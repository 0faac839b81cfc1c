"""Operations on boxes of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.connection import Connection
from scm.records.boxes import Boxes
from scm.v2x.messages.boxes_request import BoxesReply


class BoxesNoun:
    """Operations on boxes."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def boxes(self) -> Boxes:
        """Where the boxes are that cars can push."""
        return self._connection.request("GET", "/api/v1/boxes", Boxes)

    def reset(self, *, idempotency_key: str = "") -> BoxesReply:
        """Put all boxes back where the map has them.

        Args:
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "POST", "/api/v1/boxes/reset", BoxesReply, key=idempotency_key
        )
