"""Boxes that cars can push."""

import msgspec

from scm.records.fields import XM, YM, Name, YawRad


class SnapshotBox(msgspec.Struct, kw_only=True, frozen=True):
    """One construction box that cars can push; pose of its middle, map frame."""

    name: Name
    x_m: XM
    y_m: YM
    yaw_rad: YawRad


class Boxes(msgspec.Struct, kw_only=True, frozen=True):
    """Where the boxes are that cars can push.

    Attributes:
        boxes: Boxes that cars can push.
    """

    boxes: tuple[SnapshotBox, ...]
