"""Walls sorted by place."""

from scm.arrays import Floats


class WallGrid:
    """Everything that never moves.

    Args:
        edges: (m, 4) x0, y0, x1, y1 of each face, map frame [m].
    """

    def __init__(self, edges: Floats) -> None:
        self.edges = edges
