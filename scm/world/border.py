"""The border to the next cities: cars that come to it, and those just behind it.

A car may cross where the next city has reserved a place for it, which holds for `VALID_MS` on this
city's own clock; until then it stops at the end of its lane. One car a road is on its way at a
time. Cars of the next city near the border count for drivers here as if they sent CAMs.
"""

import math
from collections.abc import Sequence

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import RunError, ScmError
from scm.geometry import Pose2
from scm.maps.border import Exit
from scm.v2x.exchange import Call, ToCity
from scm.v2x.key import is_name
from scm.v2x.messages.border_cars import BorderCar, BorderCars
from scm.v2x.messages.handover_request import HandoverRequest
from scm.vehicles.drivers.limits import limits_of
from scm.vehicles.drivers.speed_control import stopping_speed
from scm.vehicles.jit import plain
from scm.world.border_state import MAX_GHOSTS, Approaching
from scm.world.cars import AnyCar
from scm.world.hosted import HostedCar
from scm.world.world import World

VALID_MS = 2000
"""For so long a place is reserved, and a car may cross without another answer."""
REQUEST_EVERY_NS = NS_PER_S // 2
REQUEST_TIMEOUT_S = 0.5
APPROACH_M = 2.0  # before the border a car asks for a place
STOP_BEFORE_M = 0.05  # of the border a car's front stops at
NEAR_M = 5.0  # of the border: cars that the next city gets to know; beyond a driver's view
GHOST_NS = 3 * NS_PER_S  # without news a car behind the border is forgotten, as after CAMs
MAX_SKEW_NS = NS_PER_S // 2  # between the clocks of two cities; more: news count from reception


def approach(world: World, now_ns: int) -> list[Call]:
    """Let cars stop at the border that may not cross, and ask for a place for the first ones."""
    border, drivers = world.border, world.drivers
    if not border.exits:
        return []
    drivers.limit[:] = np.inf
    out: list[Call] = []
    coming: set[str] = set()
    for number, road in border.exits.items():
        left_m = road.length_m - drivers.s
        there = world.cars.arrays.driven & (drivers.lane == number) & (left_m < APPROACH_M)
        for place, index in enumerate(_by(left_m, there)):
            car = world.cars.hosted[world.cars.arrays.names[index]]
            claim = border.approaching.setdefault(car.name, Approaching(road))
            coming.add(car.name)
            if place == 0 and claim.until_ns < now_ns + VALID_MS * NS_PER_MS // 2:
                out += _reserve(world, car, claim, now_ns)
            if claim.until_ns <= now_ns:
                limits = limits_of(car.car)
                front_m = float(left_m[index]) - limits.front - STOP_BEFORE_M
                drivers.limit[index] = plain(stopping_speed)(front_m, limits.decel)
    for name in border.approaching.keys() - coming:
        if name not in world.cars.hosted or border.approaching[name].until_ns <= now_ns:
            del border.approaching[name]
    return out


def _by(left_m: Floats, there: Bools) -> list[int]:
    indices: Ints = np.flatnonzero(there)
    order: list[int] = indices[np.argsort(left_m[indices], kind="stable")].tolist()
    return order


def _reserve(world: World, car: HostedCar, claim: Approaching, now_ns: int) -> list[Call]:
    """Ask for a place, unless that was done just now or another car is on its way there."""
    border = world.border
    if now_ns - claim.sent_ns < REQUEST_EVERY_NS:
        return []
    if any(leaving.road == claim.road for leaving in border.leaving.values()):
        return []
    claim.sent_ns = now_ns
    request = request_of(world, car, claim.road)
    return [Call(request, REQUEST_TIMEOUT_S, city=claim.road.city)]


def request_of(world: World, car: HostedCar, road: Exit) -> HandoverRequest:
    """Return a request for a place for a car."""
    return HandoverRequest(
        city=world.border.city,
        phase="reserve",
        vehicle=car.name,
        epoch=car.lease.epoch + 1,
        lane=road.to,
        border=(*road.border,),
        car=car.car_file,
        digest=world.cars.garage.digest(car.car_file),
    )


def report_cars(world: World, now_ns: int) -> list[ToCity]:
    """Return the cars near the border for the cities next to it, as far as the map lets them."""
    border = world.border
    if not border.exits or not world.every["border"].is_due(now_ns):
        return []
    forget_ghosts(world, now_ns)
    out = []
    for neighbour in world.city_map.neighbours:
        roads = [road for road in border.exits.values() if road.city == neighbour.city]
        if "cams" not in neighbour.messages or not roads:
            continue
        to_other = Pose2(*neighbour.origin).inverse()
        cars = tuple(reported(world, car, to_other) for car in near_border(world, roads))
        message = BorderCars(city=border.city, t_ns=now_ns, cars=cars)
        out.append(ToCity(neighbour.city, message))
    return out


def near_border(world: World, roads: Sequence[Exit]) -> list[AnyCar]:
    """Return the cars of this city near the ends of some roads."""
    vehicles = world.cars.arrays
    near = np.zeros(vehicles.capacity, np.bool_)
    for road in roads:
        near |= np.hypot(vehicles.x - road.end.x, vehicles.y - road.end.y) < NEAR_M
    names = (vehicles.names[index] for index in np.flatnonzero(near & vehicles.used).tolist())
    cars = (world.cars.get(name) for name in names)
    return [car for car in cars if car is not None]


def reported(world: World, car: AnyCar, to_other: Pose2) -> BorderCar:
    """Return a car as drivers of another map, where this one has a pose, are to know it."""
    x, y, yaw = to_other @ car.pose
    return BorderCar(
        vehicle=car.name,
        car=car.car_file,
        x_m=x,
        y_m=y,
        yaw_rad=yaw,
        speed_mps=float(world.cars.arrays.speed[car.index]),
        yaw_rate_radps=float(world.cars.arrays.yaw_rate[car.index]),
    )


def receive_cars(world: World, message: BorderCars, now_ns: int) -> tuple[()]:
    """Show the cars of the next city near the border to the drivers here."""
    if message.city not in {road.city for road in world.border.exits.values()}:
        world.ignored += 1
        return ()
    is_in_step = abs(message.t_ns - now_ns) < MAX_SKEW_NS
    for one in message.cars:
        if _has_come(world, message.city, one.vehicle) or not _is_plausible(world, one):
            continue
        try:
            show_ghost(world, message.city, one, message.t_ns if is_in_step else now_ns)
        except ScmError:
            world.ignored += 1
    return ()


def _has_come(world: World, city: str, name: str) -> bool:
    """Return whether a car of the next city is here by now; one of that name may be another."""
    arrival = world.border.arrivals.get((city, name))
    return arrival is not None and not arrival.refused and world.cars.get(name) is not None


def _is_plausible(world: World, one: BorderCar) -> bool:
    """Return whether a report can be one of a car near the border; it comes from outside."""
    ends = [road.end for road in world.border.exits.values()]
    near = any(math.hypot(one.x_m - end.x, one.y_m - end.y) < 2.0 * NEAR_M for end in ends)
    return near and abs(one.yaw_rad) < 7.0 and max(abs(one.speed_mps), abs(one.yaw_rate_radps)) < 50


def show_ghost(world: World, city: str, one: BorderCar, t_ns: int) -> None:
    """Show a car behind the border to the drivers here; without room or car file it stays out.

    Raises:
        CarError: when its car file here is wrong.
    """
    border, vehicles, key = world.border, world.cars.arrays, (city, one.vehicle)
    pose = Pose2(one.x_m, one.y_m, one.yaw_rad)
    if key not in border.ghosts:
        if len(border.ghosts) >= MAX_GHOSTS or not is_name(one.vehicle):
            return
        if not world.cars.garage.is_known(one.car):
            return
        limits = limits_of(world.cars.garage.car(one.car))
        try:
            index = vehicles.add(f"{city}/{one.vehicle}", pose, hosted=False)
        except RunError:
            return
        vehicles.front[index] = limits.front
        world.drivers.leave(index)
        world.drivers.show(index, limits.length, limits.width)
        border.ghosts[key] = index, t_ns
    index, last_ns = border.ghosts[key]
    if t_ns < last_ns:
        return
    border.ghosts[key] = index, t_ns
    vehicles.put(index, pose)
    vehicles.speed[index], vehicles.yaw_rate[index] = one.speed_mps, one.yaw_rate_radps
    bumper = pose.apply(float(vehicles.front[index]), 0.0)
    columns = (*bumper, one.yaw_rad, one.speed_mps, one.yaw_rate_radps)
    world.drivers.receive_cams(np.array([index]), t_ns, *(np.array([v]) for v in columns))


def forget_ghosts(world: World, now_ns: int, name: str = "") -> None:
    """Forget the cars behind the border that are no longer reported, and the one of a name."""
    for key, (index, t_ns) in list(world.border.ghosts.items()):
        if key[1] == name or abs(now_ns - t_ns) > GHOST_NS:
            del world.border.ghosts[key]
            world.drivers.leave(index)
            world.cars.arrays.remove(index)


def is_clear(world: World, pose: Pose2, distance_m: float) -> bool:
    """Return whether no car of this city is within a distance of a place."""
    cars, ghosts = world.cars.arrays, [index for index, _ in world.border.ghosts.values()]
    there = cars.used.copy()
    there[ghosts] = False
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    dx, dy = cars.x[there] - pose.x, cars.y[there] - pose.y
    away = np.hypot(c * dx + s * dy, 2.0 * (c * dy - s * dx))  # to the side counts double
    return not bool((away < distance_m).any())
