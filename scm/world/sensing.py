"""The sensor stage: read all devices that are due and subscribed to, and make messages."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.clock import NS_PER_S
from scm.v2x.message import Message
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.vehicles.bank import Bank, Readings
from scm.vehicles.external_vehicles import ExternalVehicles
from scm.vehicles.rays.grid import WallGrid
from scm.vehicles.rays.scene import Scene
from scm.vehicles.sensor import ENCODERS, sensor_messages
from scm.vehicles.sensors import lidar
from scm.world.boxes import Boxes
from scm.world.cars import Cars
from scm.world.solids import outline
from scm.world.subscribers import Subscribers
from scm.world.vehicle_arrays import VehicleArrays

SCANNER = "lidar"


@dataclass(slots=True)
class SensorState:
    """The sensors of all cars.

    Attributes:
        banks: The devices of all cars, by kind of sensor.
        readings: By kind and vehicle index the newest reading, NaN before the first; no LIDARs.
        external: Where the remote cars are, for their LIDARs: only the world can see for them.
        walls: What LIDARs see of the map.
    """

    banks: dict[str, Bank]
    readings: dict[str, Floats]
    external: ExternalVehicles
    walls: WallGrid

    def remove(self, index: int) -> None:
        """Remove the devices of a car."""
        for bank in self.banks.values():
            bank.unfit(index)
        for values in self.readings.values():
            values[index] = float("nan")


def sense(
    cars: Cars, sensors: SensorState, boxes: Boxes, subscribers: Subscribers, now_ns: int
) -> list[Message]:
    """Read all devices that are due; return what came out of them by now."""
    scans = _wanted(cars.arrays, subscribers, LidarScan)
    others = _wanted(cars.arrays, subscribers, VehicleSensors)
    out: list[Message] = []
    fresh: list[Readings] = []
    for kind, bank in sensors.banks.items():
        bank.wanted[:] = scans if kind == SCANNER else others
        if kind == SCANNER:
            for readings in bank.step(now_ns, lambda: _scene(cars, boxes, sensors.walls)):
                out += _scans(cars.arrays.names, readings)
            continue
        for readings in bank.step(now_ns):
            sensors.readings[kind][readings.indices] = readings.values
            if kind == ENCODERS:
                fresh.append(readings)
    for readings in fresh:
        newest = {kind: values[readings.indices] for kind, values in sensors.readings.items()}
        names = [cars.arrays.names[index] for index in readings.indices.tolist()]
        out += sensor_messages(names, readings.t_ns, newest)
    return out


def _wanted(vehicles: VehicleArrays, subscribers: Subscribers, kind: type[Message]) -> Bools:
    """Return by vehicle index whether anybody subscribes to such messages of its car."""
    here = vehicles.used & ~vehicles.elsewhere
    if subscribers.all(kind, "vehicle"):
        return here
    wanted = np.zeros(vehicles.capacity, np.bool_)
    if not subscribers.any(kind):
        return wanted
    used = np.flatnonzero(here)
    names = [vehicles.names[index] for index in used.tolist()]
    wanted[used] = subscribers.of(kind, "vehicle", names)
    return wanted


def _scene(cars: Cars, boxes: Boxes, walls: WallGrid) -> Scene:
    """Return all that LIDARs can see now: walls, boxes, cars."""
    vehicles = cars.arrays
    outlines: list[Floats] = [boxes.outline()]
    owners: list[Ints] = [np.full(len(boxes), -1)]
    for name in cars.garage.fleets:
        if len(own := cars.garage.indices(name)):
            outlines.append(outline(cars.garage.car(name), cars.garage.poses(name)))
            owners.append(own)
        if len(others := cars.garage.elsewhere(name)):
            poses = np.column_stack([v[others] for v in (vehicles.x, vehicles.y, vehicles.yaw)])
            outlines.append(outline(cars.garage.car(name), poses))
            owners.append(others)
    for car in cars.remote.values():
        outlines.append(outline(car.car, np.array([car.pose])))
        owners.append(np.array([car.index]))
    return Scene(walls, np.concatenate(outlines), np.concatenate(owners))


def _scans(names: Sequence[str], scans: Readings) -> Iterator[LidarScan]:
    nearest, farthest = scans.car.vector("lidar.range_m")
    first, step, _ = lidar.bearings_of(scans.car)
    sweep_ns = round(lidar.sweep_s(scans.car) * NS_PER_S)
    period_ns = round(NS_PER_S / scans.car.value("lidar.rate_hz"))
    ranges = scans.values.astype("<f4")
    for row, index in enumerate(scans.indices.tolist()):
        yield LidarScan(
            vehicle=names[index],
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
