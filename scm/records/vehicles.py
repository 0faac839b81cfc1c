"""Vehicles: state, trip, planned path and link."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from scm.records.body import Body
from scm.records.eye import Residual
from scm.records.fields import (
    XM,
    YM,
    CameraNames,
    CarName,
    IsAlive,
    KindName,
    LengthM,
    ModeName,
    OwnerName,
    RouteLanes,
    SpeedMps,
    TagId,
    TNs,
    TripId,
    VehicleName,
    VoidReasons,
    YawRad,
)


class PathRow(msgspec.Struct, kw_only=True, frozen=True):
    """A car's way ahead; empty while it has no trip, or is not on it.

    Attributes:
        points_m: x and y in the map frame, every 5 cm, from the car on.
        is_whole: Whether it ends where the trip does, and not at 12 m.
    """

    vehicle: VehicleName
    trip_id: TripId | None
    points_m: tuple[tuple[float, ...], ...]
    is_whole: bool


class TripRow(msgspec.Struct, kw_only=True, frozen=True):
    """Progress of a trip; `length_m` is None for a route without end.

    Attributes:
        done_m: How far the car is on its way [m].
        arrived: Whether the car is at its goal.
        void: Why its time so far does not count; none: it does.
    """

    trip_id: TripId
    done_m: float
    length_m: LengthM | None
    arrived: bool
    waiting_for: (
        Annotated[str, Meta(description="What it waits for; null: nothing.", examples=["crossing"])]
        | None
    )
    route: RouteLanes
    void: VoidReasons


class VehicleRow(msgspec.Struct, kw_only=True, frozen=True):
    """One car; pose of the rear axle's centre in the map frame.

    A record beside the world's `SnapshotVehicle`: what pages and programs see of a car, with its
    trip and the Eye's residual, changes without the message.

    Attributes:
        cameras: Those that its file gives it; may be empty.
        steering_rad: Angle of the front wheels, + = left [rad].
        epoch: Counts the leases of this car: a command of an older one is refused.
        age_ms: How old its newest state is now, the snapshot's own age included.
        lease_left_ms: Until the lease ends if it is not renewed; None: it is at home.
        battery_v: Of the drive battery, under load as it is; None: not measured.
        battery_charge: What is left in it, 0 to 1: counted by a simulated car, estimated from the
            voltage by a real one; None: not known.
        command_age_ms: How old the newest command of its leaseholder is, since it reached the car,
            the snapshot's age included; None: it is not leased, or none came yet.
        throttle: As the car reports it; None: it reports nothing.
        stuck: It was commanded to drive for seconds and stays: what it most likely pushes against,
            names of cars, `wall`, boxes; empty: nothing that is known. None: it is not stuck.
        trip: The way it is on; null: none.
        eye: What the Eye's newest pose differs from the truth; None: not seen lately.
    """

    vehicle: VehicleName
    kind: KindName
    car: CarName
    cameras: CameraNames
    tag_id: TagId
    x_m: XM
    y_m: YM
    yaw_rad: YawRad
    speed_mps: SpeedMps
    steering_rad: float
    owner: OwnerName
    epoch: int
    lease_left_ms: float | None
    battery_v: float | None
    battery_charge: float | None
    command_age_ms: float | None
    mode: ModeName
    age_ms: float
    alive: IsAlive
    lights: Annotated[
        tuple[str, ...],
        Meta(description="Lamps that burn.", examples=[["headlights_low", "indicator_left"]]),
    ]
    throttle: float | None
    stuck: Annotated[tuple[str, ...], Meta(examples=[["wall"]])] | None
    trip: TripRow | None
    eye: Residual | None


class VehiclesTopic(msgspec.Struct, kw_only=True, frozen=True):
    """All vehicles and the world's time; `t_ns` and `tick` are None until it is received.

    Attributes:
        tick: Counts the steps of the world.
        real_time_factor: Simulated over elapsed time, over the last second.
        late_ticks: Ticks of the world that ended after the next was due, since its start.
        vehicles: Cars.
    """

    t_ns: TNs | None
    tick: int | None
    real_time_factor: float
    late_ticks: int
    vehicles: tuple[VehicleRow, ...]


class LinkRow(msgspec.Struct, kw_only=True, frozen=True):
    """How long the way to a car's owner and back is.

    Attributes:
        answered_by: `world` for hosted cars, else the car's own `agent`.
        round_trip_ms: From here to it and back, its wait for its next step (20 ms) included.
        clock_ahead_ms: Its clock less ours, as if both ways took equally long.
    """

    vehicle: VehicleName
    answered_by: Annotated[str, Meta(examples=["world"])]
    round_trip_ms: float
    clock_ahead_ms: float


class SpawnBody(Body, kw_only=True, frozen=True):
    """A hosted car to put on the map; everything may be left to the world."""

    vehicle: Annotated[
        str,
        Meta(
            pattern=r"^[a-z0-9_-]{0,32}$",
            description="its name; empty: the world names it",
            examples=["n9"],
        ),
    ] = ""
    car: Annotated[
        str,
        Meta(pattern=r"^[a-z0-9_-]{0,32}$", description="name of its car file", examples=["nigel"]),
    ] = "nigel"
    spawn: Annotated[
        str,
        Meta(
            max_length=64,
            description=(
                "a spawn place, or X,Y,DEG (metres, degrees, map frame); empty: any free one"
            ),
            examples=["north_1", "1.384,0.655,315"],
        ),
    ] = ""


class RouteBody(Body, kw_only=True, frozen=True):
    """Where to go; `via` empty: circulate for ever."""

    via: Annotated[
        tuple[str, ...],
        Meta(
            max_length=200,
            description="lanes to pass, in this order",
            examples=[["outer_north", "outer_west"]],
        ),
    ] = ()
    laps: Annotated[
        int, Meta(ge=1, le=10000, description="how often to pass them", examples=[2])
    ] = 1
    speed_mps: (
        Annotated[
            float,
            Meta(
                gt=0.0,
                le=10.0,
                description="target speed on a free road; null: the limits",
                examples=[0.3],
            ),
        ]
        | None
    ) = None
    then: Annotated[
        Literal["stop", "circulate"],
        Meta(description="at the end of the last lane: stand, or drive on without end"),
    ] = "stop"


class ParkBody(Body, kw_only=True, frozen=True):
    """Where a car that parks itself is to park."""

    goal: Annotated[
        str,
        Meta(
            min_length=1,
            max_length=64,
            description=(
                "a spawn place or bay of the map, `any` for any bay, or X,Y,DEG (metres, degrees, "
                "map frame) of the rear axle's centre"
            ),
            examples=["n3", "any", "0.75,0,0"],
        ),
    ]


class LightsBody(Body, kw_only=True, frozen=True):
    """How to switch headlights and indicators; what is left out stays as it is."""

    headlights: Annotated[
        Literal["off", "low", "high"] | None,
        Meta(description="null: as they are", examples=["low"]),
    ] = None
    indicators: Annotated[
        Literal["off", "left", "right", "hazard"] | None,
        Meta(description="null: as they are", examples=["left"]),
    ] = None
