"""A place given by coordinates, `X,Y,DEG`: metres in the map frame, degrees counter-clockwise."""

import math

from scm.errors import MapError
from scm.geometry import Pose2, wrap_angle

EXPECTED = "X,Y,DEG: metres in the map frame and degrees counter-clockwise from its x axis"
EXAMPLE = "1.384,0.655,315"


def are_coordinates(text: str) -> bool:
    """Return whether a text means coordinates and not a name: no name has a comma."""
    return "," in text


def pose_at(text: str) -> Pose2:
    """Return the pose that coordinates say.

    Raises:
        MapError: when they are not three finite numbers.
    """
    try:
        x, y, degrees = (float(part) for part in text.split(","))
    except ValueError:
        msg = f"spawn: got {text!r}, expected {EXPECTED}, as {EXAMPLE}"
        raise MapError(msg) from None
    if not all(map(math.isfinite, (x, y, degrees))):
        msg = f"spawn: got {text!r}, expected finite numbers: {EXPECTED}, as {EXAMPLE}"
        raise MapError(msg)
    return Pose2(x, y, wrap_angle(math.radians(degrees)))


def checked_place(text: str) -> str:
    """Return the name of a place, or coordinates, as they were given: for the command line.

    Raises:
        MapError: when they are coordinates and not three finite numbers.
    """
    if are_coordinates(text):
        pose_at(text)
    return text
