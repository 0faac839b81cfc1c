"""A tick of the world beside its limit, the 20 ms it may take, and its contact stage beside a peer.

Run with `python -m bench world`, or with `python -m bench.world [cars ...]`. Cars drive rounds of
four in walled blocks, with drivers, contacts, LIDAR, encoders, IMU and radio. The contact stage's
peer is pymunk as its manual shows it, poses and velocities set and read by attribute. All times
are processor times of the one thread that a world is.
"""

import math
import statistics
import sys
import time
from collections.abc import Callable, Sequence

import pymunk

from scm.maps.segments import wall_segments
from scm.records.city_map import CityMap, Lane, MapTag, Segment, Wall
from scm.records.floor import Floor
from scm.v2x.message import Message, encode
from scm.v2x.messages.route_request import RouteRequest
from scm.world import step
from scm.world.collide import everybody
from scm.world.driving import send
from scm.world.step import tick
from scm.world.world import PERIOD_NS, World

RADIUS, BLOCK, CARS_A_BLOCK = 0.7, 2.0, 4
WARM_TICKS, TICKS = 60, 100
SIZES = (6, 100, 1000)
LIMIT_MS = PERIOD_NS / 1e6
STAGES = ("receive", "steer", "move", "watch", "sense", "publish", "send_radio")


def city_of(blocks: int) -> CityMap:
    side = math.ceil(math.sqrt(blocks))
    lanes, walls = [], []
    for i in range(blocks):
        x, y = BLOCK * (i % side), BLOCK * (i // side)
        whole_turn = (Segment(radius_m=RADIUS, angle_rad=2.0 * math.pi),)
        lanes.append(
            Lane(
                name=f"block{i}",
                width_m=0.26,
                start=(x, y - RADIUS, 0.0),
                segments=whole_turn,
                next=(f"block{i}",),
                speed_limit_mps=0.25,
            )
        )
        half = 0.49 * BLOCK
        corners = ((-half, -half), (half, -half), (half, half), (-half, half))
        walls.append(Wall(points=tuple((x + a, y + b) for a, b in corners), closed=True))
    extent = (-BLOCK, BLOCK * side)
    return CityMap(
        map=1,
        name="blocks",
        title="Blocks",
        source="made for this measurement",
        floor=Floor(x_m=extent, y_m=extent),
        tag=MapTag(tag_id=0, size_m=0.1),
        lanes=tuple(lanes),
        walls=tuple(walls),
        radio_range_m=4.0,
    )


def world_of(cars: int) -> World:
    world = World(city_of(math.ceil(cars / CARS_A_BLOCK)), capacity=cars)
    for i in range(cars):
        lane = world.roads.lanes[f"block{i // CARS_A_BLOCK}"]
        pose = lane.at(lane.length_m * (i % CARS_A_BLOCK) / CARS_A_BLOCK)
        car = world.host(f"n{i}", "nigel", pose, 0)
        send(world, car, RouteRequest(vehicle=car.name), 0)
    return world


def timed(work: Callable[[], object], times: int) -> float:
    """Return the median processor time of a call [ms]: neighbours on the machine do not count."""
    spans = []
    for _ in range(times):
        start = time.thread_time()
        work()
        spans.append((time.thread_time() - start) * 1e3)
    return statistics.median(spans)


class Stages:
    """Adds up what each stage of a tick takes, by standing in for its name in `step`."""

    def __init__(self) -> None:
        self.spent_ms = dict.fromkeys(STAGES, 0.0)
        for name in STAGES:
            setattr(step, name, self._timed(name, getattr(step, name)))

    def _timed(self, name: str, stage: Callable[..., object]) -> Callable[..., object]:
        def call(*given: object) -> object:
            start = time.thread_time()
            try:
                return stage(*given)
            finally:
                self.spent_ms[name] += (time.thread_time() - start) * 1e3

        return call


def by_attribute(world: World) -> Callable[[], object]:
    """Return the peer's contact step: the same bodies, moved and read one attribute at a time."""
    _, motion = everybody(world.cars, 0)
    space = pymunk.Space()
    bodies = []
    for _ in motion:
        body = pymunk.Body(2.4, 0.0229)
        space.add(body, pymunk.Poly.create_box(body, (0.3, 0.175)))
        bodies.append(body)
    for x0, y0, x1, y1 in wall_segments(world.city_map).tolist():
        space.add(pymunk.Segment(space.static_body, (x0, y0), (x1, y1), 0.001))
    rows = motion.tolist()

    def contact_step() -> object:
        for body, (x, y, yaw, vx, vy, rate) in zip(bodies, rows, strict=True):
            body.position, body.angle, body.velocity, body.angular_velocity = (
                (x, y),
                yaw,
                (vx, vy),
                rate,
            )
        space.step(1e-9)
        return [(*b.position, b.angle, *b.velocity, b.angular_velocity) for b in bodies]

    return contact_step


def row_of(cars: int, stages: Stages) -> str:
    """Measure a city of so many cars; return its line of the table."""
    world = world_of(cars)
    now = iter(range(0, 10**15, PERIOD_NS))
    ticks = max(20, min(TICKS, 3000 // cars))
    for _ in range(min(WARM_TICKS, 3 * ticks)):
        tick(world, next(now), [])
    stages.spent_ms = dict.fromkeys(STAGES, 0.0)
    tick_ms = timed(lambda: tick(world, next(now), []), ticks)
    spent = {name.strip("_"): ms / ticks for name, ms in stages.spent_ms.items()}
    messages = [out for out in tick(world, next(now), []) if isinstance(out, Message)]
    json_ms = timed(lambda: [encode(one) for one in messages], 5)
    vehicles, motion = everybody(world.cars, 0)
    ours_us = timed(lambda: world.contacts.step(vehicles, motion), 30) * 1e3
    peer_us = timed(by_attribute(world), 30) * 1e3
    parts = " ".join(f"{name} {ms:.2f}" for name, ms in spent.items())
    return (
        f"{cars:>5} {tick_ms:>8.2f} {tick_ms / LIMIT_MS:>9.0%} {json_ms:>8.2f} {ours_us:>11.0f} "
        f"{peer_us:>13.0f}   {parts}"
    )


def main(sizes: Sequence[int] = SIZES) -> None:
    stages = Stages()
    print(" cars  tick ms  of limit  JSON ms  contact us  by attribute   stages [ms]")
    for cars in sizes:
        print(row_of(cars, stages), flush=True)


if __name__ == "__main__":
    main([int(word) for word in sys.argv[1:]] or SIZES)
