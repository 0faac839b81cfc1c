"""The contract of a body: what an agent drives. To add one, copy `bodies/simulated.py`."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from scm.geometry import Pose2
from scm.records.city_map import CityMap
from scm.v2x.messages.contact import Contact
from scm.v2x.messages.eye_track import EyeTrack
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.vehicles.driver import CarLimits
from scm.vehicles.lights import Switches


@dataclass(frozen=True, slots=True)
class Motion:
    """How a body moves, by its own estimate.

    Attributes:
        pose: Of the rear axle, map frame.
        speed: Of the rear axle along the body [m/s]; `lateral_speed` across it, + = left.
        accel: Along the body [m/s^2].
        steering: Mean road-wheel angle [rad], + = left.
        source: Where the pose comes from: `simulated`, `eye`, `odometry`.
        battery_v: Of the drive battery, under load as it is. None: not measured.
        battery_charge: What is left in it, 0 to 1, counted or estimated. None: not known.
    """

    pose: Pose2
    speed: float
    lateral_speed: float
    yaw_rate: float
    accel: float
    steering: float
    source: str
    battery_v: float | None = None
    battery_charge: float | None = None


@dataclass(frozen=True, slots=True)
class Obeyed:
    """A command as it left for the actuators, and when, on this computer's clock [ns]."""

    t_ns: int
    throttle: float
    steering: float


class Body(Protocol):
    """A car under the hands of its agent.

    Attributes:
        limits: What its driver must know of it.
        wants_eye: Whether it must be told where the overhead cameras see it.
    """

    limits: CarLimits
    wants_eye: bool

    def learn(self, city_map: CityMap, seed: int) -> None:
        """Know the city's floor and air; everybody with the same seed feels the same gusts."""
        ...

    def place(self, pose: Pose2, now_ns: int) -> None:
        """Be at rest with the rear axle at a pose: called at each joining."""
        ...

    def see(self, track: EyeTrack, now_ns: int) -> None:
        """Learn where the overhead cameras see it: only where it `wants_eye`."""
        ...

    def was_lifted(self) -> bool:
        """Return, once, whether it is somewhere that it did not drive to: its way begins anew."""
        ...

    def unfit(self, now_ns: int) -> str:
        """Return why it must not move now, in words; empty: it may."""
        ...

    def advance(self, now_ns: int) -> None:
        """Bring the motion up to now."""
        ...

    def command(self, throttle: float, steering: float) -> None:
        """Obey until the next command: -1 to 1, + = forward, + = left; guarded already."""
        ...

    def obeyed(self) -> Sequence[Obeyed] | None:
        """Return, once, what has left for the actuators; None: each command did when given."""
        ...

    def show(self, switches: Switches) -> None:
        """Switch its lamps, where it has some of its own."""
        ...

    def push(self, contact: Contact) -> None:
        """Feel what the world says that a contact did."""
        ...

    def motion(self) -> Motion:
        """Return how it moves now."""
        ...

    def sensors(
        self, vehicle: str, now_ns: int, *, wanted: bool = True
    ) -> Sequence[VehicleSensors | LidarScan]:
        """Return what its own sensors have read since the last time.

        Args:
            vehicle: Whose they are.
            now_ns: The present time [ns].
            wanted: Whether anybody subscribes to them: simulated ones need not read for nobody.
        """
        ...

    def close(self) -> None:
        """Come to rest and let go of whatever it holds, however its agent ends."""
        ...


@dataclass(frozen=True, slots=True)
class Wiring:
    """How a real car is connected, and what it may do.

    Attributes:
        port: Path of its serial port.
        baud: Of this.
        calibration: Path of this very car's file; empty: it is as its kind.
        lidar: Path of its scanner's serial port; empty: it has none.
        lidar_kind: A file of `vehicle_agent/lidars`.
        throttle: Most throttle either way, 0 to 1, beyond the dead-band.
        raw: Whether commands go to the wheels as they are, nothing of its file undone.
        fence: Corners it stays within, counter-clockwise, map frame [m]; empty: the whole floor.
    """

    port: str = ""
    baud: int = 57600
    calibration: str = ""
    lidar: str = ""
    lidar_kind: str = "rplidar_a1"
    throttle: float = 1.0
    raw: bool = False
    fence: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True, slots=True)
class BodyKind:
    """One kind of body.

    Attributes:
        kind: What the city calls it when it joins: `remote` or `real`.
        open: Makes one from the car file's name, a seed, and how it is connected.
    """

    kind: str
    open: Callable[[str, int, Wiring], Body]
