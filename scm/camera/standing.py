"""The standing objects of a city: walls, boxes, signal heads, signs."""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from scm.arrays import Floats
from scm.camera.mesh import Behind, Face, Mesh, mesh_of, part_of
from scm.camera.painter import Thing
from scm.maps.signs import SPEED_LIMIT, TURNS
from scm.records.city_map import Box, CityMap, Light, Sign, Wall
from scm.scenery.canvas import Colour, colour_of, dimmed
from scm.scenery.sheet import BRICK, CARDBOARD, wall_pieces
from scm.scenery.solids import prism, rectangle

S = TypeVar("S")
P = TypeVar("P", Light, Sign)

BLOCK_M = 0.2
PANEL_M = 0.4
THINNEST_M = 0.004
STRIPES: tuple[Colour, Colour] = ((236, 240, 242), (44, 52, 196))
POLE: Colour = (70, 72, 74)
HOUSING: Colour = (36, 34, 32)
HEAD_LOW_M, HEAD_HIGH_M = 0.1, 0.196
HEAD_WIDE_M, HEAD_DEEP_M = 0.042, 0.026
LAMP_M = 0.0125
LAMPS: tuple[tuple[str, float, Colour, Colour], ...] = (
    ("red", 0.178, (40, 36, 255), (26, 24, 78)),
    ("yellow", 0.148, (40, 190, 255), (20, 62, 78)),
    ("green", 0.118, (110, 230, 60), (34, 62, 24)),
)
SIGN_M = 0.17
RIM, PAPER, INK = colour_of("#c62f35"), colour_of("#fbfbf8"), colour_of("#23272e")
BLUE = colour_of("#2b5ea8")
UPRIGHT = np.eye(3)
MIDDLE = np.array([0.0, 0.0, 0.1])


class Ball(NamedTuple, Generic[S]):
    """Something that stands, and the ball that holds it [m]."""

    of: S
    middle: tuple[float, float, float]
    radius: float


class Block(NamedTuple):
    """A piece of a wall: its outline on the floor, (4, 2), and its height [m]."""

    foot: Floats
    height: float
    colour: Colour


def wall_balls(city_map: CityMap) -> list[Ball[Block]]:
    """Return the walls as blocks, each of its own shade."""
    balls = []
    for wall in city_map.walls:
        for number, foot in enumerate(_blocks(wall)):
            shade = 1.0 - 0.05 * (number % 2) - 0.03 * (number % 3 == 0)
            block = Block(foot, wall.height_m, dimmed(BRICK, shade))
            x, y = foot.mean(axis=0)
            radius = math.hypot(*(np.ptp(foot, axis=0) / 2), wall.height_m / 2)
            balls.append(Ball(block, (float(x), float(y), wall.height_m / 2), radius))
    return balls


def post_balls(posts: Sequence[P]) -> list[Ball[P]]:
    """Return lights or signs with the balls that hold them."""
    return [Ball(post, (post.x_m, post.y_m, 0.1), 0.13) for post in posts]


def wall_thing(block: Block) -> Thing:
    """Return a block of a wall."""
    solid = prism(block.foot, 0.0, block.height, block.colour)
    return _thing(mesh_of((part_of(solid),)), block.foot, block.height)


@lru_cache(maxsize=256)
def box_thing(box: Box) -> Thing:
    """Return a construction box with its red and white band."""
    foot = rectangle(box.x_m, box.y_m, box.length_m, box.width_m, box.yaw_rad)
    solid = prism(foot, 0.0, box.height_m, CARDBOARD)
    band = [face for i in range(4) for face in _band(foot[i], foot[(i + 1) % 4], box.height_m)]
    return _thing(mesh_of((part_of(solid, *band),)), foot, box.height_m)


def box_shadow(box: Box) -> Floats:
    """Return the corners of a box, foot and top, (8, 3) [m]."""
    foot = rectangle(box.x_m, box.y_m, box.length_m, box.width_m, box.yaw_rad)
    return np.concatenate([np.column_stack((foot, np.full(4, z))) for z in (0.0, box.height_m)])


def light_thing(light: Light, shown: str | None) -> Thing:
    """Return a signal head on its pole.

    Args:
        light: Where it stands.
        shown: The lamp that is on: `red`, `yellow`, `green`; None: dark.
    """
    return _head(light.x_m, light.y_m, light.yaw_rad, shown)


def sign_thing(sign: Sign) -> Thing:
    """Return a traffic sign on its pole."""
    face = _sign_face(sign.kind)
    pole = prism(rectangle(-0.006, 0.0, 0.007, 0.007), 0.0, SIGN_M + 0.01, POLE)
    rotation = _turn(sign.yaw_rad)
    origin = np.array([sign.x_m, sign.y_m, 0.0])
    back = Face(face[0].points[::-1] - (0.001, 0.0, 0.0), (120, 122, 124))
    mesh = mesh_of((part_of(pole), Behind((*face, back), 0, 1.0, -0.002)))
    return Thing(mesh, rotation, origin, origin + MIDDLE, 0.12)


@lru_cache(maxsize=1024)
def _head(x: float, y: float, yaw: float, shown: str | None) -> Thing:
    pole = prism(rectangle(0.0, 0.0, 0.009, 0.009), 0.0, HEAD_LOW_M, POLE)
    foot = prism(rectangle(0.0, 0.0, 0.03, 0.03), 0.0, 0.012, HOUSING)
    outline = rectangle(0.0, 0.0, HEAD_DEEP_M, HEAD_WIDE_M)
    housing = prism(outline, HEAD_LOW_M, HEAD_HIGH_M, HOUSING)
    lamps = [_lamp(z, on if shown == name else off, shown == name) for name, z, on, off in LAMPS]
    mesh = mesh_of((
        part_of(foot),
        Behind(part_of(pole), 2, 1.0, 0.012),
        Behind(part_of(housing, *lamps), 2, 1.0, HEAD_LOW_M),
    ))  # fmt: skip
    origin = np.array([x, y, 0.0])
    return Thing(mesh, _turn(yaw), origin, origin + MIDDLE, 0.13)


def _lamp(z: float, colour: Colour, is_on: bool) -> Face:
    around = np.linspace(0.0, 2.0 * math.pi, 16, endpoint=False)
    ring = np.column_stack(
        (
            np.full(16, HEAD_DEEP_M / 2 + 0.0005),
            LAMP_M * np.cos(around),
            z + LAMP_M * np.sin(around),
        )
    )
    return Face(ring, colour, 3.2 if is_on else 0.0)


def _sign_face(kind: str) -> tuple[Face, ...]:
    """Return the faces of a sign that looks along x, its border first."""
    if kind == "stop":
        angles = np.radians(22.5 + 45.0 * np.arange(8))
        bar = np.array([[-0.03, -0.008], [0.03, -0.008], [0.03, 0.008], [-0.03, 0.008]])
        octagon = np.column_stack((np.cos(angles), np.sin(angles)))
        return _layers((octagon * 0.052, PAPER), (octagon * 0.046, RIM), (bar, PAPER))
    if kind in TURNS or kind == SPEED_LIMIT:
        return _round_face(kind)
    up = -1.0 if kind == "give_way" else 1.0
    triangle = np.array([[-0.052, -0.036], [0.052, -0.036], [0.0, 0.054]]) * (1.0, up)
    triangle = triangle if up > 0 else triangle[::-1]
    middle = triangle.mean(axis=0)
    inside = middle + 0.68 * (triangle - middle)
    if kind not in ("left_curve", "right_curve"):
        return _layers((triangle, RIM), (inside, PAPER))
    # From the front y runs to the right of who looks at the sign: a left bend goes to -y there.
    side = -1.0 if kind == "left_curve" else 1.0
    shaft = np.array([[-0.005, -0.024], [0.005, -0.024], [0.005, 0.002], [-0.005, 0.002]])
    arm = np.array([[0.005, 0.008], [-0.014, 0.008], [-0.014, -0.002], [0.005, -0.002]])
    tip = np.array([[-0.012, 0.014], [-0.026, 0.003], [-0.012, -0.008]])
    if side > 0:
        arm, tip = arm[::-1] * (-1.0, 1.0), tip[::-1] * (-1.0, 1.0)
    return _layers((triangle, RIM), (inside, PAPER), (shaft, INK), (arm, INK), (tip, INK))


def _round_face(kind: str) -> tuple[Face, ...]:
    """Return a round sign: a red rim, or blue if it orders a direction, with its arrow."""
    angles = np.arange(16) * math.pi / 8.0
    circle = np.column_stack((np.cos(angles), np.sin(angles)))
    if kind == SPEED_LIMIT:
        bar = np.array([[-0.02, -0.006], [0.02, -0.006], [0.02, 0.006], [-0.02, 0.006]])
        return _layers((circle * 0.052, RIM), (circle * 0.038, PAPER), (bar, INK))
    rule, way = kind.split("_")
    rim, ground, ink = (PAPER, BLUE, PAPER) if rule == "only" else (RIM, PAPER, INK)
    shaft = np.array([[-0.005, -0.026], [0.005, -0.026], [0.005, 0.01], [-0.005, 0.01]])
    tip = np.array([[-0.016, 0.008], [0.016, 0.008], [0.0, 0.03]])
    turn = {"left": math.pi / 2.0, "right": -math.pi / 2.0, "straight": 0.0}[way]
    cos, sin = math.cos(turn), math.sin(turn)
    matrix = np.array([[cos, sin], [-sin, cos]])
    arrow = [(shaft @ matrix, ink), (tip @ matrix, ink)]
    return _layers((circle * 0.052, rim), (circle * 0.044, ground), *arrow)


def _layers(*flat: tuple[Floats, Colour]) -> tuple[Face, ...]:
    """Return flat polygons (n, 2), right and up as seen by who looks at them, one on the other."""
    faces = []
    for i, (points, colour) in enumerate(flat):
        upright = (np.full(len(points), 1e-4 * i), points[:, 0], points[:, 1] + 0.15)
        faces.append(Face(np.column_stack(upright), colour))
    return tuple(faces)


def _band(start: Floats, end: Floats, height: float) -> list[Face]:
    """Return a white band with slanting red stripes on a side of a box."""
    low, high = 0.62 * height, 0.86 * height
    along = end - start
    length = float(np.hypot(*along))
    out = np.array([along[1], -along[0]]) / length * 0.0003

    def at(share: float, z: float) -> tuple[float, float, float]:
        x, y = start + along * min(1.0, max(0.0, share)) + out
        return float(x), float(y), z

    white, red = STRIPES
    faces = [Face(np.array([at(0, low), at(1, low), at(1, high), at(0, high)]), white)]
    count = max(2, round(length / 0.06))
    slant = 0.3 / count
    for k in range(count):
        a, b = (k + 0.1) / count, (k + 0.55) / count
        corners = [at(a, low), at(b, low), at(b + slant, high), at(a + slant, high)]
        faces.append(Face(np.array(corners), red))
    return faces


def _blocks(wall: Wall) -> list[Floats]:
    """Return the outlines of a wall's blocks: long walls are cut so that each has one distance."""
    thick = max(wall.thickness_m, THINNEST_M)
    each = BLOCK_M if thick > BLOCK_M / 2 else PANEL_M
    blocks = []
    for piece in wall_pieces(wall):
        middle = piece.mean(axis=0)
        along = piece[1] - piece[0]
        length = float(np.hypot(*along))
        yaw = math.atan2(along[1], along[0])
        count = max(1, round(length / each))
        for k in range(count):
            x, y = middle + along * ((k + 0.5) / count - 0.5)
            blocks.append(rectangle(x, y, length / count + 0.002, thick, yaw))
    return blocks


def _thing(mesh: Mesh, foot: Floats, height: float) -> Thing:
    middle = np.array([*foot.mean(axis=0), height / 2])
    radius = math.hypot(*(np.ptp(foot, axis=0) / 2), height / 2)
    return Thing(mesh, UPRIGHT, np.zeros(3), middle, radius)


def _turn(yaw: float) -> Floats:
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
