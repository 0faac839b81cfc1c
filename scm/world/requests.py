"""The requests that the world answers, one function each; a refusal says why.

To add a request: write its message, a function here, and its line in `_ANSWERS`.
"""

from collections.abc import Callable
from typing import Any

from scm.errors import LeaseError, RunError, ScmError, nearest
from scm.geometry import Pose2
from scm.maps.bends import misfit
from scm.maps.coordinates import are_coordinates
from scm.maps.room import AHEAD_S, CLEARANCE_M
from scm.maps.vehicle_tags import LAST_TAG_ID
from scm.runtime.part import Service
from scm.store.records import StopRecord
from scm.v2x.exchange import Outgoing, PersistedState
from scm.v2x.key import check_name
from scm.v2x.message import Message, Refused, Request
from scm.v2x.messages.boxes_request import BoxesReply, BoxesRequest
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.echo_request import EchoReply, EchoRequest
from scm.v2x.messages.join_request import JoinReply, JoinRequest
from scm.v2x.messages.lease_request import LeaseReply, LeaseRequest
from scm.v2x.messages.light_request import LightReply, LightRequest
from scm.v2x.messages.remove_request import RemoveReply, RemoveRequest
from scm.v2x.messages.route_request import RouteReply, RouteRequest
from scm.v2x.messages.spawn_request import SpawnReply, SpawnRequest
from scm.v2x.messages.stop_request import StopRequest
from scm.vehicles.car import car_names
from scm.vehicles.drivers.limits import limits_of, turning_radius_m
from scm.world import lease as rules
from scm.world.alerts import NAME, city_event
from scm.world.cars import AnyCar, lease_record
from scm.world.driving import hand_over, send
from scm.world.hosted import HostedCar
from scm.world.remote import RemoteCar
from scm.world.world import World

KINDS = ("remote", "real")


class _RefusedError(ScmError):
    """A request that cannot be done, with the machine's word for why."""

    def __init__(self, code: str, detail: str) -> None:
        super().__init__(detail)
        self.code = code


def reply_to(
    world: World, request: Request, now_ns: int, out: list[Outgoing] | None = None
) -> Message:
    """Do what is requested, or refuse it and say why.

    Args:
        world: The world.
        request: The request.
        now_ns: The present time.
        out: Collects what else is to be sent: events, and records to store.
    """
    try:
        return _ANSWERS[type(request)](world, request, now_ns, [] if out is None else out)
    except _RefusedError as refusal:
        return Refused(code=refusal.code, detail=str(refusal))
    except LeaseError as refusal:
        return Refused(code="owned", detail=f"{request.vehicle}: {refusal}")  # type: ignore[attr-defined]
    except RunError as refusal:
        return Refused(code="full", detail=str(refusal))
    except ScmError as refusal:
        return Refused(code="invalid", detail=str(refusal))


def _spawn(world: World, request: SpawnRequest, now_ns: int, out: list[Outgoing]) -> SpawnReply:
    name = request.vehicle or world.cars.free_name(world.border.leaving)
    _check_new(world, name, request.car)
    car = world.host(name, request.car, _place(world, request.spawn, request.car), now_ns)
    out += world.arrival(car, now_ns)
    text = f"{name}, a {request.car}, stands on the map"
    out.append(city_event("info", "vehicle_spawned", text, now_ns, name))
    out += _lane_misfits(world, name, request.car, now_ns)
    x, y, yaw = car.pose
    return SpawnReply(vehicle=name, x_m=x, y_m=y, yaw_rad=yaw, tag_id=car.tag_id)


def _join(world: World, request: JoinRequest, now_ns: int, out: list[Outgoing]) -> JoinReply:
    name, before = request.vehicle, world.cars.remote.get(request.vehicle)
    if world.ownership is not None:
        raise _RefusedError("invalid", "a city that is cut into regions has no cars of agents yet")
    if request.kind not in KINDS:
        raise _RefusedError("invalid", f"kind: got {request.kind!r}, expected remote or real")
    owner = world.sessions.get(request.session, name)
    if owner != name:
        detail = f"session {request.session!r} is that of {owner}, expected that of {name}'s agent"
        raise _RefusedError("owned", detail)
    if before is not None and before.session == request.session and before.alive:
        return _welcome(before, now_ns)
    if before is not None and not before.alive:
        out += world.remove(name)
    _check_new(world, name, request.car)
    _check_tag(world, request.tag_id)
    pose = _place(world, request.spawn, request.car)
    car = world.admit(
        name, request.kind, request.session, request.car, pose, now_ns, request.tag_id
    )
    out += world.arrival(car, now_ns, request.tag_id)
    text = f"{name}, a {request.car}, joined the city"
    out.append(city_event("info", "vehicle_joined", text, now_ns, name))
    out += _lane_misfits(world, name, request.car, now_ns)
    return _welcome(car, now_ns)


def _lane_misfits(world: World, name: str, car_file: str, now_ns: int) -> list[Outgoing]:
    """Return a warning of lanes that a car cannot follow, at the first car of its file."""
    if car_file in world.alerts.checked_files:
        return []
    world.alerts.checked_files.add(car_file)
    car = world.cars.garage.car(car_file)
    problem = misfit(world.city_map, turning_radius_m(car), limits_of(car).width)
    text = f"{name}, a {car_file}: {problem}"
    return [city_event("warning", "lanes_misfit", text, now_ns, name)] if problem else []


def _welcome(car: RemoteCar, now_ns: int) -> JoinReply:
    x, y, yaw = car.pose
    return JoinReply(
        vehicle=car.name,
        x_m=x,
        y_m=y,
        yaw_rad=yaw,
        tag_id=car.tag_id,
        epoch=car.lease.epoch,
        t_ns=now_ns,
    )


def _remove(world: World, request: RemoveRequest, now_ns: int, out: list[Outgoing]) -> RemoveReply:
    car = _known(world, request.vehicle)
    if request.session and getattr(car, "session", "") != request.session:
        detail = f"{car.name} did not join by session {request.session!r}: it is somebody else's"
        raise _RefusedError("owned", detail)
    out += world.remove(car.name)
    name = "vehicle_removed" if isinstance(car, HostedCar) else "vehicle_left"
    reason = f": {request.reason}" if request.reason else ""
    out.append(city_event("info", name, f"{car.name} left the city{reason}", now_ns, car.name))
    return RemoveReply(vehicle=car.name)


def _route(world: World, request: RouteRequest, now_ns: int, out: list[Outgoing]) -> RouteReply:
    car = _own(world, request.vehicle)
    if request.speed_mps is not None and not request.speed_mps > 0.0:
        raise _RefusedError("invalid", f"speed_mps: got {request.speed_mps}, expected above 0")
    del out
    if world.cars.arrays.elsewhere[car.index]:
        raise _RefusedError("not_found", f"{car.name} is in another region, which answers for it")
    return send(world, car, request, now_ns)


def _lease(world: World, request: LeaseRequest, now_ns: int, out: list[Outgoing]) -> LeaseReply:
    car = _known(world, request.vehicle)
    before, owner, ttl_ms = car.lease, request.owner, request.ttl_ms
    if not owner:
        raise _RefusedError("invalid", "owner: got nothing, expected who asks")
    if request.verb == "acquire":
        lease = rules.acquire(before, owner, ttl_ms, now_ns)
    elif request.verb == "renew":
        lease = rules.renew(before, owner, request.epoch, ttl_ms, now_ns)
    elif request.verb == "release":
        lease = rules.release(before, owner, request.epoch)
    else:
        lease = rules.steal(before, owner, ttl_ms, request.reason, now_ns)
        text = f"{owner} took {car.name} from {before.owner}: {request.reason}"
        out.append(city_event("warning", "lease_stolen", text, now_ns, car.name))
    is_new = lease.epoch != before.epoch
    if isinstance(car, HostedCar) and is_new:
        out.append(hand_over(world, car, lease, now_ns))
    car.lease = lease
    if isinstance(car, RemoteCar) and is_new:
        out.append(lease_record(car))
    return LeaseReply(vehicle=car.name, owner=lease.owner, epoch=lease.epoch, ttl_ms=lease.ttl_ms)


def _lights(world: World, request: LightRequest, now_ns: int, out: list[Outgoing]) -> LightReply:
    del now_ns, out
    car = _own(world, request.vehicle)
    car.switches = car.switches.updated(request.headlights, request.indicators)
    switches = car.switches
    return LightReply(
        vehicle=car.name, headlights=switches.headlights, indicators=switches.indicators
    )


def _echo(world: World, request: EchoRequest, now_ns: int, out: list[Outgoing]) -> EchoReply:
    del out
    car = _known(world, request.vehicle)
    if isinstance(car, RemoteCar):
        raise _RefusedError("not_found", f"{car.name} is not hosted: its own agent answers for it")
    return EchoReply(vehicle=car.name, t_ns=now_ns)


def _stop(world: World, request: StopRequest, now_ns: int, out: list[Outgoing]) -> CityStop:
    world.stop = CityStop(
        t_ns=now_ns, engaged=request.engaged, by=request.by, reason=request.reason
    )
    verb = "stopped the city" if request.engaged else "let the city drive again"
    reason = f": {request.reason}" if request.reason else ""
    out.append(city_event("warning", "city_stop", f"{request.by} {verb}{reason}", now_ns))
    record = StopRecord(engaged=request.engaged, by=request.by, reason=request.reason)
    out += [world.stop, PersistedState("latches", "stop", record)]
    return world.stop


def _known(world: World, name: str) -> AnyCar:
    car = world.cars.get(name)
    if car is None:
        names = [car.name for car in world.cars.all()]
        raise _RefusedError("not_found", f"no car named {name!r}{nearest(name, names)}")
    return car


def _own(world: World, name: str) -> HostedCar:
    """Return a hosted car that nobody has leased."""
    car = _known(world, name)
    if isinstance(car, RemoteCar):  # of several answers the bus takes the one that is no refusal
        raise _RefusedError("not_found", f"{car.name} is not hosted: its own agent answers for it")
    if car.lease.is_leased:
        detail = f"{car.name} is leased to {car.lease.owner!r}: release the lease, or steal it"
        raise _RefusedError("owned", detail)
    return car


def _check_new(world: World, name: str, car_file: str) -> None:
    check_name(name, "vehicle")
    others = (NAME, *world.radio.roadside, *world.border.leaving)
    if world.cars.get(name) is not None or name in others:
        raise _RefusedError("owned", f"vehicle: there is already one named {name!r}")
    if car_file not in car_names():  # no paths: whoever asks may be far away
        known = ", ".join(car_names())
        wanted = f"expected one of {known}{nearest(car_file, car_names())}"
        own = "a car of your own: make it on page /cars, or put its file in the folder SCM_CARS"
        raise _RefusedError("invalid", f"car: got {car_file!r}, {wanted}; {own}")


def _check_tag(world: World, tag_id: int | None) -> None:
    """Refuse a tag that does not exist, lies on the floor, or is on another car's roof."""
    if tag_id is None:
        return
    if not 0 <= tag_id <= LAST_TAG_ID:
        detail = f"tag_id: got {tag_id}, expected 0 to {LAST_TAG_ID}: tag36h11 has no other"
        raise _RefusedError("invalid", detail)
    if tag_id == world.city_map.tag.tag_id:
        raise _RefusedError("invalid", f"tag_id: {tag_id} is the map's own, on the floor")
    wearer = next((car.name for car in world.cars.all() if car.tag_id == tag_id), None)
    if wearer is not None:
        detail = f"tag_id: {wearer} has tag {tag_id}: take it off the map first, or raise the "
        raise _RefusedError("owned", detail + "map's first_vehicle_tag_id")


def _place(world: World, spawn: str, car_file: str) -> Pose2:
    """Return a free place to stand: that by name or coordinates, or the first of the map."""
    roads = world.roads
    if spawn:
        pose = roads.spawn_pose(spawn)
        if are_coordinates(spawn) and not world.has_room(car_file, pose):
            detail = f"spawn: a {car_file} at {spawn!r} would touch a wall or a box, or stand over "
            raise _RefusedError("occupied", f"{detail}the floor's edge; expected a place with room")
        if not is_free(world, pose):
            raise _RefusedError("occupied", f"spawn: a car stands at {spawn!r}")
        return pose
    for place in world.city_map.spawns:
        pose = roads.spawn_pose(place.name)
        if is_free(world, pose):
            return pose
    raise _RefusedError("full", f"no spawn place of map {world.city_map.name} is free")


def is_free(world: World, pose: Pose2) -> bool:
    """Return whether a car can be put there."""
    return world.cars.arrays.nearest_m(pose, ahead_s=AHEAD_S) >= CLEARANCE_M


def _boxes(world: World, request: BoxesRequest, now_ns: int, out: list[Outgoing]) -> BoxesReply:
    boxes = world.contacts.boxes
    boxes.reset()
    if len(boxes):
        by = request.by or "somebody"
        text = f"{by} put the boxes back to their places"
        out.append(city_event("info", "boxes_reset", text, now_ns))
    return BoxesReply(boxes=len(boxes))


_ANSWERS: dict[type[Request], Callable[[World, Any, int, list[Outgoing]], Message]] = {
    SpawnRequest: _spawn,
    JoinRequest: _join,
    RemoveRequest: _remove,
    RouteRequest: _route,
    LeaseRequest: _lease,
    LightRequest: _lights,
    BoxesRequest: _boxes,
    EchoRequest: _echo,
    StopRequest: _stop,
}

SERVICES = tuple(Service(kind) for kind in _ANSWERS)
