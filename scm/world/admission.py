"""Whether a car may come from the next city: every reason why not, as a refusal."""

import math
from collections.abc import Iterator

from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import ScmError, nearest
from scm.geometry import Pose2, wrap_angle
from scm.maps.vehicle_tags import LAST_TAG_ID
from scm.v2x.key import is_name
from scm.v2x.message import Refused
from scm.v2x.messages.handover_request import HandedCar, HandoverRequest
from scm.vehicles.car import car_names
from scm.vehicles.drivers.limits import limits_of
from scm.world.alerts import NAME
from scm.world.border import is_clear
from scm.world.border_state import MAX_GHOSTS
from scm.world.world import World

MAX_GAP_M, MAX_KINK_RAD = 0.05, math.radians(3.0)  # between the lanes on both sides of a border
MAX_AWAY_M = 1.0  # of a car from where its lane begins
MAX_DECIDED_NS = 60 * NS_PER_S  # since a driver that drives has decided last
MAX_AHEAD_MS = 7 * 24 * 3600 * 1000  # of an epoch: cars that come here later must have higher ones
MAX_NAME = 200  # characters of a lane or a car file
MAX_NUMBER = 1e9  # of a car's state, in SI units
MAX_ORIGIN_YAW_RAD = 7.0
ROOM_M = 0.45  # that must be free behind the border before a car may come


def stranger(world: World, request: HandoverRequest) -> Refused | None:
    """Return why a request is of no car of a neighbour, so that nothing is stored for it."""
    cities = [neighbour.city for neighbour in world.city_map.neighbours]
    if request.city not in cities:
        known = ", ".join(cities) or "none"
        detail = f"{request.city} is no neighbour of {world.border.city}: expected one of {known}"
        return Refused(code="not_neighbour", detail=detail)
    if not is_name(request.vehicle):
        detail = f"vehicle: {request.vehicle[:MAX_NAME]!r} is no valid name"
        return Refused(code="invalid", detail=detail)
    for what in ("lane", "car", "digest"):
        if len(name := getattr(request, what)) > MAX_NAME:
            detail = f"{what}: got {len(name)} characters, expected at most {MAX_NAME}"
            return Refused(code="invalid", detail=detail)
    return None


def problem_of(world: World, request: HandoverRequest, now_ns: int) -> Refused | None:
    """Return why a car cannot come, or None."""
    for lane, (_, until_ns) in list(world.border.reserved.items()):
        if until_ns <= now_ns:
            del world.border.reserved[lane]
    latest = now_ns // NS_PER_MS + MAX_AHEAD_MS
    if not 0 < request.epoch <= latest:
        detail = f"epoch: got {request.epoch}, expected 1 to {latest}: compare the clocks"
        return Refused(code="invalid", detail=detail)
    for check in (_maps, _car, _name, _state, _room, _place):
        problem = check(world, request)
        if problem is not None:
            return problem
    return None


def _maps(world: World, request: HandoverRequest) -> Refused | None:
    """Check that both maps have the same border."""
    lanes = {lane.name: lane for lane in world.city_map.lanes}
    if request.lane not in lanes:
        detail = f"no lane {request.lane!r} in {world.border.city}"
        return Refused(code="invalid", detail=detail + nearest(request.lane, list(lanes)))
    if any(request.lane in lane.next for lane in world.city_map.lanes):
        detail = f"lane {request.lane!r} does not begin at a border: a lane here leads into it"
        return Refused(code="invalid", detail=detail)
    start, end = Pose2(*lanes[request.lane].start), Pose2(*request.border)
    gap_m = math.hypot(start.x - end.x, start.y - end.y)
    if gap_m > MAX_GAP_M or abs(wrap_angle(start.yaw - end.yaw)) > MAX_KINK_RAD:
        detail = (
            f"lane {request.lane!r} begins at ({start.x:.3f}, {start.y:.3f}) m, "
            f"{math.degrees(start.yaw):.1f} deg; the road of {request.city} ends at "
            f"({end.x:.3f}, {end.y:.3f}) m, {math.degrees(end.yaw):.1f} deg: compare the origins"
        )
        return Refused(code="invalid", detail=detail)
    return None


def _car(world: World, request: HandoverRequest) -> Refused | None:
    """Check that the car's file is the same on both sides."""
    try:
        if not world.cars.garage.is_known(request.car):
            detail = f"no car file {request.car!r} here{nearest(request.car, car_names())}"
            return Refused(code="unknown_car", detail=detail)
        digest = world.cars.garage.digest(request.car)
    except ScmError:  # its text has paths of this computer
        detail = f"car file {request.car!r} cannot be read here"
        return Refused(code="unknown_car", detail=detail)
    if request.digest != digest:
        detail = f"car file {request.car!r} has other effects or numbers here"
        return Refused(code="unknown_car", detail=detail)
    return None


def _name(world: World, request: HandoverRequest) -> Refused | None:
    """Check that the name is free, and not on its way from here."""
    name = request.vehicle
    in_use = world.cars.get(name) is not None or name in (NAME, *world.radio.roadside)
    if in_use or name in world.border.leaving:
        detail = f"there is already a car named {name!r} in {world.border.city}"
        return Refused(code="owned", detail=detail)
    return None


def _state(world: World, request: HandoverRequest) -> Refused | None:
    """Check that a car that comes is whole, and at the border."""
    del world
    if request.phase == "reserve":
        return None
    problem = "expected the car, got nothing"
    if request.state is not None:
        problem = next(_flaws(request.state, request.border), "")
    return Refused(code="invalid", detail=f"state: {problem}") if problem else None


def _flaws(state: HandedCar, border: tuple[float, float, float]) -> Iterator[str]:
    """Yield what is wrong with a car's state, which comes from outside."""
    driver = state.driver
    if not all(abs(number) <= MAX_NUMBER for number in _numbers(state)):
        yield "its numbers are beyond every physical range"
    if abs(state.origin[2]) > MAX_ORIGIN_YAW_RAD:
        yield f"origin: got a yaw of {state.origin[2]:g} rad, expected at most one turn"
    if state.drawn_as < 0.0:
        yield f"drawn_as: got {state.drawn_as:g}, expected at least 0"
    if driver.speed_mps is not None and driver.speed_mps <= 0.0:
        yield f"driver.speed_mps: got {driver.speed_mps:g}, expected above 0"
    if not 0 <= driver.decided_ns <= MAX_DECIDED_NS:
        yield f"driver.decided_ns: got {driver.decided_ns}, expected at most a minute"
    if not 0 <= state.tag_id <= LAST_TAG_ID:
        yield f"tag_id: got {state.tag_id}, expected 0 to {LAST_TAG_ID}"
    here = {one.name: one.values for one in state.variables}
    if any(len(here.get(name, ())) != 1 for name in ("x_cog", "y_cog", "yaw")):
        yield "expected one value of x_cog, y_cog and yaw"
        return
    x, y = Pose2(*state.origin).apply(here["x_cog"][0], here["y_cog"][0])
    if math.hypot(x - border[0], y - border[1]) > MAX_AWAY_M:
        yield f"({x:.2f}, {y:.2f}) m is not at the border"


def _numbers(state: HandedCar) -> Iterator[float]:
    """Yield all numbers of a state but parameters, which have bounds of their own."""
    for one in state.variables:
        yield from one.values
    driver = state.driver
    yield from (*state.origin, driver.wheels_rad, driver.commanded_rad, driver.setpoint_mps)
    yield from (driver.integral, driver.speed_mps or 0.0, state.drawn_as)
    if state.past is not None:
        for knot in state.past.knots:
            yield from knot
        yield from (value or 0.0 for value in state.past.before)


def _room(world: World, request: HandoverRequest) -> Refused | None:
    """Check that the city is not stopped and not full."""
    if world.stop.engaged and request.phase == "reserve":
        return Refused(code="stopped", detail=f"{world.border.city} is stopped")
    vehicles = world.cars.arrays
    others = sum(
        key != (request.city, request.vehicle) for key, _ in world.border.reserved.values()
    )
    cars = int(vehicles.used.sum()) - len(world.border.ghosts)
    most = vehicles.capacity - MAX_GHOSTS
    if cars + others >= most:
        detail = f"{world.border.city} is full: it holds {most} cars"
        return Refused(code="full", detail=detail)
    return None


def _place(world: World, request: HandoverRequest) -> Refused | None:
    """Check that the place behind the border is free and reserved for nobody else."""
    lane = request.lane
    own = request.city, request.vehicle
    holder, _ = world.border.reserved.get(lane, (own, 0))
    if holder != own:
        return Refused(code="occupied", detail=f"{holder[1]} comes first")
    length_m = limits_of(world.cars.garage.car(request.car)).length
    room_m = length_m if request.phase == "commit" else max(ROOM_M, 1.5 * length_m)
    if not is_clear(world, Pose2(*request.border), room_m):
        return Refused(code="occupied", detail=f"a car stands where lane {lane!r} begins")
    return None
