"""The sensor stage: all devices that are due and wanted read; their readings become messages."""

from collections.abc import Iterator

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.clock import NS_PER_S
from scm.v2x.message import Message
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.vehicles.bank import Readings
from scm.vehicles.rays.scene import Scene
from scm.vehicles.sensor import ENCODERS, sensor_messages
from scm.vehicles.sensors import lidar
from scm.world.solids import outline
from scm.world.world import SCANNER, World


def sense(world: World, now_ns: int) -> list[Message]:
    """Read all devices that are due; return what came out of them by now."""
    scans, sensors = _wanted(world, LidarScan), _wanted(world, VehicleSensors)
    out: list[Message] = []
    fresh: list[Readings] = []
    for kind, bank in world.sensors.banks.items():
        bank.wanted[:] = scans if kind == SCANNER else sensors
        if kind == SCANNER:
            for readings in bank.step(now_ns, lambda: _scene(world)):
                out += _scans(world, readings)
            continue
        for readings in bank.step(now_ns):
            world.sensors.readings[kind][readings.indices] = readings.values
            if kind == ENCODERS:
                fresh.append(readings)
    for readings in fresh:
        newest = {kind: values[readings.indices] for kind, values in world.sensors.readings.items()}
        names = [world.vehicles.names[index] for index in readings.indices.tolist()]
        out += sensor_messages(names, readings.t_ns, newest)
    return out


def _wanted(world: World, kind: type[Message]) -> Bools:
    """Return by slot whether anybody wants such messages of its car."""
    vehicles, subscribers = world.vehicles, world.subscribers
    if subscribers.all(kind, "vehicle"):
        return vehicles.used
    wanted = np.zeros(vehicles.capacity, np.bool_)
    if not subscribers.any(kind):
        return wanted
    used = np.flatnonzero(vehicles.used)
    names = [vehicles.names[index] for index in used.tolist()]
    wanted[used] = subscribers.of(kind, "vehicle", names)
    return wanted


def _scene(world: World) -> Scene:
    """Return all that LIDARs can see now: walls, boxes, cars."""
    boxes = world.contacts.boxes
    outlines: list[Floats] = [boxes.outline()]
    owners: list[Ints] = [np.full(len(boxes), -1)]
    for name in world.garage.fleets:
        if len(own := world.garage.indices(name)):
            outlines.append(outline(world.garage.car(name), world.garage.poses(name)))
            owners.append(own)
    for car in world.remote.values():
        outlines.append(outline(car.car, np.array([car.pose])))
        owners.append(np.array([car.index]))
    return Scene(world.sensors.walls, np.concatenate(outlines), np.concatenate(owners))


def _scans(world: World, scans: Readings) -> Iterator[LidarScan]:
    nearest, farthest = scans.car.vector("lidar.range_m")
    first, step, _ = lidar.bearings_of(scans.car)
    sweep_ns = round(lidar.sweep_s(scans.car) * NS_PER_S)
    period_ns = round(NS_PER_S / scans.car.value("lidar.rate_hz"))
    ranges = scans.values.astype("<f4")
    for row, index in enumerate(scans.indices.tolist()):
        yield LidarScan(
            vehicle=world.vehicles.names[index],
            t_ns=scans.t_ns,
            beams=ranges.shape[1],
            range_min_m=nearest,
            range_max_m=farthest,
            payload=ranges[row].tobytes(),
            bearing_first_rad=first,
            bearing_step_rad=step,
            sweep_ns=sweep_ns,
            period_ns=period_ns,
        )
