"""The contact step beside plain pymunk with all bodies in its space, both through its batch calls.

Run with `python -m bench contacts`, or with `python -m bench.contacts [cars ...]`. `streets`: cars
a metre apart drive along walls and touch nothing, but for one in a hundred that rubs along a wall;
`jam`: they stand bumper to bumper, three abreast, and push. Times are processor times of one
thread. The share is that of one core at 200 Hz.
"""

import math
import sys
import time
from collections.abc import Callable

import numpy as np
import pymunk
from pymunk import batch

from scm.arrays import Floats
from scm.records.city_map import CityMap, MapTag, Wall
from scm.records.floor import Floor
from scm.world.contact_groups import ITERATIONS
from scm.world.contact_space import INSTANT
from scm.world.contacts import Contacts
from scm.world.solids import Hull, car_body, solid_shape, solids

HULL = Hull(2.4, 0.0229, -0.14, 0.16, -0.0875, 0.0875, restitution=0.2, friction=0.5)
SIZES = (100, 1000, 10_000)
RATE_HZ = 200
STEPS, LONGEST_S = 100, 1.0
LANE_M, GAP_M = 0.5, 1.0
MOTION = (
    batch.BodyFields.POSITION
    | batch.BodyFields.ANGLE
    | batch.BodyFields.VELOCITY
    | batch.BodyFields.ANGULAR_VELOCITY
)


def city_of(walls: list[Wall]) -> CityMap:
    return CityMap(
        map=1,
        name="rows",
        title="Rows",
        source="made for this measurement",
        floor=Floor(x_m=(-1.0, 1.0), y_m=(-1.0, 1.0)),
        tag=MapTag(tag_id=0, size_m=0.1),
        walls=tuple(walls),
    )


def streets(cars: int) -> tuple[CityMap, Floats]:
    """Return streets of cars a metre apart with a wall on both sides, and their motion."""
    a_street = math.ceil(math.sqrt(cars))
    i = np.arange(cars)
    motion = np.zeros((cars, 6))
    motion[:, 0] = GAP_M * (i % a_street)
    motion[:, 1] = LANE_M * (i // a_street)
    motion[:, 3] = 0.25
    motion[::100, 1] += 0.5 * LANE_M - HULL.left - 0.0025 + 0.0005
    walls = [
        Wall(
            points=tuple((GAP_M * k - 1.0, LANE_M * (row + 0.5)) for k in range(a_street + 8)),
            thickness_m=0.005,
        )
        for row in range(-1, math.ceil(cars / a_street))
    ]
    return city_of(walls), motion


def jam(cars: int) -> tuple[CityMap, Floats]:
    """Return columns of cars that push into the one before them and graze their neighbours."""
    i = np.arange(cars)
    motion = np.zeros((cars, 6))
    motion[:, 0] = (HULL.front - HULL.rear - 3e-4) * (i // 3)
    motion[:, 1] = (HULL.left - HULL.right - 2e-4) * (i % 3)
    motion[:, 3] = np.random.default_rng(1).uniform(0.0, 0.01, cars)
    end = motion[-1, 0] + HULL.front
    return city_of([Wall(points=((end, -1.0), (end, 1.0)), thickness_m=0.005)]), motion


def mean_timed(work: Callable[[int], object]) -> float:
    """Return the mean processor time of a step [ms] over half a second or so, lists included."""
    work(0)
    first = time.thread_time()
    work(1)
    steps = max(3, min(STEPS, int(LONGEST_S / max(time.thread_time() - first, 1e-9))))
    start = time.thread_time()
    for step in range(2, 2 + steps):
        work(step)
    return (time.thread_time() - start) * 1e3 / steps


def at(motion: Floats, step: int, *, moving: bool) -> Floats:
    there = motion.copy()
    if moving:
        there[:, :2] += motion[:, 3:5] * step / RATE_HZ
    return there


def ours(
    city_map: CityMap, motion: Floats, *, moving: bool
) -> tuple[Callable[[int], object], list[int]]:
    contacts = Contacts(city_map)
    rows = np.arange(len(motion))
    for row in rows.tolist():
        contacts.add(row, HULL)
    seen: list[int] = []

    def step(k: int) -> None:
        seen.append(len(contacts.step(rows, at(motion, k, moving=moving)).pairs))

    return step, seen


def plain(city_map: CityMap, motion: Floats, *, moving: bool) -> Callable[[int], object]:
    """Return the peer's step: every car in one space, written, solved and read by batch calls."""
    space = pymunk.Space()
    space.iterations = ITERATIONS
    space.add(*(solid_shape(space.static_body, solid) for solid in solids(city_map)))
    for x, y, yaw in motion[:, :3].tolist():
        body = car_body(HULL)
        body.position, body.angle = (x, y), yaw
        space.add(body, *body.shapes)
    into, out = batch.Buffer(), batch.Buffer()
    block = np.zeros((len(motion) + 1, 6))

    def step(k: int) -> None:
        block[:-1] = at(motion, k, moving=moving)
        into.set_float_buf(block)
        batch.set_space_bodies(space, MOTION, into)
        space.step(INSTANT)
        out.clear()
        batch.get_space_bodies(space, MOTION, out)
        np.frombuffer(out.float_buf()).reshape(-1, 6)

    return step


def main(sizes: tuple[int, ...] = SIZES) -> None:
    """Print the table."""
    print(" " * 11 + "cars  pairs  ours ms  ns a car   core  pymunk ms  ratio")
    for name, scene in (("streets", streets), ("jam", jam)):
        for cars in sizes:
            city_map, motion = scene(cars)
            moving = name == "streets"
            step, seen = ours(city_map, motion, moving=moving)
            mine = mean_timed(step)
            peer = mean_timed(plain(city_map, motion, moving=moving))
            print(
                f"{name:8} {cars:>6} {seen[-1]:>6} {mine:>8.3f} {mine / cars * 1e6:>9.0f} "
                f"{mine * RATE_HZ / 1e3:>6.1%} {peer:>10.3f} {peer / mine:>6.1f}"
            )


if __name__ == "__main__":
    main(tuple(int(word) for word in sys.argv[1:]) or SIZES)
