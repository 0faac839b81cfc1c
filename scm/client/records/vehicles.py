"""Records of vehicles.

Written by docs/make/client.py: do not change it here.
"""

from typing import Literal

import msgspec

from scm.client.records.shared import Residual


class TripRow(msgspec.Struct, kw_only=True, frozen=True):
    """Progress of a trip; `length_m` is None for a route without end.

    Attributes:
        trip_id: Of this trip.
        done_m: How far the car is on its way [m].
        length_m: How long it is [m].
        arrived: Whether the car is at its goal.
        waiting_for: What it waits for; null: nothing.
        route: Lanes to pass, in this order.
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
        vehicle: Name of a car.
        kind: Of which sort it is.
        car: Name of its car file.
        cameras: Those that its file gives it; may be empty.
        tag_id: Number of an AprilTag.
        x_m: To the right on the map [m].
        y_m: Up on the map [m].
        yaw_rad: Direction, counter-clockwise from map x [rad].
        speed_mps: Speed, + = forward [m/s].
        steering_rad: Angle of the front wheels, + = left [rad].
        owner: Who holds it.
        epoch: Counts the leases of this car: a command of an older one is refused.
        lease_left_ms: Until the lease ends if it is not renewed; None: it is at home.
        battery_v: Of the drive battery, under load as it is; None: not measured.
        battery_charge: What is left in it, 0 to 1: counted by a simulated car, estimated from the
            voltage by a real one; None: not known.
        command_age_ms: How old the newest command of its leaseholder is, since it reached the car,
            the snapshot's age included; None: nobody else drives it, or none came yet.
        mode: What governs it now.
        age_ms: How old its newest state is now, the snapshot's own age included.
        alive: Whether it is there; false: it left or died.
        lights: Lamps that burn.
        throttle: As the car reports it; None: it reports nothing.
        stuck: It was told to drive for seconds and stays: what it most likely pushes against,
            names of cars, `wall`, boxes; empty: nothing that is known. None: it is not stuck.
        trip: The way it is on; null: none.
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
    """All vehicles and the world's pulse; `t_ns` and `tick` are None until it is heard.

    Attributes:
        t_ns: When it was true, by the clock of who tells it [ns].
        tick: Counts the steps of the world.
        real_time_factor: Simulated over elapsed time, over the last second.
        late_ticks: Ticks of the world that ended after the next was due, since its start.
        vehicles: Cars.
    """

    t_ns: int | None
    tick: int | None
    real_time_factor: float
    late_ticks: int
    vehicles: tuple[VehicleRow, ...]


class SpawnReply(msgspec.Struct, kw_only=True, frozen=True):
    """The car stands there; pose of its rear axle in the map frame.

    Attributes:
        vehicle: Name of a car.
        x_m: To the right on the map [m].
        y_m: Up on the map [m].
        yaw_rad: Direction, counter-clockwise from map x [rad].
        tag_id: Number of an AprilTag.
    """

    vehicle: str
    x_m: float
    y_m: float
    yaw_rad: float
    tag_id: int


class RemoveReply(msgspec.Struct, kw_only=True, frozen=True):
    """It is gone.

    Attributes:
        vehicle: Name of a car.
    """

    vehicle: str


class RouteReply(msgspec.Struct, kw_only=True, frozen=True):
    """The trip has begun.

    Attributes:
        vehicle: Name of a car.
        trip_id: Of this trip.
        route: The lanes the car will follow, those between the given ones filled in.
        length_m: How long it is [m].
    """

    vehicle: str
    trip_id: str
    route: tuple[str, ...]
    length_m: float | None


class LightReply(msgspec.Struct, kw_only=True, frozen=True):
    """How the switches stand now; tail, brake and reverse lamps follow by themselves.

    Attributes:
        vehicle: Name of a car.
        headlights: How they are switched.
        indicators: How they are switched.
    """

    vehicle: str
    headlights: Literal["high", "low", "off"]
    indicators: Literal["hazard", "left", "off", "right"]


class PathRow(msgspec.Struct, kw_only=True, frozen=True):
    """A car's way ahead; empty while it has no trip, or is not on it.

    Attributes:
        vehicle: Name of a car.
        trip_id: Of this trip.
        points_m: x and y in the map frame, every 5 cm, from the car on.
        is_whole: Whether it ends where the trip does, and not at 12 m.
    """

    vehicle: str
    trip_id: str | None
    points_m: tuple[tuple[float, ...], ...]
    is_whole: bool


class LinkRow(msgspec.Struct, kw_only=True, frozen=True):
    """How long the way to a car's owner and back is.

    Attributes:
        vehicle: Name of a car.
        answered_by: `world` for hosted cars, else the car's own `agent`.
        round_trip_ms: From here to it and back, its wait for its next step (20 ms) included.
        clock_ahead_ms: Its clock less ours, as if both ways took equally long.
    """

    vehicle: str
    answered_by: str
    round_trip_ms: float
    clock_ahead_ms: float
