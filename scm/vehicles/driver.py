"""The contract of a driver: its view, its car's limits, and its commands.

Drivers are pure: no bus, no clock, no physics. Simulated and real cars, hosted by the world or
driven by an agent, use the same compiled controller: `drivers/controller.py`.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from scm.geometry import Pose2

if TYPE_CHECKING:  # the signal table needs the compiler; describing a car does not
    from scm.vehicles.drivers.signal_table import SignalTable


@dataclass(frozen=True, slots=True)
class Other:
    """Another car at its estimated place now, map frame.

    Attributes:
        x: Centre of its outline [m]; likewise `y`.
        speed: Along its own heading [m/s].
    """

    x: float
    y: float
    yaw: float
    speed: float
    length: float
    width: float


@dataclass(frozen=True, slots=True)
class RouteView:
    """What a driver sees at one instant.

    Attributes:
        pose: Of its own rear axle, map frame.
        speed: Its own, along the body's x [m/s].
        others: Every other car that it knows of.
        stop: Whether it must come to rest in its lane.
        reception_is_good: Whether it can assume that it receives all cars around.
    """

    now_ns: int
    pose: Pose2
    speed: float
    signals: "SignalTable"
    others: tuple[Other, ...] = ()
    stop: bool = False
    reception_is_good: bool = True


@dataclass(frozen=True, slots=True)
class CarLimits:
    """The limits of a car that its driver needs.

    Attributes:
        steer_limit: Road-wheel angle at full command [rad].
        steer_rate: Of the road wheels [rad/s].
        front: From the rear axle to the front bumper [m].
        rear: From the rear axle to the rear bumper [m], positive.
        speeds: Steady speed on the level at throttles 1/n, 2/n ... 1 [m/s], strictly increasing;
            empty: unknown, the driver finds the throttle by feedback.
        accel: Comfortable acceleration [m/s^2]; likewise `decel`, positive.
        lateral_accel: Comfortable limit in curves [m/s^2].
        brake_throttle: Lowest throttle for slowing down; 0 if zero throttle brakes.
    """

    wheelbase: float
    steer_limit: float
    steer_rate: float
    front: float
    rear: float
    width: float
    speeds: tuple[float, ...] = ()
    accel: float = 0.5
    decel: float = 0.5
    lateral_accel: float = 1.0
    brake_throttle: float = 0.0

    @property
    def length(self) -> float:
        """Bumper to bumper [m]."""
        return self.front + self.rear


class Driver(Protocol):
    """Decides throttle and steering, both -1 to 1, from its view."""

    def decide(self, view: RouteView) -> tuple[float, float]:
        """Return (throttle, steering): + forward, + left."""
        ...
