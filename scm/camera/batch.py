"""Small grey pictures from many cars at once, by one compiled kernel, as training needs them.

The floor, the meshes, the lens and the light are those of the city's own cameras (`studio`). Here
faces are drawn into a depth buffer twice as fine as the picture, and the floor is sampled where no
face is, by the mean of several places where a pixel is deep. Left out are shadows of cars and
boxes, lamps that are on, turned wheels, and what the sensor adds; bodies stand level.
"""

import math
from collections.abc import Iterable

import cv2
import numpy as np
from numpy.typing import NDArray

from scm.arrays import Bools, Floats, Ints
from scm.camera.car_mesh import car_mesh
from scm.camera.daylight import Daylight
from scm.camera.floor import LEVELS, whole_floor
from scm.camera.lens import Lens
from scm.camera.mesh import Mesh
from scm.camera.optics import Optics
from scm.camera.painter import NEAREST_M
from scm.camera.standing import (
    box_thing,
    light_thing,
    post_balls,
    sign_thing,
    wall_balls,
    wall_thing,
)
from scm.camera.studio import SKY_HIGH, SKY_LOW, SKY_RAD
from scm.records.city_map import CityMap
from scm.scenery.bodies import PAINT, CarBody
from scm.vehicles.array_struct import ArrayStruct
from scm.vehicles.jit import array_kernel, kernel_function

Grey = NDArray[np.float32]
FINER = 2  # the canvas than the picture, each way
TEXELS_PER_M = (
    250.0  # of the floor: a pixel of 48 covers as much at the bottom of a Nigel's picture
)
DEEPEST = 3  # places of which a floor pixel is the mean
ON_IT = 2e-3  # a face that is less behind another than this share of its distance lies on it
LOWEST = 1e-3  # a ray that sinks less than this in a metre of depth sees the sky
CORNERS = 40  # of a clipped face, at most
GREY = np.array([0.114, 0.587, 0.299]) / 255.0  # of blue, green, red


class Faces(ArrayStruct):
    """Meshes of things, one after the other.

    Attributes:
        points: Corners of all faces, (p, 3) [m].
        starts: Where each face's corners begin, (f + 1,).
        normals: Unit vectors outwards, (f, 3).
        greys: (f,), in full light.
        balls: Middle and radius of what holds each thing, (t, 4) [m].
        firsts: Where each thing's faces begin, (t + 1,).
    """

    points: Floats
    starts: Ints
    normals: Floats
    greys: Floats
    balls: Floats
    firsts: Ints


class Ground(ArrayStruct):
    """The floor from above at several sizes.

    Attributes:
        texels: All sizes, row by row, one after the other.
        levels: Where each size begins, its width and its height, (levels, 3).
        place: Left and upper edge [m], texels per metre of the finest, and the texel beyond it.
    """

    texels: NDArray[np.uint8]
    levels: Ints
    place: Floats


class Eye(ArrayStruct):
    """The camera on its car, and the light.

    Attributes:
        mount: Turns body directions into camera directions, (3, 3).
        at: Of the optical centre, body frame, (3,) [m].
        lens: Focal length, middle across and down [px of the canvas]; reach across and down.
        pixels: Numbers of the canvas pixels that each pixel of the picture shows, (pixels, n).
        light: Unit vector to the sun, share of ambient light; sky low and high, (6,).
    """

    mount: Floats
    at: Floats
    lens: Floats
    pixels: Ints
    light: Floats


class BatchCamera:
    """One camera on every car of many, all of one kind.

    Args:
        city_map: Where they drive.
        optics: Of the camera.
        body: Of the cars, all painted alike.
        width_px: Of a picture.
        daylight: The light.

    Attributes:
        width_px, height_px: Of a picture.
    """

    def __init__(
        self, city_map: CityMap, optics: Optics, body: CarBody, width_px: int,
        daylight: Daylight | None = None,
    ) -> None:  # fmt: skip
        daylight = daylight or Daylight()
        small = optics.of_width(width_px)
        self.width_px, self.height_px = small.width_px, small.height_px
        lens = Lens(optics.of_width(FINER * width_px))
        self._size = lens.canvas_size
        self._eye = _eye_of(lens, small, daylight)
        self._ground = _ground_of(city_map, daylight)
        self._still = _faces_of(_standing(city_map))
        mesh = car_mesh(body, PAINT["hosted"], 0.0, frozenset())
        self._car = _faces_of([(mesh, np.eye(3), np.zeros(3))])

    def render(self, cars: Ints, others: Ints, poses: Floats, alive: Bools, pictures: Grey) -> None:
        """Write the pictures that some cars take.

        Args:
            cars: Rows, (n,).
            others: Rows of the cars that each sees, (n, k); itself it does not see.
            poses: Of all cars, (cars, 3): x, y, yaw of the rear axle.
            alive: Which of them there are, (cars,).
            pictures: (cars, height * width), grey 0 to 1, rows from the top; those of `cars` are
                written.
        """
        width, height = self._size
        _render(
            self._eye, self._ground, self._still, self._car, width, height, cars, others, poses,
            alive, pictures,
        )  # fmt: skip


Placed = tuple[Mesh, Floats, Floats]


def _standing(city_map: CityMap) -> Iterable[Placed]:
    things = [
        *(wall_thing(ball.of) for ball in wall_balls(city_map)),
        *(box_thing(box) for box in city_map.boxes),
        *(sign_thing(ball.of) for ball in post_balls(city_map.signs)),
        *(light_thing(ball.of, None) for ball in post_balls(city_map.lights)),
    ]
    return ((thing.mesh, thing.rotation, thing.origin) for thing in things)


def _faces_of(placed: Iterable[Placed]) -> Faces:
    points, normals, greys, starts, firsts = [np.empty((0, 3))], [np.empty((0, 3))], [], [0], [0]
    balls = []
    for mesh, rotation, origin in placed:
        corners, outward = mesh.placed(rotation, origin)
        middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
        balls.append([*middle, np.linalg.norm(corners - middle, axis=1).max()])
        starts += (starts[-1] + mesh.starts[1:]).tolist()
        firsts.append(firsts[-1] + len(outward))
        points.append(corners)
        normals.append(outward)
        greys.append(mesh.colours @ GREY)
    return Faces(
        np.concatenate(points), np.array(starts), np.concatenate(normals),
        np.concatenate([np.empty(0), *greys]), np.array(balls).reshape(-1, 4), np.array(firsts),
    )  # fmt: skip


def _ground_of(city_map: CityMap, daylight: Daylight) -> Ground:
    drawing = whole_floor(city_map, daylight, TEXELS_PER_M)
    greys = [np.rint(level @ (255.0 * GREY)).astype(np.uint8) for level in drawing.levels]
    firsts = np.cumsum([0, *(grey.size for grey in greys)])
    levels = [
        (int(first), *grey.shape[::-1]) for first, grey in zip(firsts[:-1], greys, strict=True)
    ]
    beyond = 255.0 * float(np.array(drawing.beyond) @ GREY)
    place = (*drawing.corner, drawing.texels_per_m, beyond)
    return Ground(
        np.concatenate([grey.ravel() for grey in greys]), np.array(levels), np.array(place)
    )


def _eye_of(lens: Lens, small: Optics, daylight: Daylight) -> Eye:
    view, (width, height), k = (
        lens.view(np.eye(3), np.zeros(3)),
        lens.canvas_size,
        lens.canvas_matrix,
    )
    f, middle_x, middle_y = k[0, 0], k[0, 2], k[1, 2]
    reach = max(middle_x, width - middle_x) / f, max(middle_y, height - middle_y) / f
    x, y = np.meshgrid(np.arange(FINER * small.width_px), np.arange(FINER * small.height_px))
    seen = np.stack((x, y), axis=-1).reshape(-1, 1, 2).astype(np.float64)
    ideal = np.asarray(cv2.undistortPoints(seen, lens.matrix, lens.distortion))[:, 0]
    at = np.rint(ideal * f + (middle_x, middle_y)).astype(np.int64)
    at = np.clip(at, 0, (width - 1, height - 1)) @ (1, width)
    shape = small.height_px, FINER, small.width_px, FINER
    pixels = at.reshape(shape).transpose(0, 2, 1, 3).reshape(-1, FINER * FINER)
    sky = [float(np.array(colour) @ GREY) for colour in (SKY_LOW, SKY_HIGH)]
    return Eye(
        np.ascontiguousarray(view.camera_R_map), np.array(view.position),
        np.array([f, middle_x, middle_y, *reach]), np.ascontiguousarray(pixels),
        np.array([*daylight.sun, daylight.ambient, *sky]),
    )  # fmt: skip


@array_kernel
def _render(
    eye: Eye, ground: Ground, still: Faces, car: Faces, width: int, height: int, cars: Ints,
    others: Ints, poses: Floats, alive: Bools, pictures: Grey,
) -> None:  # fmt: skip
    near, canvas = np.empty((height, width)), np.empty((height, width))
    turn, at = np.empty((3, 3)), np.empty(3)
    ring, clipped = np.empty((CORNERS, 3)), np.empty((CORNERS, 3))
    for n in range(len(cars)):
        row = cars[n]
        x, y, yaw = poses[row, 0], poses[row, 1], poses[row, 2]
        c, s = math.cos(yaw), math.sin(yaw)
        for i in range(3):
            turn[i, 0] = eye.mount[i, 0] * c - eye.mount[i, 1] * s
            turn[i, 1] = eye.mount[i, 0] * s + eye.mount[i, 1] * c
            turn[i, 2] = eye.mount[i, 2]
        at[0] = x + c * eye.at[0] - s * eye.at[1]
        at[1] = y + s * eye.at[0] + c * eye.at[1]
        at[2] = eye.at[2]
        near[:] = 0.0
        _draw(eye, turn, at, still, 0.0, 0.0, 1.0, 0.0, ring, clipped, near, canvas)
        for other in others[n]:
            if other != row and alive[other]:
                c, s = math.cos(poses[other, 2]), math.sin(poses[other, 2])
                _draw(
                    eye, turn, at, car, poses[other, 0], poses[other, 1], c, s, ring, clipped, near,
                    canvas,
                )  # fmt: skip
        _fill_rest(eye, ground, turn, at, near, canvas)
        for pixel in range(len(eye.pixels)):
            total = 0.0
            for number in eye.pixels[pixel]:
                total += canvas[number // width, number % width]
            pictures[row, pixel] = total / eye.pixels.shape[1]


@kernel_function
def _draw(
    eye: Eye, turn: Floats, at: Floats, faces: Faces, x: float, y: float, c: float, s: float,
    ring: Floats, clipped: Floats, near: Floats, canvas: Floats,
) -> None:  # fmt: skip
    """Draw what things at a pose show of themselves: those faces that look at the camera."""
    dx, dy = at[0] - x, at[1] - y
    own_x, own_y = c * dx + s * dy, c * dy - s * dx  # the camera in the things' frame
    wide, high = math.hypot(1.0, eye.lens[3]), math.hypot(1.0, eye.lens[4])
    for thing in range(len(faces.balls)):
        ball = faces.balls[thing]
        bx, by, bz = ball[0] - own_x, ball[1] - own_y, ball[2] - at[2]
        mx, my = c * bx - s * by, s * bx + c * by
        a = turn[0, 0] * mx + turn[0, 1] * my + turn[0, 2] * bz
        b = turn[1, 0] * mx + turn[1, 1] * my + turn[1, 2] * bz
        z = turn[2, 0] * mx + turn[2, 1] * my + turn[2, 2] * bz
        if (
            z < NEAREST_M - ball[3]
            or abs(a) > eye.lens[3] * z + ball[3] * wide
            or abs(b) > eye.lens[4] * z + ball[3] * high
        ):
            continue
        for face in range(faces.firsts[thing], faces.firsts[thing + 1]):
            first, normal = faces.points[faces.starts[face]], faces.normals[face]
            away = (own_x - first[0]) * normal[0] + (own_y - first[1]) * normal[1]
            away += (at[2] - first[2]) * normal[2]
            if away <= 0.0:
                continue
            count = faces.starts[face + 1] - faces.starts[face]
            for k in range(count):
                point = faces.points[faces.starts[face] + k]
                bx, by, bz = point[0] - own_x, point[1] - own_y, point[2] - at[2]
                mx, my = c * bx - s * by, s * bx + c * by
                for i in range(3):
                    ring[k, i] = turn[i, 0] * mx + turn[i, 1] * my + turn[i, 2] * bz
            nx, ny, nz = c * normal[0] - s * normal[1], s * normal[0] + c * normal[1], normal[2]
            sunny = nx * eye.light[0] + ny * eye.light[1] + nz * eye.light[2]
            light = eye.light[3] + (1.0 - eye.light[3]) * max(0.0, sunny) / eye.light[2]
            # 1 / depth over the canvas: the face's plane, seen from the lens
            p = -(turn[0, 0] * nx + turn[0, 1] * ny + turn[0, 2] * nz) / away
            q = -(turn[1, 0] * nx + turn[1, 1] * ny + turn[1, 2] * nz) / away
            r = -(turn[2, 0] * nx + turn[2, 1] * ny + turn[2, 2] * nz) / away
            left = _clip(ring, count, clipped)
            _fill(eye, clipped, left, p, q, r, min(1.0, light * faces.greys[face]), near, canvas)


@kernel_function
def _clip(ring: Floats, count: int, clipped: Floats) -> int:
    """Clip a polygon in the camera's frame at the near plane; return its corners' number."""
    left = 0
    for k in range(count):
        here, there = ring[k], ring[(k + 1) % count]
        if here[2] >= NEAREST_M:
            for i in range(3):
                clipped[left, i] = here[i]
            left += 1
        if (here[2] >= NEAREST_M) != (there[2] >= NEAREST_M):
            share = (NEAREST_M - here[2]) / (there[2] - here[2])
            for i in range(3):
                clipped[left, i] = here[i] + share * (there[i] - here[i])
            left += 1
    return left


@kernel_function
def _fill(
    eye: Eye, ring: Floats, count: int, p: float, q: float, r: float, grey: float, near: Floats,
    canvas: Floats,
) -> None:  # fmt: skip
    """Fill a convex polygon where nothing is nearer; 1 / depth is p a + q b + r."""
    f, middle_x, middle_y = eye.lens[0], eye.lens[1], eye.lens[2]
    height, width = near.shape
    low, high = math.inf, -math.inf
    for k in range(count):
        ring[k, 0] = f * ring[k, 0] / ring[k, 2] + middle_x
        ring[k, 1] = f * ring[k, 1] / ring[k, 2] + middle_y
        low, high = min(low, ring[k, 1]), max(high, ring[k, 1])
    if count < 3 or high < 0.0 or low > height - 1.0:
        return
    for y in range(max(0, math.ceil(low)), min(height - 1, math.floor(high)) + 1):
        begin, end = math.inf, -math.inf
        for k in range(count):
            here, there = ring[k], ring[(k + 1) % count]
            if (here[1] <= y) != (there[1] <= y):
                x = here[0] + (y - here[1]) / (there[1] - here[1]) * (there[0] - here[0])
                begin, end = min(begin, x), max(end, x)
        if end < 0.0 or begin > width - 1.0:
            continue
        for x in range(max(0, math.ceil(begin)), min(width - 1, math.floor(end)) + 1):
            close = p * (x - middle_x) / f + q * (y - middle_y) / f + r
            if close >= (1.0 - ON_IT) * near[y, x]:
                near[y, x], canvas[y, x] = close, grey


@kernel_function
def _fill_rest(
    eye: Eye, ground: Ground, turn: Floats, at: Floats, near: Floats, canvas: Floats
) -> None:  # fmt: skip
    """Fill what no face covers: with the floor below the horizon, else with the sky."""
    f, (height, width) = eye.lens[0], near.shape
    for y in range(height):
        b, a = (y - eye.lens[2]) / f, (0.5 * width - eye.lens[1]) / f
        dz = turn[0, 2] * a + turn[1, 2] * b + turn[2, 2]
        count, level = _sampling(ground, at[2], f, min(dz, -LOWEST))
        for x in range(width):
            if near[y, x] > 0.0:
                continue
            a = (x - eye.lens[1]) / f
            dx = turn[0, 0] * a + turn[1, 0] * b + turn[2, 0]
            dy = turn[0, 1] * a + turn[1, 1] * b + turn[2, 1]
            dz = turn[0, 2] * a + turn[1, 2] * b + turn[2, 2]
            if dz < -LOWEST:
                canvas[y, x] = _floor(ground, turn, at, f, dx, dy, dz, count, level)
            else:
                share = min(1.0, max(0.0, dz) / SKY_RAD)
                canvas[y, x] = eye.light[4] + share * (eye.light[5] - eye.light[4])


@kernel_function
def _sampling(ground: Ground, high: float, f: float, dz: float) -> tuple[int, int]:
    """Return of how many places a floor pixel of a row is the mean, and in which size."""
    across = high / -dz / f
    deep = across / -dz  # straight ahead
    count = min(DEEPEST, max(1, math.ceil(deep / across - 0.5)))
    size = math.sqrt(across * max(across, deep / count)) * ground.place[2]
    return count, min(LEVELS - 1, max(0, math.floor(math.log2(size))))


@kernel_function
def _floor(
    ground: Ground, turn: Floats, at: Floats, f: float, dx: float, dy: float, dz: float,
    count: int, level: int,
) -> float:  # fmt: skip
    """Return the floor's grey where a ray (dx, dy, dz) of depth 1 meets it."""
    steep = 1.0 / dz
    depth, down = -at[2] * steep, turn[1, 2] * steep
    first, width, height = ground.levels[level, 0], ground.levels[level, 1], ground.levels[level, 2]
    per_m = ground.place[2] / (1 << level)
    # texels of this size, whose first is centred where the finest has its first
    middle = 0.5 - 0.5 / (1 << level)
    i = (at[0] + depth * dx - ground.place[0]) * per_m + middle
    j = (ground.place[1] - at[1] - depth * dy) * per_m + middle
    # by how much the place moves from one row to the next
    part = depth * per_m / (f * count)
    more_i, more_j = part * (turn[1, 0] - dx * down), part * (dy * down - turn[1, 1])
    i, j = i - 0.5 * (count - 1) * more_i, j - 0.5 * (count - 1) * more_j
    total = 0.0
    for _ in range(count):
        if 0.0 <= i < width and 0.0 <= j < height:
            total += ground.texels[first + int(j) * width + int(i)]
        else:
            total += ground.place[3]
        i, j = i + more_i, j + more_j
    return float(total / (255.0 * count))
