"""Names of the overhead cameras' parts on the bus."""

EYE = "eye"


def eye_station(camera: str, *, first: bool) -> str:
    """Return the station of a camera's part: `eye` for the map's first, `eye-<camera>` for others.

    The first also publishes tracks from all cameras.
    """
    return EYE if first else f"{EYE}-{camera}"
