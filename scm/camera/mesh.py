"""Objects made of flat faces, with position, normal and colour.

A `Part` is convex, so its faces that look at the camera never hide one another. Parts of one object
are ordered by separating planes (`Chain`): the parts on the far side of a plane, seen from the
camera, are painted first. Distances are compared only between objects: the farther one is painted
first.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from scm.arrays import Floats, Ints
from scm.scenery.canvas import Colour
from scm.scenery.solids import Solid


class Face(NamedTuple):
    """A flat polygon, counter-clockwise seen from outside, (n, 3) [m].

    Attributes:
        shines: 0: it shows the light that falls on it; above 0 it is a lamp, and its halo is so
            many times as wide as itself.
    """

    points: Floats
    colour: Colour
    shines: float = 0.0


Part = tuple[Face, ...]
"""A convex thing; faces that lie on others come after them."""


class Behind(NamedTuple):
    """A part, or a chain of them, on the far side of a plane across one axis of the thing.

    It lies where `sign * coordinate > sign * limit`; everything earlier in its chain does not.
    """

    what: "Part | Chain"
    axis: int
    sign: float
    limit: float


Chain = Sequence["Part | Behind"]


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """All faces of a thing as arrays.

    Attributes:
        points: Corners of all faces in turn, (p, 3) [m].
        starts: Where each face's corners begin, (f + 1,); the last is p.
        normals: Unit vectors outwards, (f, 3).
        colours: (f, 3).
        shines: (f,).
        parts: First and one past the last face of each part.
        chain: How the parts lie to one another; leaves are indices of `parts`.
    """

    points: Floats
    starts: Ints
    normals: Floats
    colours: Floats
    shines: Floats
    parts: tuple[tuple[int, int], ...]
    chain: "IndexChain"

    def order(self, eye: Floats) -> Iterator[int]:
        """Yield the parts as they are to be painted for an eye in the thing's frame, (3,)."""
        return _order(self.chain, eye)

    def placed(self, rotation: Floats, origin: Floats) -> tuple[Floats, Floats]:
        """Return points (p, 3) and normals (f, 3) of the thing put into the map."""
        return self.points @ rotation.T + origin, self.normals @ rotation.T


class IndexBehind(NamedTuple):
    """`Behind` with indices of parts for parts."""

    what: "int | IndexChain"
    axis: int
    sign: float
    limit: float


IndexChain = Sequence["int | IndexBehind"]


@dataclass
class _Collected:
    faces: list[Face] = field(default_factory=list)
    parts: list[tuple[int, int]] = field(default_factory=list)

    def add(self, part: Part) -> int:
        start = len(self.faces)
        self.faces += part
        self.parts.append((start, len(self.faces)))
        return len(self.parts) - 1


def mesh_of(chain: Chain) -> Mesh:
    """Make a mesh of parts."""
    collected = _Collected()
    indices = _indexed(chain, collected)
    faces = collected.faces
    counts = [len(face.points) for face in faces]
    return Mesh(
        points=np.concatenate([face.points for face in faces]),
        starts=np.concatenate(([0], np.cumsum(counts))),
        normals=np.array([_normal(face.points) for face in faces]),
        colours=np.array([face.colour for face in faces], dtype=np.float64),
        shines=np.array([face.shines for face in faces]),
        parts=tuple(collected.parts),
        chain=indices,
    )


def part_of(solid: Solid, *on_it: Face) -> Part:
    """Return a prism or frustum as a part, with what is painted on it."""
    low, high = solid.bottom, solid.top
    count = len(low)
    sides = [
        Face(np.array([low[i], low[j], high[j], high[i]]), solid.colour)
        for i, j in ((i, (i + 1) % count) for i in range(count))
    ]
    return (*sides, Face(high, solid.colour), Face(low[::-1], solid.colour), *on_it)


def _normal(points: Floats) -> Floats:
    # Newell: twice the area as seen along each axis, whatever the corners.
    x, y, z = points.T
    u, v, w = np.roll(points, -1, axis=0).T
    area = np.array(((y - v) @ (z + w), (z - w) @ (x + u), (x - u) @ (y + v)))
    length = math.sqrt(float(area @ area))
    outward: Floats = area / length if length > 0.0 else area
    return outward


def _indexed(chain: Chain, collected: _Collected) -> IndexChain:
    found: list[int | IndexBehind] = []
    for link in chain:
        if isinstance(link, Behind):
            what = _index(link.what, collected)
            found.append(IndexBehind(what, link.axis, link.sign, link.limit))
        else:
            found.append(collected.add(link))
    return tuple(found)


def _index(what: "Part | Chain", collected: _Collected) -> int | IndexChain:
    if what and isinstance(what[0], Face):
        return collected.add(tuple(face for face in what if isinstance(face, Face)))
    return _indexed([link for link in what if not isinstance(link, Face)], collected)


def _order(chain: IndexChain, eye: Floats) -> Iterator[int]:
    first: list[int] = []
    later: list[int] = []
    for link in chain:
        if isinstance(link, IndexBehind):
            nested = list(_order(link.what, eye)) if not isinstance(link.what, int) else [link.what]
            if link.sign * float(eye[link.axis]) > link.sign * link.limit:
                later += nested
            else:
                first = nested + first
        else:
            later.append(link)
    yield from first
    yield from later
