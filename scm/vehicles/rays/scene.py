"""What level scanners can see: walls, and the outlines of what moves among them."""

from dataclasses import dataclass

from scm.arrays import Floats, Ints
from scm.vehicles.rays.grid import WallGrid


@dataclass(frozen=True, slots=True)
class Scene:
    """All vertical faces of one instant.

    Attributes:
        walls: Everything that never moves.
        outlines: (4 n, 4) x0, y0, x1, y1 of the faces of n four-cornered bodies, each body's four
            together and counter-clockwise; map frame [m].
        owners: (n,) the slot of the car that a body is; -1 where it is nobody's.
    """

    walls: WallGrid
    outlines: Floats
    owners: Ints
