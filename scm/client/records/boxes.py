"""Records of boxes.

Written by docs/make/client.py: do not change it here.
"""

import msgspec

from scm.client.records.shared import SnapshotBox


class Boxes(msgspec.Struct, kw_only=True, frozen=True):
    """Where the boxes are that cars can push.

    Attributes:
        boxes: Boxes that cars can push.
    """

    boxes: tuple[SnapshotBox, ...]


class BoxesReply(msgspec.Struct, kw_only=True, frozen=True):
    """They stand where they began; `boxes` is how many there are.

    Attributes:
        boxes: Boxes that cars can push.
    """

    boxes: int
