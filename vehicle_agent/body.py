"""The contract of a body: what an agent drives. To add one, copy `bodies/simulated.py`."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from scm.geometry import Pose2
from scm.maps.model import CityMap
from scm.v2x.messages.contact import Contact
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.vehicles.driver import CarLimits


@dataclass(frozen=True, slots=True)
class Motion:
    """How a body moves, by its own estimate.

    Attributes:
        pose: Of the rear axle, map frame.
        speed: Of the rear axle along the body [m/s]; `lateral_speed` across it, + = left.
        accel: Along the body [m/s^2].
        steering: Mean road-wheel angle [rad], + = left.
        source: Where the pose comes from: `simulated`, `eye`, `odometry`.
    """

    pose: Pose2
    speed: float
    lateral_speed: float
    yaw_rate: float
    accel: float
    steering: float
    source: str


class Body(Protocol):
    """A car under the hands of its agent.

    Attributes:
        limits: What its driver must know of it.
    """

    limits: CarLimits

    def learn(self, city_map: CityMap, seed: int) -> None:
        """Know the city's floor and air; everybody with the same seed feels the same gusts."""
        ...

    def place(self, pose: Pose2, now_ns: int) -> None:
        """Be at rest with the rear axle at a pose: called at each joining."""
        ...

    def advance(self, now_ns: int) -> None:
        """Bring the motion up to now."""
        ...

    def command(self, throttle: float, steering: float) -> None:
        """Obey until the next command: -1 to 1, + = forward, + = left; guarded already."""
        ...

    def push(self, contact: Contact) -> None:
        """Feel what the world says that a contact did."""
        ...

    def motion(self) -> Motion:
        """Return how it moves now."""
        ...

    def sensors(self, vehicle: str, now_ns: int) -> list[VehicleSensors]:
        """Return what its own sensors have read since the last time."""
        ...


@dataclass(frozen=True, slots=True)
class BodyKind:
    """One kind of body.

    Attributes:
        kind: What the city calls it when it joins: `remote` or `real`.
        open: Makes one from the car file's name and a seed.
    """

    kind: str
    open: Callable[[str, int], Body]
