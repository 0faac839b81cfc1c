"""Operations on boxes of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.operation import Noun, operation
from scm.records.boxes import Boxes
from scm.v2x.messages.boxes_request import BoxesReply


class BoxesNoun(Noun):
    """Operations on boxes."""

    @operation("GET", "/api/v1/boxes")
    def boxes(self) -> Boxes:
        """Where the boxes are that cars can push."""

    @operation("POST", "/api/v1/boxes/reset")
    def reset(self, *, idempotency_key: str = "") -> BoxesReply:
        """Put all boxes back where the map has them."""
