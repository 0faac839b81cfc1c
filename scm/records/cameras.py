"""Cameras of the city and of cars."""

import msgspec


class Cameras(msgspec.Struct, kw_only=True, frozen=True):
    """A car's cameras.

    Attributes:
        cameras: Those that its file gives it; may be empty.
        watched: Those whose pictures somebody looks at now.
    """

    cameras: tuple[str, ...]
    watched: tuple[str, ...]
