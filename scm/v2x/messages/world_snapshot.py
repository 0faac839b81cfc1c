"""All cars of the city at one instant: for judging, drawing and the emulated overhead camera.

This is the truth of the simulation. It is never sent to agents.
"""

from typing import ClassVar

import msgspec

from scm.records.boxes import SnapshotBox
from scm.v2x.message import Message


class SnapshotVehicle(msgspec.Struct, kw_only=True, frozen=True, gc=False):
    """One car; pose of the rear axle's centre, map frame.

    Attributes:
        kind: `hosted`, `remote` or `real`.
        throttle: As commanded, or as its agent reports it; None: it has not reported yet.
        owner: Who holds its lease.
        lease_left_ms: Until that ends if it is not renewed; None: it is owned by the world.
        battery_v: Of its drive battery, under load as it is. None: not measured.
        battery_charge: What is left in it, 0 to 1; of a real car estimated. None: not known.
        command_age_ms: How old the newest command of its leaseholder is, since it reached the car;
            None: it is not leased, or none came yet.
        age_ms: How old its newest state is: 0 for hosted cars.
        alive: False from the moment its agent is known to be gone until it is taken off the map.
        stuck: It was commanded to drive for seconds and stays: what it most likely pushes against,
            names of cars, `wall`, boxes; empty: nothing that is known. None: it is not stuck.
    """

    vehicle: str
    kind: str
    car: str
    tag_id: int
    x_m: float
    y_m: float
    yaw_rad: float
    speed_mps: float
    steering_rad: float
    throttle: float | None = None
    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    owner: str = "world"
    epoch: int = 0
    lease_left_ms: float | None = None
    battery_v: float | None = None
    battery_charge: float | None = None
    command_age_ms: float | None = None
    mode: str = "drive"
    age_ms: float = 0.0
    alive: bool = True
    lights: tuple[str, ...] = ()
    stuck: tuple[str, ...] | None = None


class WorldSnapshot(Message, kw_only=True, frozen=True):
    """The city at `t_ns`.

    Attributes:
        boxes: Those that can be moved, in the map's order.
        real_time_factor: Simulated over elapsed time, over the last second.
        late_ticks: Ticks that ended after the next was due, since the start.
    """

    KEY: ClassVar[str] = "world/snapshot"
    RATE_HZ: ClassVar[float | None] = 20.0

    t_ns: int
    tick: int
    vehicles: tuple[SnapshotVehicle, ...]
    boxes: tuple[SnapshotBox, ...] = ()
    real_time_factor: float = 1.0
    late_ticks: int = 0


MESSAGE = WorldSnapshot
