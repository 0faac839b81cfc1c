"""Vehicles as they are shown: the world's truth with trip, own report and the Eye's residual."""

from typing import Any

from scm.api.picture import Picture, SeenPose, once_a_picture
from scm.camera.optics import fitted
from scm.records.eye import Residual
from scm.records.vehicles import TripRow, VehicleRow, VehiclesTopic
from scm.v2x.messages.world_snapshot import SnapshotVehicle

POSE_SHOWN_S = 2.0
TRIP_SHOWN_S = 10.0
AS_SENT = (
    "vehicle", "kind", "car", "tag_id", "owner", "epoch", "mode", "alive", "lights", "stuck",
)  # fmt: skip
DIGITS = {
    "x_m": 4, "y_m": 4, "yaw_rad": 4, "speed_mps": 4, "steering_rad": 4, "throttle": 3,
    "battery_v": 2, "battery_charge": 4,
}  # fmt: skip


@once_a_picture
def vehicles_topic(picture: Picture) -> VehiclesTopic:
    """Return all cars, by name."""
    held = picture.snapshot
    if held is None:
        return VehiclesTopic(t_ns=None, tick=None, real_time_factor=0.0, late_ticks=0, vehicles=())
    residuals = _residuals(picture)
    since_ms = 1000.0 * held.age_s(picture.now_ns)
    rows = [
        _row(car, since_ms, _trip(picture, car.vehicle), residuals.get(car.vehicle))
        for car in sorted(held.message.vehicles, key=lambda car: car.vehicle)
    ]
    return VehiclesTopic(
        t_ns=held.message.t_ns,
        tick=held.message.tick,
        real_time_factor=round(held.message.real_time_factor, 3),
        late_ticks=held.message.late_ticks,
        vehicles=tuple(rows),
    )


def _row(
    car: SnapshotVehicle, since_ms: float, trip: TripRow | None, eye: Residual | None
) -> VehicleRow:
    command_age_ms = None if car.command_age_ms is None else car.command_age_ms + since_ms
    return VehicleRow(
        **{name: getattr(car, name) for name in AS_SENT},
        **{name: _rounded(getattr(car, name), digits) for name, digits in DIGITS.items()},
        cameras=tuple(fitted(car.car)),
        lease_left_ms=None if car.lease_left_ms is None else round(car.lease_left_ms),
        command_age_ms=_rounded(command_age_ms, 1),
        age_ms=round(car.age_ms + since_ms, 1),
        trip=trip,
        eye=eye,
    )


def _rounded(value: float | None, digits: int) -> Any:
    return None if value is None else round(value, digits)


def _trip(picture: Picture, vehicle: str) -> TripRow | None:
    held = picture.trips.get(vehicle)
    if held is None or held.age_s(picture.now_ns) > TRIP_SHOWN_S:
        return None
    trip = held.message
    until_ns = trip.t_ns if trip.arrived_ns is None else trip.arrived_ns
    return TripRow(
        trip_id=trip.trip_id,
        done_m=round(trip.done_m, 2),
        length_m=_rounded(trip.length_m, 2),
        arrived=trip.arrived_ns is not None,
        waiting_for=trip.waiting_for,
        route=trip.route,
        void=picture.disturbances.void_reasons(trip.started_ns, until_ns),
    )


def _residuals(picture: Picture) -> dict[str, Residual]:
    newest: dict[str, SeenPose] = {}
    for (_, vehicle), seen in picture.poses.items():
        if seen.held.age_s(picture.now_ns) > POSE_SHOWN_S:
            continue
        other = newest.get(vehicle)
        if other is None or other.held.arrived_ns < seen.held.arrived_ns:
            newest[vehicle] = seen
    return {name: seen.residual for name, seen in newest.items() if seen.residual is not None}
