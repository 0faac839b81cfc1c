"""The last stage of a tick: what the city is told, each kind at its own rate.

Hosted cars report themselves in turns, `STATES_A_TICK` a tick at most: up to so many cars each one
reports every tick, beyond that each one's rate falls in proportion (1000 cars: 20 Hz each).
"""

import math
from collections.abc import Iterator
from typing import TypedDict

import numpy as np

from scm.arrays import Ints
from scm.clock import NS_PER_MS, NS_PER_S, seconds
from scm.v2x.message import Message
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.world_snapshot import SnapshotVehicle, WorldSnapshot
from scm.vehicles.lights import Indicators, lamps
from scm.world import lease as rules
from scm.world.hosted import HostedCar
from scm.world.remote import RemoteCar
from scm.world.slots import MODES
from scm.world.world import NAME, World

STATES_A_TICK = 400
TRIPS_A_SECOND = 200
TRIP_NS = NS_PER_S // 2
TURNS: dict[int, Indicators] = {1: "left", -1: "right", 0: "off"}


class Told(TypedDict):
    """What the lamps of a car are told besides its switches."""

    hazard: bool
    turn: Indicators


LAMPS = {
    (hazard, code): Told(hazard=hazard, turn=turn)
    for hazard in (False, True)
    for code, turn in TURNS.items()
}


def publish(world: World, now_ns: int) -> None:
    """Put states, snapshot, trips, contacts and vital signs into the outbox."""
    if world.wishes.any(VehicleState):
        slots = _whose_turn(world)
        world.slots.seq[slots] += 1
        world.outbox += states_of(world, slots, now_ns)
    world.outbox += world.blows.take(now_ns)
    for remote in world.remote.values():
        contact = remote.contact(now_ns)
        if contact is not None:
            world.outbox.append(contact)
    if world.every["snapshot"].is_due(now_ns) and world.wishes.any(WorldSnapshot):
        world.outbox.append(snapshot(world, now_ns))
    world.trips.every_ns = max(TRIP_NS, len(world.hosted) * NS_PER_S // TRIPS_A_SECOND)
    world.outbox += world.trips.reports(now_ns)
    if world.every["second"].is_due(now_ns):
        world.outbox += _each_second(world, now_ns)


def states_of(world: World, of: Ints, now_ns: int) -> Iterator[VehicleState]:
    """Yield the reports of the hosted cars in some slots."""
    slots, signal = world.slots, world.garage.signal
    columns = (
        slots.seq, slots.x, slots.y, slots.yaw, slots.speed, signal("lateral_speed"),
        slots.yaw_rate, signal("accel_x") + signal("contact_accel_x"), signal("steer_angle"),
        slots.throttle, slots.steering, slots.mode, *world.garage.batteries(),
    )  # fmt: skip
    rows = zip(_cars(world, of), *(column[of].tolist() for column in columns), strict=True)
    for (
        (car, lit), seq, x, y, yaw, speed, lateral, yaw_rate, accel, wheels,
        throttle, steering, mode, volts, charge,
    ) in rows:  # fmt: skip
        yield VehicleState(
            vehicle=car.name,
            t_ns=now_ns,
            seq=seq,
            x_m=x,
            y_m=y,
            yaw_rad=yaw,
            speed_mps=speed,
            lateral_speed_mps=lateral,
            yaw_rate_radps=yaw_rate,
            accel_mps2=accel,
            steering_rad=wheels,
            throttle=throttle,
            steering=steering,
            source="simulated",
            epoch=car.lease.epoch,
            mode=MODES[mode],
            lights=lamps(car.switches, throttle, speed, now_ns, **lit),
            car=car.car_file,
            battery_v=None if math.isnan(volts) else volts,
            battery_charge=None if math.isnan(charge) else charge,
            command_age_ms=car.command_age_ms(now_ns),
        )


def _cars(world: World, of: Ints) -> list[tuple[HostedCar, Told]]:
    """Return the cars of some slots, and what their lamps are told by driver and guard."""
    slots, hosted, names = world.slots, world.hosted, world.slots.names
    hazards = slots.hazard[of].tolist()
    turns = (world.drivers.turn * slots.driven)[of].tolist()
    told = zip(of.tolist(), hazards, turns, strict=True)
    return [(hosted[names[slot]], LAMPS[hazard, turn]) for slot, hazard, turn in told]


def snapshot(world: World, now_ns: int) -> WorldSnapshot:
    """Return the truth of this instant."""
    return WorldSnapshot(
        t_ns=now_ns,
        tick=world.tick,
        vehicles=(
            *_hosted_in_snapshot(world, now_ns),
            *(_remote_in_snapshot(world, car, now_ns) for car in world.remote.values()),
        ),
        boxes=world.contacts.boxes.in_snapshot(),
        real_time_factor=world.pace.real_time_factor,
        late_ticks=world.pace.late_ticks,
    )


def _hosted_in_snapshot(world: World, now_ns: int) -> Iterator[SnapshotVehicle]:
    slots, signal = world.slots, world.garage.signal
    of = np.flatnonzero(slots.hosted)
    columns = (
        slots.x, slots.y, slots.yaw, slots.speed, slots.throttle, signal("steer_angle"),
        signal("roll"), signal("pitch"), slots.mode, *world.garage.batteries(),
    )  # fmt: skip
    rows = zip(_cars(world, of), *(column[of].tolist() for column in columns), strict=True)
    for (
        (car, lit), x, y, yaw, speed, throttle, steering, roll, pitch, mode, volts, charge,
    ) in rows:  # fmt: skip
        yield SnapshotVehicle(
            vehicle=car.name,
            kind=car.kind,
            car=car.car_file,
            tag_id=car.tag_id,
            x_m=x,
            y_m=y,
            yaw_rad=yaw,
            speed_mps=speed,
            steering_rad=steering,
            throttle=throttle,
            roll_rad=roll,
            pitch_rad=pitch,
            owner=car.lease.owner,
            epoch=car.lease.epoch,
            lease_left_ms=rules.left_ms(car.lease, now_ns),
            battery_v=None if math.isnan(volts) else volts,
            battery_charge=None if math.isnan(charge) else charge,
            command_age_ms=car.command_age_ms(now_ns),
            mode=MODES[mode],
            lights=lamps(car.switches, throttle, speed, now_ns, **lit),
            stuck=world.stuck.against.get(car.slot),
        )


def _remote_in_snapshot(world: World, car: RemoteCar, now_ns: int) -> SnapshotVehicle:
    state, age_ms = car.state, car.age_ns(now_ns) / NS_PER_MS
    x, y, yaw = car.pose
    return SnapshotVehicle(
        vehicle=car.name,
        kind=car.kind,
        car=car.car_file,
        tag_id=car.tag_id,
        x_m=x,
        y_m=y,
        yaw_rad=yaw,
        speed_mps=car.speed,
        steering_rad=0.0 if state is None else state.steering_rad,
        throttle=None if state is None else state.throttle,
        owner=car.lease.owner,
        epoch=car.lease.epoch,
        lease_left_ms=rules.left_ms(car.lease, now_ns),
        battery_v=None if state is None else state.battery_v,
        battery_charge=car.battery_charge,
        command_age_ms=_command_age_ms(state, age_ms),
        mode="idle" if state is None else state.mode,
        age_ms=age_ms,
        alive=car.alive,
        lights=() if state is None else state.lights,
        stuck=world.stuck.against.get(car.slot),
    )


def _command_age_ms(state: VehicleState | None, age_ms: float) -> float | None:
    if state is None or state.command_age_ms is None:
        return None
    return state.command_age_ms + age_ms


def _whose_turn(world: World) -> Ints:
    """Return the slots of the hosted cars that report in this tick."""
    hosted = np.flatnonzero(world.slots.hosted)
    if len(hosted) <= STATES_A_TICK:
        return hosted
    first = world.tick * STATES_A_TICK % len(hosted)
    return np.sort(np.take(hosted, np.arange(first, first + STATES_A_TICK), mode="wrap"))


def _each_second(world: World, now_ns: int) -> list[Message]:
    count = len(world.hosted) + len(world.remote)
    lost = world.pace.lost_ns // NS_PER_MS
    detail = f"{count} car{'s' * (count != 1)}" + (f", {lost} ms of time lost" if lost else "")
    lost_s = seconds(world.pace.lost_ns)
    status = PartStatus(station=NAME, t_ns=now_ns, detail=detail, cars=count, lost_s=lost_s)
    return [status, world.stop] if world.stop.engaged else [status]
