"""A car goes from one region's world to another's: all that is known of it there, as one record.

Arrays go as they lie in memory, so the car drives on bit by bit as it would have there. What all
regions know alike does not go: names, leases, tags, guards, switches, CAMs, what its car file says.
"""

import hashlib
import math
from collections.abc import Sequence

import msgspec
import numpy as np

from scm.arrays import AnyArray
from scm.errors import MessageError
from scm.v2x.etsi.events import CarWarnings, WarningMemory
from scm.vehicles.drivers.trips import ActiveTrip
from scm.world.hosted import ELSEWHERE, HostedCar
from scm.world.world import World


class CarTransfer(msgspec.Struct, frozen=True, kw_only=True, array_like=True):
    """One hosted car with its whole state.

    Attributes:
        index: Its vehicle index, the same in all regions.
        memory: Its rows of all arrays, one after the other.
        route: The lanes of its route, by number, as int64.
        trip: Its trip, or its last one.
        pending: Readings that have not come out: kind of sensor, time of measurement, values.
        path: When its low-frequency container was sent last, and the path in it.
        touched: When and what it touched in the last moment.
        against: What it pushes against, if it is stuck.
        event_ns, touched_ns: Of its last contact: when it was published, when it was.
        hits: What it has hit since its last warning.
        has_braked: Whether it has braked hard since then.
        is_low: Whether its low battery was reported.
        warnings: What it warns of.
    """

    index: int
    memory: bytes
    route: bytes
    trip: ActiveTrip | None
    pending: tuple[tuple[str, int, bytes], ...]
    path: tuple[int | None, bytes]
    touched: tuple[tuple[int, int], ...]
    against: tuple[str, ...] | None
    event_ns: int | None
    touched_ns: int | None
    hits: tuple[str, ...] | None
    has_braked: bool
    is_low: bool
    warnings: WarningMemory | None


def memory_of(world: World, car: HostedCar) -> Sequence[AnyArray]:
    """Return views of all arrays' rows of a car that is simulated here, in a fixed order."""
    index = car.index
    return (
        *world.cars.garage.memory(car.car_file, car.row),
        *world.cars.arrays.memory(index),
        *world.drivers.memory(index),
        *world.trips.memory(index),
        *world.alerts.stuck.memory(index),
        *(values[index] for values in world.sensors.readings.values()),
    )


def read(world: World, car: HostedCar, now_ns: int) -> CarTransfer:
    """Return all that is known of a car that is simulated here."""
    index, name = car.index, car.name
    warnings, impulses, stuck = world.radio.warnings, world.impulses, world.alerts.stuck
    warner = warnings.warners.get(name)
    return CarTransfer(
        index=index,
        memory=b"".join(values.tobytes() for values in memory_of(world, car)),
        route=world.drivers.route(index).tobytes(),
        trip=world.trips.trip(index),
        pending=tuple(
            (kind, t_ns, values)
            for kind, bank in world.sensors.banks.items()
            for t_ns, values in bank.pending(index)
        ),
        path=car.slow_news.memory,
        touched=stuck.touched(index, now_ns),
        against=stuck.against.get(index),
        event_ns=impulses.event_ns.get(name),
        touched_ns=impulses.touched_ns.get(name),
        hits=impulses.hits.get(name),
        has_braked=index in warnings.braked,
        is_low=world.alerts.low_batteries.is_low(name),
        warnings=None if warner is None else warner.memory,
    )


def digest(world: World, car: HostedCar, now_ns: int) -> bytes:
    """Return a digest of all that is known of a car that is simulated here: equal, if all is."""
    vehicles = world.cars.arrays
    motion = (vehicles.x, vehicles.y, vehicles.yaw, vehicles.speed, vehicles.yaw_rate)
    place = np.array([values[car.index] for values in motion])
    whole = msgspec.msgpack.encode(read(world, car, now_ns)) + place.tobytes()
    return hashlib.blake2b(whole, digest_size=16).digest()


def hand_out(world: World, car: HostedCar, now_ns: int) -> CarTransfer:
    """Remove a car from the floor here, and return all that another region needs to go on."""
    index, name = car.index, car.name
    transfer = read(world, car, now_ns)
    world.cars.garage.hand_out(car.car_file, car.row, index)
    world.trips.forget(index)
    world.alerts.stuck.forget(index)
    world.alerts.low_batteries.note(name, is_low=False)
    for bank in world.sensors.banks.values():
        bank.hand_out(index)
    for known in (world.impulses.event_ns, world.impulses.touched_ns, world.impulses.hits):
        known.pop(name, None)
    world.radio.warnings.warners.pop(name, None)
    world.radio.warnings.braked.discard(index)
    car.row = ELSEWHERE
    vehicles = world.cars.arrays
    vehicles.elsewhere[index], vehicles.driven[index] = True, False
    return transfer


def accept(world: World, transfer: CarTransfer) -> None:
    """Put a car on the floor here that another region has handed out.

    Raises:
        MessageError: when it is none of this city's cars, or is here already.
    """
    index, vehicles = transfer.index, world.cars.arrays
    known = 0 <= index < vehicles.capacity and bool(vehicles.elsewhere[index])
    if not known:
        raise MessageError(f"transfer of vehicle index {index}: expected a car that is elsewhere")
    name = vehicles.names[index]
    car = world.cars.hosted[name]
    car.row = world.cars.garage.accept(car.car_file, index)
    vehicles.elsewhere[index] = False
    _write(memory_of(world, car), transfer.memory, name)
    world.drivers.follow(index, np.frombuffer(transfer.route, np.int64))
    world.trips.resume(index, transfer.trip)
    for kind, bank in world.sensors.banks.items():
        bank.accept(index, car.row, [(t, v) for k, t, v in transfer.pending if k == kind])
    world.impulses.accelerations.carry(car.fleet, car.row)
    car.slow_news.memory = transfer.path
    _accept_events(world, name, transfer)


def _accept_events(world: World, name: str, transfer: CarTransfer) -> None:
    index, warnings, impulses = transfer.index, world.radio.warnings, world.impulses
    world.alerts.stuck.remember(index, transfer.touched)
    if transfer.against is not None:
        world.alerts.stuck.against[index] = transfer.against
    if transfer.event_ns is not None:
        impulses.event_ns[name] = transfer.event_ns
    if transfer.touched_ns is not None:
        impulses.touched_ns[name] = transfer.touched_ns
    if transfer.hits is not None:
        impulses.hits[name] = transfer.hits
    if transfer.has_braked:
        warnings.braked.add(index)
    world.alerts.low_batteries.note(name, is_low=transfer.is_low)
    if transfer.warnings is not None:
        warnings.warners[name] = CarWarnings(name)
        warnings.warners[name].memory = transfer.warnings


def _write(views: Sequence[AnyArray], memory: bytes, name: str) -> None:
    size = sum(view.nbytes for view in views)
    if size != len(memory):
        msg = f"transfer of {name}: expected {size} bytes of memory, got {len(memory)}"
        raise MessageError(msg)
    at = 0
    for view in views:
        count = math.prod(view.shape)
        view[...] = np.frombuffer(memory, view.dtype, count, at).reshape(view.shape)
        at += view.nbytes
