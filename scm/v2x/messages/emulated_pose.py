"""The true pose of an emulated car, for an emulated camera alone.

It is truth, as the world's snapshot is: never for agents, who have only what the Eye sees.
"""

from typing import ClassVar

from scm.v2x.message import Message


class EmulatedPose(Message, kw_only=True, frozen=True):
    """A car's true motion; pose of the rear axle's centre on the floor, map frame.

    Attributes:
        t_ns: When it was true, on the sender's clock.
        steering_rad: Mean road-wheel angle, + = left.
        car: Its car file's name.
        tag_id: Printed on its roof; None: the one that the city gave to the vehicle.
    """

    KEY: ClassVar[str] = "v/{vehicle}/emulated"
    RATE_HZ: ClassVar[float | None] = 50.0

    vehicle: str
    t_ns: int
    x_m: float
    y_m: float
    yaw_rad: float
    speed_mps: float
    lateral_speed_mps: float = 0.0
    yaw_rate_radps: float = 0.0
    steering_rad: float = 0.0
    car: str = "nigel"
    tag_id: int | None = None


MESSAGE = EmulatedPose
