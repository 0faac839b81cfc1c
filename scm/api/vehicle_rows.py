"""Vehicles as they are shown: the world's truth with trip, own report and the Eye's residual."""

import msgspec

from scm.api.picture import Picture, SeenPose, once_a_picture
from scm.api.residual import Residual
from scm.camera.optics import fitted
from scm.v2x.messages.world_snapshot import SnapshotVehicle

POSE_SHOWN_S = 2.0
TRIP_SHOWN_S = 10.0


class TripRow(msgspec.Struct, kw_only=True, frozen=True):
    """Progress of a trip; `length_m` is None for a route without end.

    Attributes:
        void: Why its time so far says nothing of the city, in words; none: it counts.
    """

    trip_id: str
    done_m: float
    length_m: float | None
    arrived: bool
    waiting_for: str | None
    route: tuple[str, ...]
    void: tuple[str, ...]


class VehicleRow(msgspec.Struct, kw_only=True, frozen=True):
    """One car; pose of the rear axle's centre in the map frame.

    Attributes:
        cameras: Those that its file gives it; may be empty.
        age_ms: How old its newest state is now, the snapshot's own age included.
        lease_left_ms: Until the lease ends if it is not renewed; None: it is at home.
        battery_v: Of the drive battery, under load as it is; None: not measured.
        battery_charge: What is left in it, 0 to 1: counted by a simulated car, estimated from the
            voltage by a real one; None: not known.
        command_age_ms: How old the newest command of its leaseholder is, since it reached the car,
            the snapshot's age included; None: nobody else drives it, or none came yet.
        throttle: As the car reports it; None: it reports nothing.
        stuck: It was told to drive for seconds and stays: what it most likely pushes against, names
            of cars, `wall`, boxes; empty: nothing that is known. None: it is not stuck.
        eye: What the Eye's newest pose differs from the truth; None: not seen lately.
    """

    vehicle: str
    kind: str
    car: str
    cameras: tuple[str, ...]
    tag_id: int
    x_m: float
    y_m: float
    yaw_rad: float
    speed_mps: float
    steering_rad: float
    owner: str
    epoch: int
    lease_left_ms: float | None
    battery_v: float | None
    battery_charge: float | None
    command_age_ms: float | None
    mode: str
    age_ms: float
    alive: bool
    lights: tuple[str, ...]
    throttle: float | None
    stuck: tuple[str, ...] | None
    trip: TripRow | None
    eye: Residual | None


class VehiclesTopic(msgspec.Struct, kw_only=True, frozen=True):
    """All vehicles and the world's pulse; `t_ns` and `tick` are None until it is heard."""

    t_ns: int | None
    tick: int | None
    real_time_factor: float
    late_ticks: int
    vehicles: tuple[VehicleRow, ...]


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
