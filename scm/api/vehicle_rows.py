"""Vehicles as they are shown: the world's truth with trip, own report and the Eye's residual."""

from scm.api.picture import Picture, SeenPose, once_a_picture
from scm.camera.optics import fitted
from scm.records.eye import Residual
from scm.records.vehicles import TripRow, VehicleRow, VehiclesTopic
from scm.v2x.messages.world_snapshot import SnapshotVehicle

POSE_SHOWN_S = 2.0
TRIP_SHOWN_S = 10.0


@once_a_picture
def vehicles_topic(picture: Picture) -> VehiclesTopic:
    """Return all cars, by name."""
    held = picture.snapshot
    if held is None:
        return VehiclesTopic(t_ns=None, tick=None, real_time_factor=0.0, late_ticks=0, vehicles=())
    residuals = _residuals(picture)
    since_ms = 1000.0 * held.age_s(picture.now_ns)
    rows = [
        _row(
            car,
            since_ms,
            _trip(picture, car.vehicle),
            residuals.get(car.vehicle),
        )
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
    car: SnapshotVehicle,
    since_ms: float,
    trip: TripRow | None,
    eye: Residual | None,
) -> VehicleRow:
    return VehicleRow(
        vehicle=car.vehicle,
        kind=car.kind,
        car=car.car,
        cameras=tuple(fitted(car.car)),
        tag_id=car.tag_id,
        x_m=round(car.x_m, 4),
        y_m=round(car.y_m, 4),
        yaw_rad=round(car.yaw_rad, 4),
        speed_mps=round(car.speed_mps, 4),
        steering_rad=round(car.steering_rad, 4),
        owner=car.owner,
        epoch=car.epoch,
        lease_left_ms=None if car.lease_left_ms is None else round(car.lease_left_ms),
        battery_v=None if car.battery_v is None else round(car.battery_v, 2),
        battery_charge=None if car.battery_charge is None else round(car.battery_charge, 4),
        command_age_ms=None
        if car.command_age_ms is None
        else round(car.command_age_ms + since_ms, 1),
        mode=car.mode,
        age_ms=round(car.age_ms + since_ms, 1),
        alive=car.alive,
        lights=car.lights,
        throttle=None if car.throttle is None else round(car.throttle, 3),
        stuck=car.stuck,
        trip=trip,
        eye=eye,
    )


def _trip(picture: Picture, vehicle: str) -> TripRow | None:
    held = picture.trips.get(vehicle)
    if held is None or held.age_s(picture.now_ns) > TRIP_SHOWN_S:
        return None
    trip = held.message
    until_ns = trip.t_ns if trip.arrived_ns is None else trip.arrived_ns
    return TripRow(
        trip_id=trip.trip_id,
        done_m=round(trip.done_m, 2),
        length_m=None if trip.length_m is None else round(trip.length_m, 2),
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
