"""Boxes that cars can push."""

import msgspec


class SnapshotBox(msgspec.Struct, kw_only=True, frozen=True):
    """One construction box that cars can push; pose of its middle, map frame."""

    name: str
    x_m: float
    y_m: float
    yaw_rad: float


class Boxes(msgspec.Struct, kw_only=True, frozen=True):
    """Where the boxes are that cars can push."""

    boxes: tuple[SnapshotBox, ...]
