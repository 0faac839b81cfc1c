"""What is sent over the radio comes out where it is heard.

With the drivers of hosted cars, who keep it themselves; on the bus for everybody else who listens.
"""

from collections.abc import Iterable

import numpy as np

from scm.arrays import Floats, Ints
from scm.v2x.etsi import CamBody
from scm.v2x.etsi_convert import cam_of, read_cam
from scm.v2x.messages.cam_rx import CamRx
from scm.v2x.messages.cam_tx import CamTx
from scm.v2x.messages.spatem_rx import SpatemRx
from scm.v2x.messages.spatem_tx import SpatemTx
from scm.v2x.messages.vehicle_state import VehicleState
from scm.world.publish import states_of
from scm.world.world import World

Frame = CamTx | SpatemTx


def call_out(world: World, now_ns: int) -> None:
    """Send the CAMs that hosted cars owe the air, and let the radio carry them."""
    slots = world.slots
    due = world.cams.due(slots, now_ns)
    if not len(due):
        return
    front = world.front[due]
    x, y, yaw = slots.x[due], slots.y[due], slots.yaw[due]
    bumper_x, bumper_y = x + front * np.cos(yaw), y + front * np.sin(yaw)
    world.crowd.hear(due, now_ns, bumper_x, bumper_y, yaw, slots.speed[due], slots.yaw_rate[due])
    _tell_others(world, due, x, y, now_ns)


def transmit(world: World, frame: Frame, now_ns: int) -> None:
    """Bring the frame of somebody who is not hosted to every station that hears it."""
    receivers = world.receivers()
    number = receivers.number(frame.station)
    if number is None:
        world.radio.counts.sent += 1
        world.radio.counts.unknown += 1
        return
    x, y = receivers.x[number : number + 1], receivers.y[number : number + 1]
    if isinstance(frame, SpatemTx):
        world.crowd.hear_spatem(frame.body, now_ns)
    elif (car := world.remote.get(frame.station)) is not None:
        _tell_drivers(world, car.slot, frame.body, now_ns)
    heard = world.radio.reach([frame.station], x, y, receivers)[0]
    names = [receivers.names[i] for i in np.flatnonzero(heard).tolist()]
    world.outbox += _received(world, frame, names)


def _tell_drivers(world: World, slot: int, body: CamBody, now_ns: int) -> None:
    told = read_cam(body)
    world.crowd.show(slot, told.length_m, told.width_m)
    numbers = (told.x_m, told.y_m, told.yaw_rad, told.speed_mps, told.yaw_rate_radps)
    columns = [np.array([number or 0.0]) for number in numbers]
    world.crowd.hear(np.array([slot]), now_ns, *columns)


def _tell_others(world: World, due: Ints, x: Floats, y: Floats, now_ns: int) -> None:
    """Bring hosted cars' CAMs to everybody else, and onto the bus, as far as anybody cares."""
    receivers, on_bus = world.receivers(), world.wishes.any(CamTx)
    listen = np.array(world.wishes.of(CamRx, "receiver", receivers.names), np.bool_)
    if not (on_bus or listen.any()):
        world.radio.counts.sent += len(due)
        return
    names = [world.slots.names[slot] for slot in due.tolist()]
    reached = world.radio.reach(names, x, y, receivers) & listen
    is_heard = reached.any(axis=1) | on_bus
    rows = np.flatnonzero(is_heard).tolist()
    for row, state in zip(rows, states_of(world, due[is_heard], now_ns), strict=True):
        frame = _cam(world, state, now_ns)
        world.outbox.append(frame)
        for i in np.flatnonzero(reached[row]).tolist():
            world.outbox.append(_received_cam(receivers.names[i], frame))


def _cam(world: World, state: VehicleState, now_ns: int) -> CamTx:
    hosted = world.hosted[state.vehicle]
    rear, front = hosted.car.vector("body.footprint_x_m")
    right, left = hosted.car.vector("body.footprint_y_m")
    body = cam_of(
        state,
        length_m=front - rear,
        width_m=left - right,
        front_m=front,
        low_frequency=hosted.slow_news.due(state, front),
    )
    return CamTx(station=state.vehicle, t_ns=now_ns, body=body)


def _received(world: World, frame: Frame, names: list[str]) -> Iterable[CamRx | SpatemRx]:
    kind = CamRx if isinstance(frame, CamTx) else SpatemRx
    for name, listens in zip(names, world.wishes.of(kind, "receiver", names), strict=True):
        if listens and isinstance(frame, CamTx):
            yield _received_cam(name, frame)
        elif listens and isinstance(frame, SpatemTx):
            yield SpatemRx(receiver=name, station=frame.station, t_ns=frame.t_ns, body=frame.body)


def _received_cam(receiver: str, frame: CamTx) -> CamRx:
    return CamRx(receiver=receiver, station=frame.station, t_ns=frame.t_ns, body=frame.body)
