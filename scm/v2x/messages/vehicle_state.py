"""What a car knows of itself: the native state report of every vehicle."""

from typing import ClassVar

from scm.v2x.message import Message


class VehicleState(Message, kw_only=True, frozen=True):
    """A car's own estimate of its motion; pose of the rear axle's centre on the floor, map frame.

    Attributes:
        t_ns: When it was true, on the sender's clock.
        source: Where the pose comes from: `simulated`, `eye`, `odometry`.
        steering_rad: Mean road-wheel angle, + = left.
        throttle, steering: The commands after the guard that led here, -1 to 1, + = forward and
            left: in force until `t_ns`, since the sender's step before. Steering None: not
                reported.
        epoch: Of the lease the car obeys now.
        mode: `drive`, `hold` (commands late), `stop` (commands lost or city stopped), `idle`.
        lights: Names of those that are on: `head_low head_high left right tail brake reverse`.
        car: Its car file's name.
        battery_v: Of the drive battery, under load as it is. None: not measured.
        battery_charge: What is left in it, 0 to 1: a simulated car counts what it draws, a real one
            estimates it from the voltage. None: not known.
        command_age_ms: How old the newest command of its leaseholder is, since it arrived here;
            None: it is not leased, or none came yet.
        contacts: Number of the newest `Contact` that this motion includes; 0: not reported.
    """

    KEY: ClassVar[str] = "v/{vehicle}/state"
    RATE_HZ: ClassVar[float | None] = 50.0

    vehicle: str
    t_ns: int
    seq: int
    x_m: float
    y_m: float
    yaw_rad: float
    speed_mps: float
    lateral_speed_mps: float = 0.0
    yaw_rate_radps: float
    accel_mps2: float = 0.0
    steering_rad: float
    throttle: float
    steering: float | None = None
    source: str
    epoch: int = 0
    mode: str = "drive"
    lights: tuple[str, ...] = ()
    car: str = "nigel"
    battery_v: float | None = None
    battery_charge: float | None = None
    command_age_ms: float | None = None
    contacts: int = 0


MESSAGE = VehicleState
