"""A car parks by its own sensors while nothing is quite as its map and its car file say.

It starts anywhere in the room, knowing roughly where. Its agent has the map as it was drawn; the
world's walls stand in modules, each a little off. Ranges, throttle and steering are noisy. Boxes
that no map has may stand about. Its car file may lack an effect that its car has.
"""

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Protocol

import numpy as np
from msgspec.structs import replace

from scm.clock import NS_PER_S
from scm.errors import CarError, PathError
from scm.geometry import Pose2, wrap_angle
from scm.maps.route import roads_of
from scm.records.city_map import Box, CityMap, Point, Wall
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Part, Subscription
from scm.study.case import Case
from scm.v2x.exchange import Incoming, Outgoing
from scm.v2x.messages.contact import Contact
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.lease_request import LeaseReply, LeaseRequest
from scm.vehicles.car import Car, load_car, varied_cars
from scm.world.part import WorldPart
from vehicle_agent.agent import AgentPart
from vehicle_agent.autonomy.grid_map import grid_of_city
from vehicle_agent.autonomy.hybrid_astar import plan
from vehicle_agent.autonomy.outline import outline_clearance, scene_of
from vehicle_agent.autonomy.part import ParkPart, Wanted
from vehicle_agent.autonomy.plan import CarLimits, limits_of
from vehicle_agent.autonomy.response import response_of
from vehicle_agent.body import BodyKind

MAP = "parking_school_obstacles"
CAR, VEHICLE = "nigel", "n1"
GOAL_M, GOAL_RAD = 0.05, 0.0873
RANGE_STD_M, DRIVE_STD_MPS, STEERING_STD_RAD = 0.025, 0.013, 0.018
WALL_STD_M, WALL_STD_RAD = 0.01, 0.087
"""Perturbations of the AutoDRIVE paper, and the tolerances of its planner."""
TOP_SPEED_MPS, FULL_STEERING_RAD = 0.267, 0.5236
MODULE_M, BEHIND_M = 0.5, 0.02  # length of a wall's module; of a traced face, what is behind it
KNOWN_STD = (0.05, 0.05, 0.1)  # of the start [m, m, rad]
LASTS_S, STEP_S = 90.0, 0.02
START_ROOM_M, BOX_M, BOX_ROOM_M = 0.04, (0.06, 0.16), 0.25
TRIES = 300
FRONT_M, STOPS_M, APART_M = 0.23, 0.06, 0.35
BEFORE_X_M, BESIDE_M = (-0.22, 0.38), 0.24  # where a point ahead of the other car is in its way
OTHER, CROSSING_ROOM_M, FRONT_ROOM_M = "other", 0.2, 0.4
CONCEALED: dict[str, tuple[tuple[str, ...], dict[str, float]]] = {
    "nothing": ((), {}),
    "drive_delay": (("drive_delay",), {"drive.delay_s": 0.25}),
    "drive_deadband": (("drive_deadband",), {"drive.deadband": 0.15}),
    "drive_gain": (("drive_gain",), {"drive.gain": 0.7}),
    "steer_trim": (("steer_trim",), {"steering.trim_rad": 0.05}),
    "steer_gain": (("steer_gain",), {"steering.gain": 0.8}),
    "servo_rate": ((), {"steering.rate_rad_s": 0.21}),
}
CONCEALED["all"] = (
    tuple(term for terms, _ in CONCEALED.values() for term in terms),
    {key: value for _, values in CONCEALED.values() for key, value in values.items()},
)
"""Effects that a car may have and its file not, by name: terms, and numbers by key."""
FOUND = Path("runs/found_car")  # a folder each, with the file that `scm mismatch` wrote


def run(
    case: Case, perturbation: float = 1.0, boxes: int = 0, crossing: bool = False,
    goal: str = "goal", concealed: str = "nothing", car_file: str = "nominal",
    engine: str = "city", stack: str = "own", room: str = "", start: str = "",
) -> dict[str, float]:  # fmt: skip
    """Return whether the car parked, and how well.

    Args:
        case: The case.
        perturbation: By how much the paper's perturbations are scaled.
        boxes: How many stand about that the map has not.
        crossing: Whether another car drives through the room, and stops at its other side.
        goal: Place to park at; in a scanned room one beside a wall is drawn.
        concealed: What the car has that the nominal file lacks: a key of `CONCEALED`.
        engine: What moves the car: the city, or an engine of `tests/reality`.
        car_file: The agent's: `nominal`, `true`, or `found`, by `found_car.py` from a recording.
        stack: The agent's planner and controller: `own`, or `published`, as the AutoDRIVE paper's.
        room: Instead of the study's map: `lot`, a random parking lot; a map by name or path; or a
            scanned room's `.yaml`.
        start: Place about which the car starts; empty: anywhere.
    """
    rng = case.generator("parking")
    car = with_effect(load_car(CAR), concealed)
    limits = response_of(car).limited(limits_of(car))
    if room:
        from studies.rooms import room_named  # noqa: PLC0415  needs a clone

        city_map, target, draw = room_named(room, goal, limits, case.generator("room"))
    else:
        city_map, draw = case.map, partial(on_floor, case.map)
        target = roads_of(city_map).spawn_pose(goal)
    if start:
        draw = partial(_off, roads_of(city_map).spawn_pose(start))
    begin, world_map = _scene(city_map, perturbation, limits, target, boxes, rng, draw)
    wanted = Wanted(
        VEHICLE, goal=as_text(target), start=as_text(_off(begin, rng)), seed=case.seed, stack=stack
    )
    with varied_cars({CAR: known_car(car_file, concealed)}):
        agent = ParkPart("park", wanted, city_map=city_map)
    noisy_agent = Noisy(agent, perturbation, rng)
    with varied_cars({CAR: car.with_values({"lidar.noise_m": perturbation * RANGE_STD_M})}):
        world = WorldPart(world_map, case.seed)
        cross = partial(_Crossing, world, begin, target, rng) if crossing else None
        if engine == "city":
            put = partial(world.world.host, VEHICLE, CAR, begin, 0)
            return _park(case, [world, noisy_agent], agent, put, target, cross)
        from studies.reality_body import concealing  # noqa: PLC0415  needs a clone

        body = concealing(engine, concealed, case.generator("reality"))
        driven = AgentPart(VEHICLE, CAR, as_text(begin), body=BodyKind("remote", lambda *_: body))
        parts = [world, driven, noisy_agent]
        return _park(case, parts, agent, lambda: body, target, cross)


class HasPose(Protocol):
    """Whatever is somewhere."""

    pose: Pose2


def _park(
    case: Case, parts: Sequence[Part], agent: ParkPart, put: Callable[[], HasPose], target: Pose2,
    cross: Callable[[Lockstep], "_Crossing"] | None,
) -> dict[str, float]:  # fmt: skip
    """Let an agent park; `put` puts its car there and returns it, `cross` another one."""
    with case.lockstep(parts) as city:
        contacts = city.subscribe(Subscription(Contact, {"vehicle": VEHICLE}))
        car = put()
        off, touched = list[tuple[float, float]](), False
        other = None if cross is None else cross(city)
        while city.now_ns < LASTS_S * 1e9 and not agent.is_over and not touched:
            before = car.pose
            if other is not None:
                other.step(before)
            city.run_for(STEP_S)
            touched = bool(contacts.drain())
            here = None if agent.parking is None else agent.parking.perception.now()
            if here is not None and car.pose != before:
                apart = car.pose.inverse() @ here.pose
                off.append((math.hypot(apart.x, apart.y), apart.yaw))
    left = target.inverse() @ car.pose
    at_goal = math.hypot(left.x, left.y) < GOAL_M and abs(left.yaw) < GOAL_RAD
    state = agent.parking.report.state if agent.parking is not None else "none"
    errors = np.sqrt(np.mean(np.square(off), axis=0)) if off else (math.nan, math.nan)
    return {
        "parked": float(at_goal and state == "parked" and not touched),
        "touched": float(touched),
        "time_s": city.now_ns / 1e9,
        "off_m": math.hypot(left.x, left.y),
        "off_rad": abs(wrap_angle(left.yaw)),
        "attempts": float(agent.parking.attempts if agent.parking is not None else 0),
        "position_rmse_m": float(errors[0]),
        "heading_rmse_rad": float(errors[1]),
    }


def with_effect(car: Car, name: str) -> Car:
    """Return a car with an effect of `CONCEALED`."""
    terms, values = CONCEALED[name]
    return car.with_terms(terms, values)


class _Crossing:
    """Another car, driven along a wall and straight through the room, to its other side."""

    def __init__(
        self,
        world: WorldPart,
        start: Pose2,
        goal: Pose2,
        rng: np.random.Generator,
        city: Lockstep,
    ) -> None:
        floor, x_m = world.world.city_map.floor, start.x
        while abs(x_m - start.x) < APART_M:
            x_m = float(rng.uniform(floor.x_m[0] + 0.25, goal.x - 0.45))
        side = float(rng.choice((-1.0, 1.0)))
        edge = floor.y_m[1] - CROSSING_ROOM_M if side > 0 else floor.y_m[0] + CROSSING_ROOM_M
        self._city, self._seq = city, 0
        self._car = world.world.host(OTHER, CAR, Pose2(x_m, edge, -side * 0.5 * math.pi), 0)
        request = LeaseRequest(vehicle=OTHER, owner="script", verb="acquire", ttl_ms=60_000)
        reply = city.call(request)
        self._epoch = reply.epoch if isinstance(reply, LeaseReply) else 0
        self._begins_s = float(rng.uniform(0.0, 6.0))
        self._throttle = float(rng.uniform(0.4, 0.9))
        self._side, self._floor = side, floor

    def step(self, own: Pose2) -> None:
        """Drive on; stand at the other side, and before the car that parks."""
        self._seq += 1
        y, half = self._car.pose.y, self._floor.y_m
        over = y < half[0] + FRONT_ROOM_M if self._side > 0 else y > half[1] - FRONT_ROOM_M
        drives = self._city.now_ns > self._begins_s * NS_PER_S and not over
        ahead = own.inverse() @ self._car.pose @ Pose2(FRONT_M + STOPS_M, 0.0, 0.0)
        drives = drives and not (
            BEFORE_X_M[0] < ahead.x < BEFORE_X_M[1] and abs(ahead.y) < BESIDE_M
        )
        self._city.publish(
            DriveCommand(
                vehicle=OTHER,
                t_ns=self._city.now_ns,
                epoch=self._epoch,
                seq=self._seq,
                throttle=self._throttle if drives else 0.0,
                steering=0.0,
            )
        )


def perturbed(city_map: CityMap, scale: float, rng: np.random.Generator) -> CityMap:
    """Return a map whose walls stand in modules, each a little off."""
    modules = (module for wall in city_map.walls for module in _modules(wall))
    shifted = (_shifted(module, scale, rng) for module in modules)
    return replace(city_map, walls=tuple(wall for one in shifted for wall in _solid(one)))


def _modules(wall: Wall) -> Iterator[Wall]:
    """Yield straight pieces of a wall; of one that was traced from a scan, pieces of its line."""
    points = [*wall.points, wall.points[0]] if wall.closed else list(wall.points)
    if wall.thickness_m == 0.0:
        yield from _traced(wall, points)
        return
    for (x0, y0), (x1, y1) in itertools.pairwise(points):
        count = max(1, round(math.hypot(x1 - x0, y1 - y0) / MODULE_M))
        for k in range(count):
            ends = tuple(
                (x0 + part * (x1 - x0), y0 + part * (y1 - y0))
                for part in (k / count, (k + 1) / count)
            )
            yield replace(wall, points=ends, closed=False)


def _traced(wall: Wall, points: list[Point]) -> Iterator[Wall]:
    """Yield pieces about as long as a module of a line through points; corners stay in them."""
    along = np.append(0.0, np.cumsum(np.hypot(*np.diff(np.array(points), axis=0).T)))
    count = max(1, round(along[-1] / MODULE_M))
    for low, high in itertools.pairwise(np.linspace(0.0, along[-1], count + 1)):
        inner = [point for at, point in zip(along, points, strict=True) if low < at < high]
        ends = [
            tuple(float(np.interp(at, along, one)) for one in zip(*points, strict=True))
            for at in (low, high)
        ]
        yield replace(wall, points=(ends[0], *inner, ends[1]), closed=False)


def _shifted(module: Wall, scale: float, rng: np.random.Generator) -> Wall:
    (x0, y0), (x1, y1) = module.points[0], module.points[-1]
    middle = 0.5 * (x0 + x1), 0.5 * (y0 + y1)
    shift = scale * WALL_STD_M * rng.standard_normal(2)
    turn = Pose2(0.0, 0.0, scale * WALL_STD_RAD * rng.standard_normal())
    points = []
    for x, y in module.points:
        dx, dy = turn.apply(x - middle[0], y - middle[1])
        points.append((float(middle[0] + dx + shift[0]), float(middle[1] + dy + shift[1])))
    return replace(module, points=tuple(points))


def _solid(wall: Wall) -> Iterator[Wall]:
    """Yield a wall; of a traced face, which has the room on its left, what stands behind it.

    Else nothing would be seen of its end, and the scanner would miss it where it looks along it.
    """
    if wall.thickness_m > 0.0:
        yield wall
        return
    for (x0, y0), (x1, y1) in itertools.pairwise(wall.points):
        half = 0.5 * BEHIND_M / max(math.hypot(x1 - x0, y1 - y0), 1e-9)
        dx, dy = half * (y1 - y0), half * (x0 - x1)
        ends = (x0 + dx, y0 + dy), (x1 + dx, y1 + dy)
        yield replace(wall, points=ends, thickness_m=BEHIND_M)


def _scene(
    city_map: CityMap, perturbation: float, limits: CarLimits, goal: Pose2, boxes: int,
    rng: np.random.Generator, draw: Callable[[np.random.Generator], Pose2],
) -> tuple[Pose2, CityMap]:  # fmt: skip
    """Return a start from which the goal can be reached, and the room as it is."""
    floor = city_map.floor
    for _ in range(TRIES):
        world_map = perturbed(city_map, perturbation, rng)
        more = tuple(
            Box(
                name=f"unmapped_{number}", mapped=False,
                x_m=float(rng.uniform(*floor.x_m)), y_m=float(rng.uniform(*floor.y_m)),
                yaw_rad=float(rng.uniform(-math.pi, math.pi)),
                length_m=float(rng.uniform(*BOX_M)), width_m=float(rng.uniform(*BOX_M)),
            )
            for number in range(boxes)
        )  # fmt: skip
        if any(math.hypot(box.x_m - goal.x, box.y_m - goal.y) < BOX_ROOM_M for box in more):
            continue
        changed = replace(world_map, boxes=(*world_map.boxes, *more))
        all_mapped = replace(
            changed, boxes=tuple(replace(box, mapped=True) for box in changed.boxes)
        )
        grid = grid_of_city(all_mapped)
        start = draw(rng)
        if outline_clearance(scene_of(grid, limits), start) < START_ROOM_M:
            continue
        try:
            plan(grid, limits, start, goal, margin_m=0.01)
        except PathError:
            continue
        return start, changed
    raise PathError(f"no start from which the goal can be reached in {TRIES} draws")


def on_floor(city_map: CityMap, rng: np.random.Generator) -> Pose2:
    """Draw a pose anywhere on a map's floor."""
    floor = city_map.floor
    return Pose2(
        float(rng.uniform(*floor.x_m)), float(rng.uniform(*floor.y_m)),
        float(rng.uniform(-math.pi, math.pi)),
    )  # fmt: skip


def _off(start: Pose2, rng: np.random.Generator) -> Pose2:
    """Draw a pose about another, as well as it is known."""
    return Pose2(*(np.array(start) + KNOWN_STD * rng.standard_normal(3)).tolist())


def as_text(pose: Pose2) -> str:
    """Return a pose as commands take it: X,Y,DEG."""
    return f"{pose.x:.4f},{pose.y:.4f},{math.degrees(pose.yaw):.3f}"


def known_car(car_file: str, concealed: str) -> Car:
    """Return the car that the agent takes its own for."""
    nominal = load_car(CAR)
    if car_file != "found":
        return with_effect(nominal, concealed) if car_file == "true" else nominal
    path = FOUND / concealed / "car.toml"
    if not path.is_file():
        msg = f"{path}: there is no such file; expected one by `python -m studies.found_car`"
        raise CarError(msg)
    return load_car(path)


class Disturbed:
    """Commands that are not quite obeyed: by an offset that stays, and by white noise."""

    def __init__(self, scale: float, rng: np.random.Generator) -> None:
        self._rng = rng
        self._std = scale * np.array(
            (DRIVE_STD_MPS / TOP_SPEED_MPS, STEERING_STD_RAD / FULL_STEERING_RAD)
        )
        self._offset = self._std * rng.standard_normal(2)

    def __call__(self, throttle: float, steering: float) -> tuple[float, float]:
        """Return what is obeyed instead; a car that shall stand does."""
        if throttle == 0.0:
            return throttle, steering
        off = self._offset + self._std * self._rng.standard_normal(2)
        throttle, steering = np.clip(np.array((throttle, steering)) + off, -1.0, 1.0)
        return float(throttle), float(steering)


class Noisy:
    """An agent whose commands are not quite obeyed."""

    def __init__(self, part: ParkPart, scale: float, rng: np.random.Generator) -> None:
        self.name, self.role, self.period_ns = part.name, part.role, part.period_ns
        self.services, self.attach, self.finish = part.services, part.attach, part.finish
        self._part, self._obeyed = part, Disturbed(scale, rng)

    @property
    def subscriptions(self) -> Sequence[Subscription]:
        """The agent's."""
        return self._part.subscriptions

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Return what the agent sends, with other commands."""
        return [self._disturbed(message) for message in self._part.step(now_ns, inbox)]

    def _disturbed(self, message: Outgoing) -> Outgoing:
        if not isinstance(message, DriveCommand):
            return message
        throttle, steering = self._obeyed(message.throttle, message.steering)
        return replace(message, throttle=throttle, steering=steering)
