"""The first stage of a tick: everything that arrived, each kind where it belongs.

What comes from outside never stops the city: what fits nothing is counted in `World.ignored`.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from scm.runtime.part import Subscription
from scm.v2x.exchange import Answer, Incoming
from scm.v2x.message import Message, Request
from scm.v2x.messages.cam import CamTx
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.presence import Presence
from scm.v2x.messages.vehicle_state import VehicleState
from scm.world.air import RECEIVED, Frame, transmit
from scm.world.remote import is_plausible
from scm.world.requests import reply_to
from scm.world.watch import lose
from scm.world.world import World

VEHICLE_ROLE = "v"


def hear(world: World, now_ns: int, inbox: Sequence[Incoming]) -> None:
    """Take in what arrived, in order; answers go to the outbox."""
    for item in inbox:
        message = item.message
        if isinstance(message, Request):
            world.outbox.append(Answer(item, reply_to(world, message, now_ns)))
        elif (handler := _HANDLERS.get(type(message))) is not None:
            handler(world, message, now_ns)


def _state(world: World, state: VehicleState, now_ns: int) -> None:
    car = world.remote.get(state.vehicle)
    if car is None or not is_plausible(state):
        world.ignored += state.vehicle not in world.hosted
        return
    was_alive = car.alive
    if car.follow(state, now_ns) and not was_alive:
        world.say("info", "vehicle_back", f"{car.name} reports again", now_ns, car.name)


def _command(world: World, command: DriveCommand, now_ns: int) -> None:
    car = world.hosted.get(command.vehicle)
    if car is None:
        return  # for an agent
    if car.lease.is_at_home or command.epoch != car.lease.epoch:
        world.ignored += 1
        return
    if car.guard is not None and car.guard.accept(command, now_ns):
        car.switches = car.switches.updated(command.headlights, command.indicators)


def _frame(world: World, frame: Frame, now_ns: int) -> None:
    if frame.station not in world.hosted:  # the bus brings our own cars' frames back
        transmit(world, frame, now_ns)


def _verdict(world: World, status: MonitorStatus, now_ns: int) -> None:
    del now_ns
    world.drivers.receive_monitor_status(status)


def _presence(world: World, presence: Presence, now_ns: int) -> None:
    if presence.alive:
        world.sessions[presence.session] = presence.station
    else:
        world.sessions.pop(presence.session, None)
    car = world.remote.get(presence.station)
    if car is None or presence.session != car.session:
        return
    if presence.alive:
        car.dead = False  # its agent, or we, slept for longer than the link waits
    else:
        lose(world, car, f"the session of {car.name} ended", now_ns, dead=True)


_HANDLERS: dict[type[Message], Callable[[World, Any, int], None]] = {
    VehicleState: _state,
    DriveCommand: _command,
    **dict.fromkeys(RECEIVED, _frame),
    MonitorStatus: _verdict,
    Presence: _presence,
}

OF_CARS: dict[type[Message], str] = {VehicleState: "vehicle", CamTx: "station"}
"""What is heard of remote cars alone, with its key part: what hosted cars say would come back."""


def hears_of(cars: Iterable[str]) -> tuple[Subscription, ...]:
    """Return what the world hears while these remote cars are in it."""
    shared = [
        Subscription(kind, {"role": VEHICLE_ROLE} if kind is Presence else {})
        for kind in _HANDLERS
        if kind not in OF_CARS
    ]
    return (
        *shared,
        *(Subscription(kind, {key: car}) for car in cars for kind, key in OF_CARS.items()),
    )
