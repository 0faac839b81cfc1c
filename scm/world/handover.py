"""Hand cars over to the next city and take them from it, each exactly once.

A car that passes the border with its rear axle leaves: its record becomes one of an outgoing
transfer, in one write, and only then the transfer is sent. It is repeated until it is answered. The
next city stores car and transfer in one write before it answers; the same transfer again gets the
same answer. So a car is at any time in this city, on the way, or in the next one, whatever dies.
"""

from dataclasses import replace as with_fields

import numpy as np
from msgspec.structs import replace

from scm.clock import NS_PER_MS, seconds
from scm.errors import RunError, ScmError
from scm.geometry import Pose2
from scm.maps.border import Exit
from scm.maps.vehicle_tags import bound_tag
from scm.v2x.exchange import Answer, Incoming, Outgoing, PersistedState
from scm.v2x.message import Refused
from scm.v2x.messages.handover_request import HandedCar, HandoverReply, HandoverRequest
from scm.vehicles.drivers.limits import limits_of
from scm.vehicles.handed import parameters_of, past_of, put_state, variables_of
from scm.vehicles.lights import Switches
from scm.world.admission import problem_of, stranger
from scm.world.alerts import city_event
from scm.world.border import (
    REQUEST_EVERY_NS,
    STOP_BEFORE_M,
    VALID_MS,
    forget_ghosts,
    is_clear,
    reported,
    request_of,
    show_ghost,
)
from scm.world.border_state import ArrivalRecord, Leaving, OutgoingRecord, leaving
from scm.world.hosted import HostedCar
from scm.world.lease import grant
from scm.world.world import World

CATCH_UP_NS = 100 * NS_PER_MS  # a car that was on its way for longer has stood still meanwhile
ASIDE_M = 0.5  # of the middle of its lane: a car farther away is on another road
BACK_EVERY_M = 0.05
HERE = Pose2(0.0, 0.0, 0.0)
UNDECIDED = Refused(code="timeout", detail="no decision about the transfer came")


def depart(world: World, now_ns: int) -> list[Outgoing]:
    """Send away the cars whose rear axles have passed the border; repeat what was not answered."""
    border, out = world.border, list[Outgoing]()
    for name, claim in list(border.approaching.items()):
        car = world.cars.hosted.get(name)
        if car is None or not car.is_sent:
            continue
        ahead_m, left_m = claim.road.end.inverse().apply(car.pose.x, car.pose.y)
        if ahead_m >= 0.0 and abs(left_m) < ASIDE_M:  # it could not stop: the next city decides
            del border.approaching[name]
            out += _leave(world, car, claim.road, now_ns)
    for away in border.leaving.values():
        call = away.tries.due(now_ns)
        if call is not None:
            city, first = away.road.city, away.tries.tries == 1
            out.append(with_fields(call, city=city, after_store=first))
    return out


def _leave(world: World, car: HostedCar, road: Exit, now_ns: int) -> list[Outgoing]:
    """Turn a car into an outgoing transfer."""
    state = state_of(world, car, road, now_ns)
    request = replace(request_of(world, car, road), phase="commit", state=state)
    border, seen = world.border, reported(world, car, HERE)
    world.trips.leave(car.index, now_ns)
    out = world.remove(car.name)
    world.identities.highest_epoch = max(world.identities.highest_epoch, request.epoch)
    border.leaving[car.name] = leaving(road, request, now_ns)
    show_ghost(world, road.city, seen, now_ns)  # until the next city reports it
    record = OutgoingRecord(city=road.city, request=request)
    text = f"{car.name} drives on to {road.city}"
    return [
        *out,
        world.identities.epoch_record(),
        PersistedState("handovers", f"out/{car.name}", record),
        city_event("info", "vehicle_handed_over", text, now_ns, car.name),
    ]


def state_of(world: World, car: HostedCar, road: Exit, now_ns: int) -> HandedCar:
    """Return the whole state of a car, for the city that a road leads to."""
    packs = world.cars.garage.packs(car.car_file)
    return HandedCar(
        t_ns=world.pace.until_ns(now_ns),
        variables=variables_of(car.fleet, car.row),
        parameters=parameters_of(car.fleet, car.row),
        origin=(*road.origin.inverse(),),
        driver=world.drivers.handed(car.index, now_ns),
        past=past_of(car.fleet, car.row),
        drawn_as=packs.drawn_as(car.row),
        tag_id=car.tag_id,
        headlights=car.switches.headlights,
        indicators=car.switches.indicators,
    )


def receive_reply(world: World, item: Incoming, now_ns: int) -> list[Outgoing]:
    """Handle the answer of the next city to a request for a place, or to a transfer."""
    if item.call is None or not isinstance(item.call.request, HandoverRequest):
        return []
    request = item.call.request
    if request.phase == "reserve":
        return _place_answered(world, request, item, now_ns)
    away = world.border.leaving.get(request.vehicle)
    if away is None or away.request.epoch != request.epoch:
        return []
    reply = item.message
    if isinstance(reply, HandoverReply) and _transfer(reply) == _transfer(request):
        away.tries.receive(item)
        return _transfer_answered(world, away, reply, now_ns)
    away.tries.receive(with_fields(item, message=UNDECIDED))
    return []


def _transfer_answered(
    world: World, away: Leaving, reply: HandoverReply, now_ns: int
) -> list[Outgoing]:
    name, city = reply.vehicle, away.road.city
    if reply.refused == "stale":  # the car may be there or anywhere: a person has to look
        text = f"{name} is on its way to {city}, which knows a later transfer: {reply.detail}"
        return [city_event("error", "handover_stale", text, now_ns, name)]
    if reply.refused:
        refusal = Refused(code=reply.refused, detail=reply.detail)
        return _return(world, away, refusal, now_ns)
    del world.border.leaving[name]
    return [PersistedState("handovers", f"out/{name}", None)]


def _transfer(message: HandoverRequest | HandoverReply) -> tuple[str, str, int]:
    return message.city, message.vehicle, message.epoch


def _place_answered(
    world: World, request: HandoverRequest, item: Incoming, now_ns: int
) -> list[Outgoing]:
    claim, reply = world.border.approaching.get(request.vehicle), item.message
    if claim is None:
        return []
    if isinstance(reply, HandoverReply):
        valid_ms = min(VALID_MS, reply.valid_ms)
        claim.until_ns, claim.why = claim.sent_ns + valid_ms * NS_PER_MS, ""
        return []
    if not isinstance(reply, Refused) or claim.until_ns > now_ns or claim.why == reply.code:
        return []
    claim.why = reply.code
    text = f"{request.vehicle} waits at the border to {claim.road.city}: {reply.detail}"
    return [city_event("warning", "handover_waits", text, now_ns, request.vehicle)]


def _return(world: World, away: Leaving, refusal: Refused, now_ns: int) -> list[Outgoing]:
    """Put a car that the next city has refused for good back onto its lane, or try again later.

    It stands at the place nearest to the border that is free: others may stand there by now.
    """
    request, road, state = away.request, away.road, away.request.state
    again = leaving(road, request, now_ns + REQUEST_EVERY_NS)
    again.tries.tries = 1  # it is stored already
    world.border.leaving[request.vehicle] = again
    forget_ghosts(world, now_ns, request.vehicle)
    limits = limits_of(world.cars.garage.car(request.car))
    nearest_m = road.length_m - limits.front - 2.0 * STOP_BEFORE_M
    lane = world.roads.lanes[road.lane]
    places = np.arange(nearest_m, limits.rear, -BACK_EVERY_M).tolist()
    s = next((s for s in places if is_clear(world, lane.at(s), limits.length)), None)
    if state is None or s is None:
        return []
    pose = lane.at(s)
    try:
        car = _add(world, request, state, pose, now_ns)
    except RunError:  # the city is full: the car stays on its way
        return []
    del world.border.leaving[request.vehicle]
    world.trips.enter(car.index, car.name, road.lane, s, state.driver, now_ns)
    text = f"{car.name} is back at the border to {road.city}: {refusal.detail}"
    return [
        *world.arrival(car, now_ns, car.tag_id),
        PersistedState("handovers", f"out/{car.name}", None),
        city_event("warning", "handover_refused", text, now_ns, car.name),
    ]


def is_early(world: World, request: HandoverRequest, now_ns: int) -> bool:
    """Return whether a car comes from a moment that this world reaches with its next tick."""
    state = request.state
    return state is not None and world.pace.until_ns(now_ns) < state.t_ns <= now_ns


def reply_to_handover(
    world: World, request: HandoverRequest, now_ns: int, out: list[Outgoing]
) -> HandoverReply | Refused:
    """Reserve a place behind the border for a car, or take it; a refusal says why."""
    reply = _decide(world, request, now_ns, out)
    if request.phase == "reserve" or isinstance(reply, HandoverReply):
        return reply
    return HandoverReply(
        city=request.city,
        vehicle=request.vehicle,
        epoch=request.epoch,
        refused=reply.code,
        detail=reply.detail,
    )


def _decide(
    world: World, request: HandoverRequest, now_ns: int, out: list[Outgoing]
) -> HandoverReply | Refused:
    border, key = world.border, (request.city, request.vehicle)
    reply = HandoverReply(city=request.city, vehicle=request.vehicle, epoch=request.epoch)
    refused = stranger(world, request)
    if refused is not None:
        return refused
    before = border.arrivals.get(key)
    if before is not None and request.epoch <= before.epoch:
        return _again(request, before, reply)
    problem = problem_of(world, request, now_ns)
    if request.phase == "reserve":
        if problem is not None:
            return problem
        until_ns = now_ns + (VALID_MS + VALID_MS // 2) * NS_PER_MS  # on our clock, the way included
        border.reserved[request.lane] = key, until_ns
        return replace(reply, valid_ms=VALID_MS)
    if problem is None and request.state is not None:
        problem = _enter(world, request, request.state, now_ns, out)
    record = ArrivalRecord(epoch=request.epoch)
    if problem is not None:
        record = ArrivalRecord(epoch=request.epoch, refused=problem.code, detail=problem.detail)
    for city, vehicle in border.remember(key, record):
        out.append(PersistedState("handovers", f"in/{city}/{vehicle}", None))
    out.append(PersistedState("handovers", f"in/{request.city}/{request.vehicle}", record))
    return problem or reply


def _again(
    request: HandoverRequest, before: ArrivalRecord, reply: HandoverReply
) -> HandoverReply | Refused:
    """Return the answer to a transfer that was answered before, or to an older one."""
    if request.epoch < before.epoch or request.phase == "reserve":
        detail = f"epoch: got {request.epoch}, expected more than {before.epoch}"
        return Refused(code="stale", detail=detail)
    return Refused(code=before.refused, detail=before.detail) if before.refused else reply


def _enter(
    world: World, request: HandoverRequest, state: HandedCar, now_ns: int, out: list[Outgoing]
) -> Refused | None:
    """Continue a car that comes from another city, where and as it was."""
    name, border = request.vehicle, world.border
    forget_ghosts(world, now_ns, name)
    try:
        car = _add(world, request, state, Pose2(*request.border), now_ns)
        put_state(car.fleet, car.row, state)
        until_ns = world.pace.until_ns(now_ns)
        late_ns = until_ns - state.t_ns
        if 0 < late_ns <= CATCH_UP_NS:
            car.fleet.advance_rows(car.row, car.row + 1, seconds(late_ns))
        if car.has_diverged:
            raise RunError("state: its numbers are beyond every physical range")
        _locate(world, car)
        s, _ = world.roads.lane(request.lane).project(car.pose.x, car.pose.y)
        world.trips.enter(car.index, name, request.lane, s, state.driver, now_ns)
        world.drivers.continue_from(car.index, state.driver, until_ns)
    except (ScmError, ValueError, ArithmeticError) as cause:  # it comes from outside
        out += world.remove(name)
        return Refused(code="invalid", detail=str(cause))
    border.reserved.pop(request.lane, None)
    out += world.arrival(car, now_ns, car.tag_id)
    text = f"{name}, a {request.car}, came from {request.city}"
    out.append(city_event("info", "vehicle_arrived", text, now_ns, name))
    return None


def _add(
    world: World, request: HandoverRequest, state: HandedCar, pose: Pose2, now_ns: int
) -> HostedCar:
    """Put a handed car onto the map with all that does not depend on where it is.

    Raises:
        RunError: when no room is left for it.
    """
    tags, worn = world.identities.tags, state.tag_id
    may_have = not tags.is_reserved(worn) or bound_tag(world.city_map, request.vehicle) == worn
    tag_id = worn if may_have and tags.is_free(worn) else None
    car = world.host(request.vehicle, request.car, pose, now_ns, tag_id)
    epoch = max(car.lease.epoch, request.epoch + 1)
    car.lease = grant(car.lease.home, epoch)
    car.circulates = state.driver.then == "circulate"
    car.switches = Switches(state.headlights, state.indicators)
    world.cars.garage.packs(car.car_file).put_drawn(car.row, state.drawn_as)
    world.cars.arrays.driven[car.index] = True
    return car


def _locate(world: World, car: HostedCar) -> None:
    """Write where a car is into the arrays, for its driver's first decision here."""
    vehicles, fleet, row, index = world.cars.arrays, car.fleet, car.row, car.index
    vehicles.put(index, car.pose)
    vehicles.speed[index], vehicles.yaw_rate[index] = car.speed, fleet.yaw_rate[row]
    vehicles.throttle[index], vehicles.steering[index] = fleet.throttle[row], fleet.steering[row]


def answer(world: World, item: Incoming, now_ns: int) -> list[Outgoing]:
    """Answer a request of the city next to this one, or let it wait for the next tick."""
    request = item.message
    if not isinstance(request, HandoverRequest):
        return []
    if request.phase == "commit" and is_early(world, request, now_ns):
        world.border.early.append(item)
        return []
    out: list[Outgoing] = []
    reply = reply_to_handover(world, request, now_ns, out)
    return [*out, Answer(item, reply)]
