"""The first stage of a tick: handle all messages that arrived, by kind.

Input from outside never stops the city: messages without effect are counted in `World.ignored`.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from scm.errors import MessageError
from scm.runtime.part import Subscription
from scm.v2x.exchange import Answer, Incoming, Outgoing, RawSample
from scm.v2x.key import names_in
from scm.v2x.message import Message, Request
from scm.v2x.messages.border_cars import BorderCars
from scm.v2x.messages.cam import CamTx
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.handover_request import HandoverRequest
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.presence import Presence
from scm.v2x.messages.vehicle_state import VehicleState
from scm.world.alerts import city_event
from scm.world.border import receive_cars
from scm.world.handover import answer, receive_reply
from scm.world.remote import is_plausible
from scm.world.requests import reply_to
from scm.world.transmission import RECEIVED, UNREAD, Frame, relay, transmit
from scm.world.watch import lose
from scm.world.world import World

VEHICLE_ROLE = "v"


def receive(world: World, now_ns: int, inbox: Sequence[Incoming | RawSample]) -> list[Outgoing]:
    """Handle what arrived, in order; return answers and what follows from them."""
    out: list[Outgoing] = []
    for item in (*world.border.pop_early(), *inbox):
        if isinstance(item, RawSample):
            out += _unread_frame(world, item, now_ns)
            continue
        message = item.message
        if item.call is not None:
            out += receive_reply(world, item, now_ns)
        elif isinstance(message, HandoverRequest):
            out += answer(world, item, now_ns)
        elif isinstance(message, Request):
            reply = reply_to(world, message, now_ns, out)
            out.append(Answer(item, reply))
        elif (handler := _HANDLERS.get(type(message))) is not None:
            out += handler(world, message, now_ns)
    return out


def _state(world: World, state: VehicleState, now_ns: int) -> Sequence[Outgoing]:
    car = world.cars.remote.get(state.vehicle)
    if car is None or not is_plausible(state):
        world.ignored += state.vehicle not in world.cars.hosted
        return ()
    was_alive = car.alive
    if car.follow(state, now_ns) and not was_alive:
        text = f"{car.name} reports again"
        return (city_event("info", "vehicle_back", text, now_ns, car.name),)
    return ()


def _command(world: World, command: DriveCommand, now_ns: int) -> Sequence[Outgoing]:
    car = world.cars.hosted.get(command.vehicle)
    if car is None:
        return ()  # for an agent
    if not car.lease.is_leased or command.epoch != car.lease.epoch:
        world.ignored += 1
        return ()
    if car.guard is not None and car.guard.accept(command, now_ns):
        car.switches = car.switches.updated(command.headlights, command.indicators)
    return ()


def _frame(world: World, frame: Frame, now_ns: int) -> Sequence[Outgoing]:
    if frame.station in world.cars.hosted:  # the bus brings our own cars' frames back
        return ()
    return transmit(world, frame, now_ns)


def _unread_frame(world: World, sample: RawSample, now_ns: int) -> Sequence[Outgoing]:
    for kind in UNREAD:
        names = names_in(kind, sample.key)
        if names is None:
            continue
        station = dict(names)["station"]
        if station in world.cars.hosted:  # as above
            return ()
        try:
            return relay(world, kind, station, sample, now_ns)
        except MessageError:
            break
    world.ignored += 1
    return ()


def _monitor_status(world: World, status: MonitorStatus, now_ns: int) -> Sequence[Outgoing]:
    del now_ns
    world.drivers.receive_monitor_status(status)
    return ()


def _presence(world: World, presence: Presence, now_ns: int) -> Sequence[Outgoing]:
    if presence.alive:
        world.sessions[presence.session] = presence.station
    else:
        world.sessions.pop(presence.session, None)
    car = world.cars.remote.get(presence.station)
    if car is None or presence.session != car.session:
        return ()
    if not presence.alive:
        return lose(car, f"the session of {car.name} ended", now_ns, dead=True)
    car.dead = False  # its agent, or we, slept for longer than the link waits
    return ()


_HANDLERS: dict[type[Message], Callable[[World, Any, int], Sequence[Outgoing]]] = {
    VehicleState: _state,
    DriveCommand: _command,
    **dict.fromkeys(RECEIVED, _frame),
    MonitorStatus: _monitor_status,
    Presence: _presence,
    BorderCars: receive_cars,
}

OF_CARS: dict[type[Message], str] = {VehicleState: "vehicle", CamTx: "station"}
"""What is received of remote cars only, with its key part; hosted cars publish these themselves."""


def subscriptions_of(cars: Iterable[str]) -> tuple[Subscription, ...]:
    """Return what the world receives while these remote cars are in it."""
    shared = [
        Subscription(kind, {"role": VEHICLE_ROLE} if kind is Presence else {})
        for kind in _HANDLERS
        if kind not in OF_CARS and kind not in UNREAD
    ]
    return (
        *shared,
        *(Subscription(kind, raw=True) for kind in UNREAD),
        *(Subscription(kind, {key: car}) for car in cars for kind, key in OF_CARS.items()),
    )
