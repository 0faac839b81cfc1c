"""What is sent over the radio comes out where it is heard.

With the drivers of hosted cars, who keep it themselves; on the bus for everybody else who listens.
A body is a sealed letter here, but for the CAMs, SPATEMs and DENMs that drivers read.
"""

from collections.abc import Sequence
from dataclasses import fields

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.clock import NS_PER_MS, NS_PER_S
from scm.v2x.etsi.cam_spatem import CamBody
from scm.v2x.etsi.convert import ASSUMED_LENGTH_M, ASSUMED_WIDTH_M, cam_of, read_cam
from scm.v2x.messages.cam import CamRx, CamTx
from scm.v2x.messages.cpm import CpmRx, CpmTx
from scm.v2x.messages.denm import DenmRx, DenmTx
from scm.v2x.messages.mapem import MapemRx, MapemTx
from scm.v2x.messages.radio_status import RadioStatus
from scm.v2x.messages.spatem import SpatemRx, SpatemTx
from scm.v2x.messages.srem import SremRx, SremTx
from scm.v2x.messages.ssem import SsemRx, SsemTx
from scm.v2x.messages.vehicle_state import VehicleState
from scm.world.publish import states_of
from scm.world.radio import Receivers
from scm.world.warnings import call_denms, tell, watch
from scm.world.world import World

Frame = CamTx | CpmTx | DenmTx | MapemTx | SpatemTx | SremTx | SsemTx
Heard = CamRx | CpmRx | DenmRx | MapemRx | SpatemRx | SremRx | SsemRx

RECEIVED: dict[type[Frame], type[Heard]] = {
    CamTx: CamRx,
    CpmTx: CpmRx,
    DenmTx: DenmRx,
    MapemTx: MapemRx,
    SpatemTx: SpatemRx,
    SremTx: SremRx,
    SsemTx: SsemRx,
}
"""All that the air carries: as sent, and as heard."""
TOUCHES_NS = NS_PER_S // 2
"""For how long a car that was pushed counts as touching: some CAMs long."""
OF_ROADSIDE = (MapemTx, SpatemTx, SsemTx)
"""What nobody else may say."""


def call_out(world: World, now_ns: int) -> None:
    """Send what hosted cars owe the air, and let the radio carry it; what is late arrives."""
    world.outbox += world.late.arrived(now_ns)
    if world.busy.is_due(now_ns):
        _measure(world, now_ns)
    if world.every["radio"].is_due(now_ns):
        world.outbox.append(status(world, now_ns))
    due = world.cams.due(world.slots, now_ns, world.busy.control)
    if len(due):
        _call_cams(world, due, now_ns)
    watch(world)
    if world.every["denm"].is_due(now_ns):
        for frame in call_denms(world, now_ns):
            _call_denm(world, frame, now_ns)


def transmit(world: World, frame: Frame, now_ns: int) -> None:
    """Bring a frame to every station that hears it; one of nobody's is counted and dropped."""
    if isinstance(frame, OF_ROADSIDE) and frame.station not in world.roadside:
        world.ignored += 1
        return
    receivers = world.receivers()
    place = world.antenna(frame.station)
    if place is None:
        world.radio.counts.sent += 1
        world.radio.counts.unknown += 1
        return
    x, y = np.array([place[0]]), np.array([place[1]])
    world.busy.note(kind_of(frame), x, y)
    _tell_drivers(world, frame, now_ns)
    heard = world.radio.reach([frame.station], x, y, receivers, _load(world, receivers))
    listen = np.array(world.wishes.of(RECEIVED[type(frame)], "receiver", receivers.names), np.bool_)
    _deliver(world, [frame], heard & listen, receivers, now_ns)


def kind_of(frame: Frame) -> str:
    """Return a frame's message type, as in `scm.v2x.congestion.BYTES`."""
    return frame.KEY.rpartition("/")[2]


def status(world: World, now_ns: int) -> RadioStatus:
    """Return what became of the frames since the last time, and how busy the channel is."""
    counts, before = world.radio.counts, world.radio_before
    new = {f.name: getattr(counts, f.name) - getattr(before, f.name) for f in fields(counts)}
    for name, value in new.items():
        setattr(before, name, getattr(before, name) + value)
    late_ns, _ = new.pop("late_ns"), new.pop("lost")
    busy = world.busy
    others = {name: busy.ratio_of(name) for name in world.receivers().names}
    all_of_them = np.array([*busy.ratio[world.slots.hosted], *others.values(), 0.0])
    stations = max(1, len(all_of_them) - 1)
    return RadioStatus(
        t_ns=now_ns,
        waiting=len(world.late),
        late_ms=late_ns / NS_PER_MS / max(1, new["late"]),
        busy_mean=float(all_of_them.sum()) / stations,
        busy_most=float(all_of_them.max()),
        stations=tuple(others),
        busy=tuple(others.values()),
        **new,
    )


def _measure(world: World, now_ns: int) -> None:
    slots = world.slots
    world.busy.measure(now_ns, slots.x, slots.y, slots.hosted, world.receivers().places)


def _load(world: World, receivers: Receivers) -> Floats | None:
    return world.busy.loss_of(receivers.names) if world.busy.is_measured else None


def _call_cams(world: World, due: Ints, now_ns: int) -> None:
    slots = world.slots
    front = world.front[due]
    x, y, yaw = slots.x[due], slots.y[due], slots.yaw[due]
    bumper_x, bumper_y = x + front * np.cos(yaw), y + front * np.sin(yaw)
    world.busy.note("cam", x, y)
    world.drivers.receive_cams(
        due, now_ns, bumper_x, bumper_y, yaw, slots.speed[due], slots.yaw_rate[due]
    )
    _tell_others(world, due, x, y, now_ns)


def _call_denm(world: World, frame: DenmTx, now_ns: int) -> None:
    """Send a hosted car's warning."""
    slot = world.hosted[frame.station].slot
    x, y = world.slots.x[slot : slot + 1].copy(), world.slots.y[slot : slot + 1].copy()
    world.busy.note("denm", x, y)
    _tell_drivers(world, frame, now_ns)
    receivers = world.receivers()
    reached = world.radio.reach([frame.station], x, y, receivers, _load(world, receivers))
    listen = np.array(world.wishes.of(DenmRx, "receiver", receivers.names), np.bool_)
    _deliver(world, [frame], reached & listen, receivers, now_ns, also_sent=True)


def _tell_drivers(world: World, frame: Frame, now_ns: int) -> None:
    """Let the drivers of hosted cars keep what they read."""
    if isinstance(frame, SpatemTx):
        world.drivers.receive_spatem(frame.body, now_ns)
    elif isinstance(frame, DenmTx):
        world.drivers.receive_denm(frame.body, now_ns)
        tell(world, frame, now_ns)
    elif isinstance(frame, CamTx) and (car := world.remote.get(frame.station)) is not None:
        _tell_of_car(world, car.slot, frame.body, now_ns)


def _tell_of_car(world: World, slot: int, body: CamBody, now_ns: int) -> None:
    """Let drivers hear a car's CAM; one without a place or a heading tells them nothing.

    A speed or a turn that it does not tell is taken as none, a size as that of a Nigel.
    """
    told = read_cam(body)
    if told.place is None or told.yaw_rad is None:
        return
    length_m, width_m = told.length_m or ASSUMED_LENGTH_M, told.width_m or ASSUMED_WIDTH_M
    world.drivers.show(slot, length_m, width_m)
    numbers = (*told.place, told.yaw_rad, told.speed_mps or 0.0, told.yaw_rate_radps or 0.0)
    columns = [np.array([number]) for number in numbers]
    world.drivers.receive_cams(np.array([slot]), now_ns, *columns)


def _tell_others(world: World, due: Ints, x: Floats, y: Floats, now_ns: int) -> None:
    """Bring hosted cars' CAMs to everybody else, and onto the bus, as far as anybody cares."""
    receivers, on_bus = world.receivers(), world.wishes.any(CamTx)
    listen = np.array(world.wishes.of(CamRx, "receiver", receivers.names), np.bool_)
    if not (on_bus or listen.any()):
        world.radio.counts.sent += len(due)
        return
    names = [world.slots.names[slot] for slot in due.tolist()]
    reached = world.radio.reach(names, x, y, receivers, _load(world, receivers)) & listen
    is_heard = reached.any(axis=1) | on_bus
    frames: list[Frame] = [_cam(world, s, now_ns) for s in states_of(world, due[is_heard], now_ns)]
    _deliver(world, frames, reached[is_heard], receivers, now_ns, also_sent=True)


def _deliver(
    world: World,
    frames: Sequence[Frame],
    reached: Bools,
    receivers: Receivers,
    now_ns: int,
    *,
    also_sent: bool = False,
) -> None:
    """Put frames (k,) that reach receivers (k, n) into the outbox, at once or when they arrive."""
    delays = iter(world.radio.delays(int(reached.sum())).tolist())
    for row, frame in enumerate(frames):
        if also_sent:
            world.outbox.append(frame)
        for i in np.flatnonzero(reached[row]).tolist():
            heard = _received(world, receivers.names[i], frame, now_ns)
            delay_ns = next(delays)
            if delay_ns:
                world.late.put(now_ns + delay_ns, heard)
            else:
                world.outbox.append(heard)


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


def _received(world: World, receiver: str, frame: Frame, now_ns: int) -> Heard:
    if isinstance(frame, CamTx):
        car = world.car(frame.station)
        return CamRx(
            receiver=receiver, station=frame.station, t_ns=frame.t_ns, body=frame.body,
            signed=frame.signed, lost_ns=world.lost_ns(frame.station),
            car="" if car is None else car.car_file,
            by_hand=car is not None and not car.lease.is_at_home, stopped=world.stop.engaged,
            touches=now_ns - world.touched_ns.get(frame.station, -TOUCHES_NS) < TOUCHES_NS,
        )  # fmt: skip
    kind = RECEIVED[type(frame)]
    return kind(receiver=receiver, station=frame.station, t_ns=frame.t_ns, body=frame.body)  # type: ignore[arg-type]
