"""The sensor stage: every device that is due and wanted reads; what comes out of them is told.

To add a kind that is told, give it a place in `_sensors`; a kind of its own message, a line in
`sense`.
"""

import math
from collections.abc import Iterator

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.clock import NS_PER_S
from scm.v2x.message import Message
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.vehicles.bank import Readings
from scm.vehicles.rays.scene import Scene
from scm.vehicles.sensors import lidar
from scm.world.hull import outline
from scm.world.world import SCANNER, World

ENCODERS, IMU, IPS = "encoders", "imu", "ips"
THROTTLE, STEERING = "throttle_feedback", "steering_feedback"


def sense(world: World, now_ns: int) -> list[Message]:
    """Read all devices that are due; return what came out of them by now."""
    scans, sensors = _wanted(world, LidarScan), _wanted(world, VehicleSensors)
    out: list[Message] = []
    fresh: list[Readings] = []
    for kind, bank in world.banks.items():
        bank.wanted[:] = scans if kind == SCANNER else sensors
        if kind == SCANNER:
            for readings in bank.step(now_ns, lambda: _scene(world)):
                out += _scans(world, readings)
            continue
        for readings in bank.step(now_ns):
            world.readings[kind][readings.slots] = readings.values
            if kind == ENCODERS:
                fresh.append(readings)
    for readings in fresh:
        out += _sensors(world, readings)
    return out


def _wanted(world: World, kind: type[Message]) -> Bools:
    """Return by slot whether anybody wants such messages of its car."""
    slots, wishes = world.slots, world.wishes
    if wishes.all(kind, "vehicle"):
        return slots.used
    wanted = np.zeros(slots.capacity, np.bool_)
    if not wishes.any(kind):
        return wanted
    used = np.flatnonzero(slots.used)
    names = [slots.names[slot] for slot in used.tolist()]
    wanted[used] = wishes.of(kind, "vehicle", names)
    return wanted


def _scene(world: World) -> Scene:
    """Return all that LIDARs can see now: walls, boxes, cars."""
    boxes = world.contacts.boxes
    outlines: list[Floats] = [boxes.outline()]
    owners: list[Ints] = [np.full(len(boxes), -1)]
    for name in world.garage.fleets:
        if len(own := world.garage.slots(name)):
            outlines.append(outline(world.garage.car(name), world.garage.poses(name)))
            owners.append(own)
    for car in world.remote.values():
        outlines.append(outline(car.car, np.array([car.pose])))
        owners.append(np.array([car.slot]))
    return Scene(world.wall_grid, np.concatenate(outlines), np.concatenate(owners))


def _sensors(world: World, encoders: Readings) -> Iterator[VehicleSensors]:
    """Yield a message for each new reading of encoders, with the newest of all other devices."""
    of = encoders.slots[~np.isnan(world.readings[IMU][encoders.slots, 0])]
    newest = [
        world.readings[kind][of].tolist() for kind in (ENCODERS, IMU, THROTTLE, STEERING, IPS)
    ]
    for slot, (left, right), imu, (throttle,), (steering,), (x, y, yaw) in zip(
        of.tolist(), *newest, strict=True
    ):
        yield VehicleSensors(
            vehicle=world.slots.names[slot],
            t_ns=encoders.t_ns,
            encoder_left=int(left),
            encoder_right=int(right),
            accel_mps2=(imu[0], imu[1], imu[2]),
            gyro_radps=(imu[3], imu[4], imu[5]),
            orientation_rad=(imu[6], imu[7], imu[8]),
            throttle=_known(throttle),
            steering_rad=_known(steering),
            ips_m=None if math.isnan(x) else (x, y),
            ips_yaw_rad=_known(yaw),
        )


def _known(value: float) -> float | None:
    return None if math.isnan(value) else value


def _scans(world: World, scans: Readings) -> Iterator[LidarScan]:
    nearest, farthest = scans.car.vector("lidar.range_m")
    first, step, _ = lidar.bearings_of(scans.car)
    sweep_ns = round(lidar.sweep_s(scans.car) * NS_PER_S)
    period_ns = round(NS_PER_S / scans.car.value("lidar.rate_hz"))
    ranges = scans.values.astype("<f4")
    for row, slot in enumerate(scans.slots.tolist()):
        yield LidarScan(
            vehicle=world.slots.names[slot],
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
