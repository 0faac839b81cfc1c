"""The sensor stage: measure every car whose device is due, all cars of one file in one call."""

import numpy as np

from scm.arrays import Floats, Ints
from scm.v2x.message import Message
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.vehicles.car import Car
from scm.vehicles.sensor import Around, Reading
from scm.vehicles.sensors import lidar
from scm.world.hosted import HostedCar
from scm.world.hull import outline
from scm.world.world import SCANNER, World

ENCODERS, IMU = "encoders", "imu"


def sense(world: World, now_ns: int) -> list[Message]:
    """Read all devices that are due; return what came out of them by now."""
    faces = _Faces(world, now_ns)
    for kind in world.sensors:
        due: dict[str, list[HostedCar]] = {}
        for car in world.hosted.values():
            if kind in car.samplers and car.samplers[kind].is_due(now_ns):
                due.setdefault(car.car_file, []).append(car)
        for cars in due.values():
            _measure(world, kind, cars, faces, now_ns)
    _scan_for_remote(world, faces, now_ns)
    out: list[Message] = []
    for hosted in world.hosted.values():
        out += _readings(hosted, now_ns)
    for name, scanner in world.scanners.items():
        out += _scans(name, world.remote[name].car, scanner.ready(now_ns))
    return out


class _Faces:
    """What LIDARs can see, put together only when one of them looks."""

    def __init__(self, world: World, now_ns: int) -> None:
        self._world = world
        self._now_ns = now_ns
        self._seen: tuple[Floats, Ints] | None = None

    def around(self, own: Ints) -> Around:
        """Return walls and cars, for scanners on the cars of these slots."""
        if self._seen is None:
            self._seen = self._all()
        return Around(*self._seen, own)

    def _all(self) -> tuple[Floats, Ints]:
        world = self._world
        edges, owners = [world.walls], [np.full(len(world.walls), -1)]
        for name, fleet in world.garage.fleets.items():
            edges.append(outline(fleet.car, world.garage.poses(name)))
            owners.append(np.repeat(world.garage.slots(name), 4))
        for car in world.remote.values():
            edges.append(outline(car.car, np.array([car.pose])))
            owners.append(np.full(4, car.slot))
        return np.concatenate(edges), np.concatenate(owners)


def _measure(world: World, kind: str, cars: list[HostedCar], faces: _Faces, now_ns: int) -> None:
    rows = np.array([car.row for car in cars])
    around = faces.around(np.array([car.slot for car in cars])) if kind == SCANNER else None
    exact = world.sensors[kind].measure(cars[0].car, cars[0].fleet, rows, around)
    for car, values in zip(cars, exact, strict=True):
        car.samplers[kind].take(now_ns, values)


def _scan_for_remote(world: World, faces: _Faces, now_ns: int) -> None:
    for name, scanner in world.scanners.items():
        if scanner.is_due(now_ns):
            car = world.remote[name]
            x, y, _ = car.car.vector("lidar.position_m")
            at = (*car.pose.apply(x, y), car.pose.yaw)
            scanner.take(
                now_ns, lidar.scan(car.car, np.array([at]), faces.around(np.array([car.slot])))[0]
            )


def _readings(car: HostedCar, now_ns: int) -> list[Message]:
    """Return a car's scans, and a message for each new reading of the encoders."""
    out: list[Message] = []
    counted = False
    for kind, sampler in car.samplers.items():
        ready = sampler.ready(now_ns)
        if kind == SCANNER:
            out += _scans(car.name, car.car, ready)
        elif ready:
            car.readings[kind] = ready[-1]
            counted = counted or kind == ENCODERS
    if counted and IMU in car.readings:
        out.append(_sensors(car))
    return out


def _sensors(car: HostedCar) -> VehicleSensors:
    left, right = car.readings[ENCODERS].values.tolist()
    ax, ay, az, p, q, r = car.readings[IMU].values[:6].tolist()
    return VehicleSensors(
        vehicle=car.name,
        t_ns=car.readings[ENCODERS].t_ns,
        encoder_left=int(left),
        encoder_right=int(right),
        accel_mps2=(ax, ay, az),
        gyro_radps=(p, q, r),
    )


def _scans(name: str, car: Car, readings: list[Reading]) -> list[Message]:
    nearest, farthest = car.vector("lidar.range_m")
    return [
        LidarScan(
            vehicle=name,
            t_ns=reading.t_ns,
            beams=len(reading.values),
            range_min_m=nearest,
            range_max_m=farthest,
            payload=reading.values.astype("<f4").tobytes(),
        )
        for reading in readings
    ]
