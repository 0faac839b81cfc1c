"""Interpolates the cars' poses between two snapshots."""

import math

import msgspec

from scm.camera.motion import STILL, along
from scm.clock import seconds
from scm.geometry import Pose2, wrap_angle
from scm.v2x.messages.world_snapshot import SnapshotVehicle, WorldSnapshot

JUMP_M = 0.3


def between(before: WorldSnapshot, after: WorldSnapshot, t_ns: int) -> tuple[SnapshotVehicle, ...]:
    """Return the cars of `after` where they were at a time between the two.

    One that was not there before, or was put elsewhere, is where it is.
    """
    span_ns = after.t_ns - before.t_ns
    share = (t_ns - before.t_ns) / span_ns if span_ns else 1.0
    if share >= 1.0:
        return after.vehicles
    earlier = {car.vehicle: car for car in before.vehicles}
    return tuple(_between(earlier.get(car.vehicle), car, share) for car in after.vehicles)


def _between(start: SnapshotVehicle | None, end: SnapshotVehicle, share: float) -> SnapshotVehicle:
    if start is None or math.hypot(end.x_m - start.x_m, end.y_m - start.y_m) > JUMP_M:
        return end

    def mixed(a: float, b: float) -> float:
        return a + share * (b - a)

    return msgspec.structs.replace(
        end,
        x_m=mixed(start.x_m, end.x_m),
        y_m=mixed(start.y_m, end.y_m),
        yaw_rad=wrap_angle(start.yaw_rad + share * wrap_angle(end.yaw_rad - start.yaw_rad)),
        steering_rad=mixed(start.steering_rad, end.steering_rad),
        roll_rad=mixed(start.roll_rad, end.roll_rad),
        pitch_rad=mixed(start.pitch_rad, end.pitch_rad),
        lights=start.lights if share < 0.5 else end.lights,
    )


def motion(before: WorldSnapshot, after: WorldSnapshot, vehicle: str, time_s: float) -> Pose2:
    """Return how a car moves in a time, by its poses in two snapshots: the later seen from before.

    One that was not there before, or was put elsewhere, stands.
    """
    ends = [car for one in (before, after) for car in one.vehicles if car.vehicle == vehicle]
    if len(ends) < 2 or math.hypot(ends[1].x_m - ends[0].x_m, ends[1].y_m - ends[0].y_m) > JUMP_M:
        return STILL
    first, last = (Pose2(car.x_m, car.y_m, car.yaw_rad) for car in ends)
    return along(first.inverse() @ last, time_s / seconds(after.t_ns - before.t_ns))


def near(snapshot: WorldSnapshot, vehicle: str, reach_m: float) -> WorldSnapshot:
    """Return a snapshot with the cars around one of them, itself included.

    A car whose pose is not finite is left out.
    """
    own = next(car for car in snapshot.vehicles if car.vehicle == vehicle)
    x, y = own.x_m, own.y_m
    cars = tuple(
        car
        for car in snapshot.vehicles
        if abs(car.x_m - x) < reach_m and abs(car.y_m - y) < reach_m and _is_somewhere(car)
    )
    return msgspec.structs.replace(snapshot, vehicles=cars)


def _is_somewhere(car: SnapshotVehicle) -> bool:
    turned = car.yaw_rad + car.roll_rad + car.pitch_rad + car.steering_rad
    return math.isfinite(car.x_m + car.y_m + turned)
