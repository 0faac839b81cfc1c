"""Radio transmission: each sent frame is delivered to the stations that receive it.

Drivers of hosted cars get it directly, all other subscribers on the bus: also the program that
holds a hosted car's lease. Bodies are not read here, except the CAMs, SPATEMs and DENMs that
drivers use.
"""

from collections.abc import Sequence
from dataclasses import fields

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import MessageError
from scm.records.city_map import Point
from scm.v2x.etsi.cam_spatem import CamBody
from scm.v2x.etsi.convert import ASSUMED_LENGTH_M, ASSUMED_WIDTH_M, cam_of, read_cam
from scm.v2x.exchange import Outgoing, RawSample
from scm.v2x.key import agrees
from scm.v2x.message import decode
from scm.v2x.messages.cam import CamRx, CamTx
from scm.v2x.messages.cpm import CpmRx, CpmTx
from scm.v2x.messages.denm import DenmRx, DenmTx
from scm.v2x.messages.mapem import MapemRx, MapemTx
from scm.v2x.messages.radio_status import RadioStatus
from scm.v2x.messages.spatem import SpatemRx, SpatemTx
from scm.v2x.messages.srem import SremRx, SremTx
from scm.v2x.messages.ssem import SsemRx, SsemTx
from scm.v2x.messages.vehicle_state import VehicleState
from scm.world.cars import AnyCar
from scm.world.publish import states_of
from scm.world.radio import Burst, Receivers
from scm.world.warnings import log_warning
from scm.world.world import World

Frame = CamTx | CpmTx | DenmTx | MapemTx | SpatemTx | SremTx | SsemTx
ReceivedFrame = CamRx | CpmRx | DenmRx | MapemRx | SpatemRx | SremRx | SsemRx

RECEIVED: dict[type[Frame], type[ReceivedFrame]] = {
    CamTx: CamRx,
    CpmTx: CpmRx,
    DenmTx: DenmRx,
    MapemTx: MapemRx,
    SpatemTx: SpatemRx,
    SremTx: SremRx,
    SsemTx: SsemRx,
}
"""All frame types: as sent, and as received."""
UNREAD = (CpmTx, MapemTx, SremTx, SsemTx)
"""Whose bodies only receivers read: a MAPEM takes longer than all else of its junction."""
TOUCHES_NS = NS_PER_S // 2  # for which a pushed car counts as touching: some CAMs long
OF_ROADSIDE = (MapemTx, SpatemTx, SsemTx)  # nobody else may send these
EYE = "eye"


def send_radio(world: World, now_ns: int) -> list[Outgoing]:
    """Send the frames of hosted cars that are due; return what is received, late frames first."""
    out: list[Outgoing] = [*world.radio.in_flight.arrived(now_ns)]
    if world.radio.load.is_due(now_ns):
        _measure(world, now_ns)
    if world.every["radio"].is_due(now_ns) and world.leads:
        out.append(status(world, now_ns))
    due = world.radio.cams.due(world.cars.arrays, now_ns, world.radio.load.control)
    if len(due):
        out += _send_cams(world, due, now_ns)
    for frame in world.radio.warnings.due:
        out += _send_denm(world, frame, now_ns)
    world.radio.warnings.due = ()
    return out


def transmit(world: World, frame: Frame, now_ns: int) -> list[Outgoing]:
    """Return a frame as every station receives it now; one of an unknown sender is dropped."""
    burst = _burst_of(world, type(frame), frame.station, now_ns)
    if burst is None:
        return []
    out = _deliver_to_drivers(world, frame, now_ns)
    if not world.leads:
        return []
    receivers = receivers_of(world)
    reached = _reached(world, burst, RECEIVED[type(frame)], receivers)
    return out + _deliver(world, burst, [frame], reached, receivers)


def relay(
    world: World, kind: type[Frame], station: str, sample: RawSample, now_ns: int
) -> list[Outgoing]:
    """Return a station's frame as every station receives it now; it is read only if one does.

    Raises:
        MessageError: when it cannot be read.
    """
    burst = _burst_of(world, kind, station, now_ns)
    if burst is None or not world.leads:
        return []
    receivers = receivers_of(world)
    reached = _reached(world, burst, RECEIVED[kind], receivers)
    if not reached.any():
        return []
    frame = decode(kind, sample.body, sample.attachment)
    if not agrees(sample.key, frame):
        msg = f"{sample.key}: the names inside are not those of its key"
        raise MessageError(msg)
    return _deliver(world, burst, [frame], reached, receivers)


def _burst_of(world: World, kind: type[Frame], station: str, now_ns: int) -> Burst | None:
    """Send a frame of a station that is no hosted car; None: it may not send, or is nowhere."""
    if kind in OF_ROADSIDE and station not in world.radio.roadside:
        world.ignored += 1
        return None
    place = antenna_of(world, station)
    if place is None:
        world.radio.link.counts.sent += world.leads
        world.radio.link.counts.unknown += world.leads
        return None
    x, y = np.array([place[0]]), np.array([place[1]])
    world.radio.load.note(kind_of(kind), x, y)
    return Burst(kind_of(kind), [station], x, y, now_ns)


def _reached(world: World, burst: Burst, kind: type[ReceivedFrame], receivers: Receivers) -> Bools:
    """Return which receivers (k, n) get the frames of a burst, and subscribe to them."""
    received = world.radio.link.reach(burst, receivers, _load(world, receivers))
    return received & _listens(world, kind, receivers)


def receivers_of(world: World) -> Receivers:
    """Return all stations that frames are brought to, except hosted cars with their own driver."""
    if not (world.cars.remote or world.cars.leased):
        return world.radio.units
    cars: list[AnyCar] = [*world.cars.remote.values(), *world.cars.leased.values()]
    places = {car.name: (car.pose.x, car.pose.y) for car in cars}
    return Receivers({**world.radio.roadside, **places})


def antenna_of(world: World, station: str) -> Point | None:
    """Return where a station that is no hosted car sends from; None: unknown."""
    if (car := world.cars.remote.get(station)) is not None:
        return car.pose.x, car.pose.y
    if station == EYE or station.startswith(f"{EYE}-"):
        (left, right), (low, high) = world.city_map.floor.x_m, world.city_map.floor.y_m
        return 0.5 * (left + right), 0.5 * (low + high)
    return world.radio.roadside.get(station)


def kind_of(kind: type[Frame]) -> str:
    """Return a frame's message type, as in `scm.v2x.congestion.BYTES`."""
    return kind.KEY.rpartition("/")[2]


def status(world: World, now_ns: int) -> RadioStatus:
    """Return the counts of frames since the last time, and how busy the channel is."""
    counts, before = world.radio.counts(), world.radio.published
    new = {f.name: getattr(counts, f.name) - getattr(before, f.name) for f in fields(counts)}
    for name, value in new.items():
        setattr(before, name, getattr(before, name) + value)
    late_ns, _ = new.pop("late_ns"), new.pop("lost")
    busy = world.radio.load
    others = {name: busy.ratio_of(name) for name in receivers_of(world).names}
    with_driver = world.cars.arrays.hosted.copy()
    with_driver[[car.index for car in world.cars.leased.values()]] = False
    all_of_them = np.array([*busy.ratio[with_driver], *others.values(), 0.0])
    stations = max(1, len(all_of_them) - 1)
    return RadioStatus(
        t_ns=now_ns,
        waiting=len(world.radio.in_flight) + world.radio.waiting_elsewhere,
        late_ms=late_ns / NS_PER_MS / max(1, new["late"]),
        busy_mean=float(all_of_them.sum()) / stations,
        busy_most=float(all_of_them.max()),
        stations=tuple(others),
        busy=tuple(others.values()),
        **new,
    )


def _listens(world: World, kind: type[ReceivedFrame], receivers: Receivers) -> Bools:
    """Return for each receiver whether anybody subscribes to its frames of a kind."""
    return np.array(world.subscribers.of(kind, "receiver", receivers.names), np.bool_)


def _measure(world: World, now_ns: int) -> None:
    vehicles = world.cars.arrays
    world.radio.load.measure(
        now_ns, vehicles.x, vehicles.y, vehicles.hosted, receivers_of(world).places
    )


def _load(world: World, receivers: Receivers) -> Floats | None:
    return world.radio.load.loss_of(receivers.names) if world.radio.load.is_measured else None


def _send_cams(world: World, due: Ints, now_ns: int) -> list[Outgoing]:
    vehicles = world.cars.arrays
    front = world.cars.arrays.front[due]
    x, y, yaw = vehicles.x[due], vehicles.y[due], vehicles.yaw[due]
    bumper_x, bumper_y = x + front * np.cos(yaw), y + front * np.sin(yaw)
    world.radio.load.note("cam", x, y)
    world.drivers.receive_cams(
        due, now_ns, bumper_x, bumper_y, yaw, vehicles.speed[due], vehicles.yaw_rate[due]
    )
    own = ~vehicles.elsewhere[due]
    made = np.zeros(len(due), np.bool_)
    made[own], out = _deliver_cams(world, due[own], x[own], y[own], now_ns)
    unmade = world.radio.cams.low_frequency_due(due, now_ns) & own & ~made
    bumpers = np.column_stack((bumper_x, bumper_y))[unmade].tolist()
    for index, bumper in zip(due[unmade].tolist(), bumpers, strict=True):
        world.cars.hosted[vehicles.names[index]].slow_news.note_sent(now_ns, *bumper)
    return out


def _send_denm(world: World, frame: DenmTx, now_ns: int) -> list[Outgoing]:
    """Send a hosted car's warning."""
    index = world.cars.hosted[frame.station].index
    x, y = (
        world.cars.arrays.x[index : index + 1].copy(),
        world.cars.arrays.y[index : index + 1].copy(),
    )
    world.radio.load.note("denm", x, y)
    out = _deliver_to_drivers(world, frame, now_ns)
    if world.cars.arrays.elsewhere[index]:
        return []
    receivers, burst = receivers_of(world), Burst("denm", [frame.station], x, y, now_ns)
    reached = _reached(world, burst, DenmRx, receivers)
    return out + _deliver(world, burst, [frame], reached, receivers, also_sent=True)


def _deliver_to_drivers(world: World, frame: Frame, now_ns: int) -> list[Outgoing]:
    """Give a frame to the drivers of hosted cars; return the events of a DENM."""
    if isinstance(frame, SpatemTx):
        world.drivers.receive_spatem(frame.body, now_ns)
    elif isinstance(frame, DenmTx):
        world.drivers.receive_denm(frame.body, now_ns)
        return log_warning(world, frame, now_ns)
    elif isinstance(frame, CamTx) and (car := world.cars.remote.get(frame.station)) is not None:
        _deliver_cam(world, car.index, frame.body, now_ns)
    return []


def _deliver_cam(world: World, index: int, body: CamBody, now_ns: int) -> None:
    """Give drivers a remote car's CAM; one without a place or a heading is ignored.

    A missing speed or yaw rate counts as zero, a missing size as that of a Nigel.
    """
    cam = read_cam(body)
    if cam.place is None or cam.yaw_rad is None:
        return
    length_m, width_m = cam.length_m or ASSUMED_LENGTH_M, cam.width_m or ASSUMED_WIDTH_M
    world.drivers.show(index, length_m, width_m)
    numbers = (*cam.place, cam.yaw_rad, cam.speed_mps or 0.0, cam.yaw_rate_radps or 0.0)
    columns = [np.array([number]) for number in numbers]
    world.drivers.receive_cams(np.array([index]), now_ns, *columns)


def _deliver_cams(
    world: World, due: Ints, x: Floats, y: Floats, now_ns: int
) -> tuple[Bools, list[Outgoing]]:
    """Return which CAMs of hosted cars were made (k,), and these for all but drivers.

    Only those are made that somebody receives, or that anybody on the bus subscribes to.
    """
    receivers, on_bus = receivers_of(world), world.subscribers.any(CamTx)
    listen = _listens(world, CamRx, receivers)
    if not (on_bus or listen.any()):
        world.radio.link.counts.sent += len(due)
        return np.zeros(len(due), np.bool_), []
    names = [world.cars.arrays.names[index] for index in due.tolist()]
    burst = Burst("cam", names, x, y, now_ns)
    reached = world.radio.link.reach(burst, receivers, _load(world, receivers)) & listen
    is_received = np.asarray(reached.any(axis=1) | on_bus)
    frames: list[Frame] = [
        _cam(world, s, now_ns) for s in states_of(world, due[is_received], now_ns)
    ]
    made = burst.of(is_received)
    out = _deliver(world, made, frames, reached[is_received], receivers, also_sent=True)
    return is_received, out


def _deliver(
    world: World,
    burst: Burst,
    frames: Sequence[Frame],
    reached: Bools,
    receivers: Receivers,
    *,
    also_sent: bool = False,
) -> list[Outgoing]:
    """Return frames (k,) as receivers (k, n) get them now; delayed ones wait for their arrival."""
    out: list[Outgoing] = []
    now_ns, delays = burst.t_ns, world.radio.link.delays(burst, reached)
    for row, frame in enumerate(frames):
        if also_sent:
            out.append(frame)
        for i in np.flatnonzero(reached[row]).tolist():
            received = _received(world, receivers.names[i], frame, now_ns)
            delay_ns = int(delays[row, i])
            if delay_ns:
                world.radio.in_flight.put(now_ns + delay_ns, received)
            else:
                out.append(received)
    return out


def _cam(world: World, state: VehicleState, now_ns: int) -> CamTx:
    hosted = world.cars.hosted[state.vehicle]
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


def _lost_ns(world: World, station: str) -> int:
    """Return the time that passed without a station's car being moved, since it came [ns]."""
    car = world.cars.remote.get(station)
    return world.pace.lost_ns if car is None else car.missed_ns


def _received(world: World, receiver: str, frame: Frame, now_ns: int) -> ReceivedFrame:
    if isinstance(frame, CamTx):
        car = world.cars.get(frame.station)
        return CamRx(
            receiver=receiver, station=frame.station, t_ns=frame.t_ns, body=frame.body,
            signed=frame.signed, lost_ns=_lost_ns(world, frame.station),
            car="" if car is None else car.car_file,
            by_hand=car is not None and car.lease.is_leased, stopped=world.stop.engaged,
            touches=now_ns - world.impulses.touched_ns.get(frame.station, -TOUCHES_NS) < TOUCHES_NS,
        )  # fmt: skip
    kind = RECEIVED[type(frame)]
    return kind(receiver=receiver, station=frame.station, t_ns=frame.t_ns, body=frame.body)  # type: ignore[arg-type]
