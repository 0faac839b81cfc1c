"""The mesh of a car seen by other cars: wheels, shell, cabin, and lamps that are on or off."""

import math
from functools import lru_cache

import numpy as np

from scm.arrays import Floats
from scm.camera.mesh import Behind, Chain, Face, Mesh, Part, mesh_of, part_of
from scm.camera.painter import Thing
from scm.scenery.bodies import CarBody, car_body, car_rotation, colour_of_car
from scm.scenery.canvas import Colour
from scm.scenery.car_shape import RUBBER, shell_of
from scm.v2x.messages.world_snapshot import SnapshotVehicle

WHEEL_CORNERS = 14
HUB: Colour = (150, 152, 154)
LAMP_OFF: dict[str, Colour] = {
    "head": (176, 184, 188), "tail": (34, 28, 104), "left": (40, 84, 128), "right": (40, 84, 128),
    "reverse": (150, 150, 150),
}  # fmt: skip
WHITE: Colour = (235, 250, 255)
AMBER: Colour = (20, 165, 255)
RED: Colour = (60, 50, 255)
DIM_RED: Colour = (40, 34, 190)
X, Y, Z = 0, 1, 2


def car_thing(car: SnapshotVehicle) -> Thing:
    """Return a car at its pose."""
    body = car_body(car.car)
    lamps = frozenset(car.lights)
    mesh = car_mesh(body, colour_of_car(car), round(car.steering_rad, 2), lamps)
    rotation, origin = car_rotation(car), np.array([car.x_m, car.y_m, 0.0])
    middle, radius = _ball(body)
    return Thing(mesh, rotation, origin, origin + rotation @ middle, radius)


def footprint(car: SnapshotVehicle) -> tuple[Floats, float]:
    """Return a car's outline on the floor, (4, 3) [m] in the map, and the height of its deck."""
    body = car_body(car.car)
    (x0, x1), (y0, y1) = body.x_span, body.y_span
    flat = np.array([[x0, y0, 0.0], [x1, y0, 0.0], [x1, y1, 0.0], [x0, y1, 0.0]])
    flat[:, 1] *= 0.9
    placed: Floats = flat @ car_rotation(car).T + (car.x_m, car.y_m, 0.0)
    return placed, 0.62 * body.tag_position[2]


@lru_cache(maxsize=512)
def car_mesh(body: CarBody, colour: Colour, steering: float, lamps: frozenset[str]) -> Mesh:
    """Return the mesh of a car, its parts ordered by the planes between them."""
    solids = shell_of(body, colour)
    front_bumper, rear_bumper, shell = solids[:3]
    cabin, plate, puck, turret = solids[-4:]
    deck = float(shell.top[0, 2])
    inner = float(shell.bottom[:, 1].max())
    front = float(shell.bottom[:, 0].max())
    rear = float(shell.bottom[:, 0].min())
    cabin_end = float(cabin.bottom[:, 0].max())
    roof = float(cabin.top[0, 2])
    top: Chain = (
        part_of(cabin),
        Behind(part_of(plate), Z, 1.0, roof - 0.001),
        Behind((part_of(puck), Behind(part_of(turret), Z, 1.0, roof)), X, 1.0, cabin_end),
    )
    wheels = {side: _wheel_pair(body, steering, side) for side in (1.0, -1.0)}
    return mesh_of((
        part_of(shell),
        Behind(part_of(front_bumper, *_front_lamps(body, front, deck, lamps)), X, 1.0, front),
        Behind(part_of(rear_bumper, *_rear_lamps(body, rear, deck, lamps)), X, -1.0, rear),
        Behind(wheels[1.0], Y, 1.0, inner),
        Behind(wheels[-1.0], Y, -1.0, -inner),
        Behind(top, Z, 1.0, deck),
    ))  # fmt: skip


def _ball(body: CarBody) -> tuple[Floats, float]:
    (x0, x1), half = body.x_span, body.y_span[1]
    middle = np.array([(x0 + x1) / 2, 0.0, body.tag_position[2] / 2])
    return middle, math.hypot((x1 - x0) / 2, half, body.tag_position[2] / 2) + 0.03


def _wheel_pair(body: CarBody, steering: float, side: float) -> Chain:
    rear = _wheel(body, 0.0, side, 0.0)
    front = _wheel(body, body.wheelbase, side, steering)
    return (rear, Behind(front, X, 1.0, body.wheelbase / 2))


def _wheel(body: CarBody, x: float, side: float, turn: float) -> Part:
    """Return a short cylinder across the car with a hub on both sides."""
    around = np.linspace(0.0, 2.0 * math.pi, WHEEL_CORNERS, endpoint=False)
    ring = np.column_stack((np.cos(around), np.zeros(WHEEL_CORNERS), np.sin(around)))
    half = body.wheel_width / 2
    c, s = math.cos(turn), math.sin(turn)
    turned = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    middle = np.array([x, side * body.track / 2, body.wheel_radius])

    def disc(radius: float, y: float) -> Floats:
        placed: Floats = (ring * radius + (0.0, y, 0.0)) @ turned.T + middle
        return placed

    right, left = disc(body.wheel_radius, -half), disc(body.wheel_radius, half)
    tread = [
        Face(np.array([right[i], left[i], left[j], right[j]]), RUBBER)
        for i, j in ((i, (i + 1) % WHEEL_CORNERS) for i in range(WHEEL_CORNERS))
    ]
    hub = 0.55 * body.wheel_radius
    return (
        *tread,
        Face(right, RUBBER),
        Face(left[::-1], RUBBER),
        Face(disc(hub, -half - 0.0005), HUB),
        Face(disc(hub, half + 0.0005)[::-1], HUB),
    )


def _front_lamps(body: CarBody, x: float, deck: float, lamps: frozenset[str]) -> list[Face]:
    half, z, r = 0.78 * body.y_span[1], 0.72 * deck, 0.13 * deck
    shines = 6.0 if "head_high" in lamps else 3.5 if "head_low" in lamps else 0.0
    head = WHITE if shines else LAMP_OFF["head"]
    ahead = x + 0.001
    return [
        *(_disc(ahead, side * 0.62 * half, z, r, 1.0, head, shines) for side in (1.0, -1.0)),
        *(_indicator(name, lamps, ahead, side * 0.9 * half, z, r, 1.0) for name, side in _SIDES),
    ]


def _rear_lamps(body: CarBody, x: float, deck: float, lamps: frozenset[str]) -> list[Face]:
    half, z, r = 0.78 * body.y_span[1], 0.72 * deck, 0.12 * deck
    behind = x - 0.001
    if "brake" in lamps:
        colour, shines = RED, 3.5
    elif "tail" in lamps:
        colour, shines = DIM_RED, 1.6
    else:
        colour, shines = LAMP_OFF["tail"], 0.0
    white = 3.0 if "reverse" in lamps else 0.0
    back = WHITE if white else LAMP_OFF["reverse"]
    return [
        *(_disc(behind, s * 0.66 * half, z, r, -1.0, colour, shines) for s in (1.0, -1.0)),
        *(_disc(behind, s * 0.4 * half, z, 0.7 * r, -1.0, back, white) for s in (1.0, -1.0)),
        *(_indicator(name, lamps, behind, side * 0.9 * half, z, r, -1.0) for name, side in _SIDES),
    ]


_SIDES = (("left", 1.0), ("right", -1.0))


def _indicator(
    name: str, lamps: frozenset[str], x: float, y: float, z: float, r: float, ahead: float
) -> Face:
    shines = 3.5 if name in lamps else 0.0
    return _disc(x, y, z, 0.8 * r, ahead, AMBER if shines else LAMP_OFF[name], shines)


def _disc(
    x: float, y: float, z: float, r: float, ahead: float, colour: Colour, shines: float
) -> Face:
    around = np.linspace(0.0, 2.0 * math.pi, 10, endpoint=False) * ahead
    ring = np.column_stack((np.full(10, x), y + r * np.cos(around), z + r * np.sin(around)))
    return Face(ring, colour, shines)
