"""Records of boxes.

Written by docs/make/client.py: do not change it here.
"""

import msgspec


class SnapshotBox(msgspec.Struct, kw_only=True, frozen=True):
    """One construction box that cars can push; pose of its middle, map frame.

    Attributes:
        name: What it is called.
        x_m: To the right on the map [m].
        y_m: Up on the map [m].
        yaw_rad: Direction, counter-clockwise from map x [rad].
    """

    name: str
    x_m: float
    y_m: float
    yaw_rad: float


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
