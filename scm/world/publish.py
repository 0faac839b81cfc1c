"""Publish what is due: states, snapshots, trips, contacts and status, each at its own rate.

Hosted cars report themselves in turns, `STATES_A_TICK` a tick at most: up to so many cars each one
reports every tick, beyond that each one's rate falls in proportion (1000 cars: 20 Hz each).
"""

import math
from collections.abc import Iterator
from typing import TypedDict

import numpy as np

from scm.arrays import Ints
from scm.clock import NS_PER_MS, NS_PER_S, seconds
from scm.v2x.exchange import Outgoing
from scm.v2x.message import Message
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.world_snapshot import SnapshotVehicle, WorldSnapshot
from scm.vehicles.lights import Indicators, lamps
from scm.world import lease as rules
from scm.world.alerts import NAME
from scm.world.hosted import HostedCar
from scm.world.remote import RemoteCar
from scm.world.vehicle_arrays import MODES
from scm.world.world import World

STATES_A_TICK = 400  # of hosted cars: more would delay the tick
TRIPS_A_SECOND = 200
TRIP_NS = NS_PER_S // 2  # between two reports of a trip, at the least
TURNS: dict[int, Indicators] = {1: "left", -1: "right", 0: "off"}


class LampState(TypedDict):
    """The lamps that a car's driver or guard switches."""

    hazard: bool
    turn: Indicators


LAMPS = {
    (hazard, code): LampState(hazard=hazard, turn=turn)
    for hazard in (False, True)
    for code, turn in TURNS.items()
}


def publish(world: World, now_ns: int) -> list[Outgoing]:
    """Return the states, snapshot, trips, contacts and status messages that are due."""
    out: list[Outgoing] = []
    if world.subscribers.any(VehicleState):
        turn = _whose_turn(world)
        world.cars.arrays.seq[turn] += 1
        out += states_of(world, turn[~world.cars.arrays.elsewhere[turn]], now_ns)
    out += world.impulses.reports.pop(now_ns)
    for remote in world.cars.remote.values():
        contact = remote.contact(now_ns)
        if contact is not None:
            out.append(contact)
    if world.every["snapshot"].is_due(now_ns) and world.subscribers.any(WorldSnapshot):
        out.append(snapshot(world, now_ns))
    world.trips.every_ns = max(TRIP_NS, len(world.cars.hosted) * NS_PER_S // TRIPS_A_SECOND)
    out += world.trips.reports(now_ns)
    if world.every["second"].is_due(now_ns) and world.leads:
        out += _each_second(world, now_ns)
    return out


def states_of(world: World, of: Ints, now_ns: int) -> Iterator[VehicleState]:
    """Yield the reports of the hosted cars with some indices."""
    vehicles, signal = world.cars.arrays, world.cars.garage.signal
    columns = (
        vehicles.seq, vehicles.x, vehicles.y, vehicles.yaw, vehicles.speed, signal("lateral_speed"),
        vehicles.yaw_rate, signal("accel_x") + signal("contact_accel_x"), signal("steer_angle"),
        vehicles.throttle, vehicles.steering, vehicles.mode, *world.cars.garage.batteries(),
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


def _cars(world: World, of: Ints) -> list[tuple[HostedCar, LampState]]:
    """Return the cars of some indices, and the lamps that driver and guard switch."""
    vehicles, hosted, names = world.cars.arrays, world.cars.hosted, world.cars.arrays.names
    hazards = vehicles.hazard[of].tolist()
    turns = (world.drivers.turn * vehicles.driven)[of].tolist()
    states = zip(of.tolist(), hazards, turns, strict=True)
    return [(hosted[names[index]], LAMPS[hazard, turn]) for index, hazard, turn in states]


def snapshot(world: World, now_ns: int) -> WorldSnapshot:
    """Return the truth of this instant."""
    return WorldSnapshot(
        t_ns=now_ns,
        tick=world.tick,
        vehicles=(
            *_hosted_in_snapshot(world, now_ns),
            *(_remote_in_snapshot(world, car, now_ns) for car in world.cars.remote.values()),
        ),
        boxes=world.contacts.boxes.in_snapshot(),
        real_time_factor=world.pace.real_time_factor,
        late_ticks=world.pace.late_ticks,
    )


def _hosted_in_snapshot(world: World, now_ns: int) -> Iterator[SnapshotVehicle]:
    vehicles, signal = world.cars.arrays, world.cars.garage.signal
    of = np.flatnonzero(vehicles.hosted & ~vehicles.elsewhere)
    columns = (
        vehicles.x, vehicles.y, vehicles.yaw, vehicles.speed, vehicles.throttle,
        signal("steer_angle"), signal("roll"), signal("pitch"), vehicles.mode,
        *world.cars.garage.batteries(),
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
            stuck=world.alerts.stuck.against.get(car.index),
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
        stuck=world.alerts.stuck.against.get(car.index),
    )


def _command_age_ms(state: VehicleState | None, age_ms: float) -> float | None:
    if state is None or state.command_age_ms is None:
        return None
    return state.command_age_ms + age_ms


def _whose_turn(world: World) -> Ints:
    """Return the indices of the hosted cars that report in this tick."""
    hosted = np.flatnonzero(world.cars.arrays.hosted)
    if len(hosted) <= STATES_A_TICK:
        return hosted
    first = world.tick * STATES_A_TICK % len(hosted)
    return np.sort(np.take(hosted, np.arange(first, first + STATES_A_TICK), mode="wrap"))


def _each_second(world: World, now_ns: int) -> list[Message]:
    count = len(world.cars.hosted) + len(world.cars.remote)
    lost = world.pace.lost_ns // NS_PER_MS
    detail = f"{count} car{'s' * (count != 1)}" + (f", {lost} ms of time lost" if lost else "")
    lost_s = seconds(world.pace.lost_ns)
    status = PartStatus(station=NAME, t_ns=now_ns, detail=detail, cars=count, lost_s=lost_s)
    return [status, world.stop] if world.stop.engaged else [status]
