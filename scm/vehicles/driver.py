"""The contract of a driver: what it is shown, what it knows of its car, what it answers.

Drivers are pure: no bus, no clock, no physics. A simulated and a real car, hosted by the world or
driven by an agent, one or ten thousand of them, follow the same compiled law: `drivers/law.py`.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from scm.geometry import Pose2

if TYPE_CHECKING:  # what reads signals is compiled; who only describes a car needs no compiler
    from scm.vehicles.signal_view import SignalView


@dataclass(frozen=True, slots=True)
class Other:
    """Another car as it is believed to be now, map frame.

    Attributes:
        x: Middle of its outline [m]; likewise `y`.
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
    """What a driver is shown at one instant.

    Attributes:
        pose: Of its own rear axle, map frame.
        speed: Its own, along the body's x [m/s].
        others: Every other car it knows of, itself left out.
        stop: Whether it must come to rest in its lane, wherever it is.
        hears_well: Whether it may take silence for absence where there are no lights.
    """

    now_ns: int
    pose: Pose2
    speed: float
    signals: "SignalView"
    others: tuple[Other, ...] = ()
    stop: bool = False
    hears_well: bool = True


@dataclass(frozen=True, slots=True)
class CarLimits:
    """What a driver must know of its car.

    Attributes:
        steer_limit: Road-wheel angle at full command [rad].
        steer_rate: How fast the road wheels turn [rad/s].
        front: From the rear axle to the front bumper [m].
        rear: From the rear axle to the rear bumper [m], positive.
        speeds: Steady speed on the level at throttles 1/n, 2/n ... 1 [m/s], strictly increasing;
            empty: not known, the driver finds the throttle by feedback.
        accel: Comfortable acceleration [m/s^2]; likewise `decel`, positive.
        lateral_accel: Comfortable limit in curves [m/s^2].
        brake_throttle: Lowest throttle to slow down with; 0 where zero throttle already brakes.
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
    """Decides throttle and steering, both -1 to 1, from what it is shown."""

    def decide(self, view: RouteView) -> tuple[float, float]:
        """Return (throttle, steering): + forward, + left."""
        ...
