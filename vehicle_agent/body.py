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
    """A command as it was sent to the actuators, and when, on this computer's clock [ns]."""

    t_ns: int
    throttle: float
    steering: float


class Body(Protocol):
    """A car as its agent drives it.

    Attributes:
        limits: What its driver must know of it.
        wants_eye: Whether it needs tracks from the overhead cameras.
    """

    limits: CarLimits
    wants_eye: bool

    def learn(self, city_map: CityMap, seed: int) -> None:
        """Receive the city's floor and wind; the same seed gives the same gusts everywhere."""
        ...

    def place(self, pose: Pose2, now_ns: int) -> None:
        """Stand with the rear axle at a pose; called at each joining."""
        ...

    def see(self, track: EyeTrack, now_ns: int) -> None:
        """Receive a track from the overhead cameras; only called if it `wants_eye`."""
        ...

    def was_lifted(self) -> bool:
        """Return, once, whether it was carried elsewhere, so that its route must be replanned."""
        ...

    def inhibit_reason(self, now_ns: int) -> str:
        """Return why it must not move now, in words; empty if it may."""
        ...

    def advance(self, now_ns: int) -> None:
        """Advance the motion to now."""
        ...

    def command(self, throttle: float, steering: float) -> None:
        """Apply a guarded command until the next one: -1 to 1, + = forward, + = left."""
        ...

    def obeyed(self) -> Sequence[Obeyed] | None:
        """Return, once, the commands sent to the actuators; None: each was sent when given."""
        ...

    def show(self, switches: Switches) -> None:
        """Switch its lamps, if it has any."""
        ...

    def push(self, contact: Contact) -> None:
        """Apply the motion that a contact caused, as the world reports it."""
        ...

    def motion(self) -> Motion:
        """Return how it moves now."""
        ...

    def sensors(
        self, vehicle: str, now_ns: int, *, wanted: bool = True
    ) -> Sequence[VehicleSensors | LidarScan]:
        """Return what its own sensors have read since the last call.

        Args:
            vehicle: Whose they are.
            now_ns: The present time [ns].
            wanted: Whether anybody subscribes to them; if not, simulated sensors need not run.
        """
        ...

    def close(self) -> None:
        """Come to rest and release everything it holds, however its agent ends."""
        ...


@dataclass(frozen=True, slots=True)
class Wiring:
    """How a real car is connected, and what it may do.

    Attributes:
        port: Path of its serial port.
        baud: Of this.
        calibration: Path of this individual car's file; empty: as its kind.
        lidar: Path of its scanner's serial port; empty: none.
        lidar_kind: A file of `vehicle_agent/lidars`.
        throttle: Maximum throttle in either direction, 0 to 1, beyond the dead-band.
        raw: Whether commands go to the wheels without the corrections of its file.
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
        kind: How it joins the city: `remote` or `real`.
        open: Makes one from the car file's name, a seed, and its wiring.
    """

    kind: str
    open: Callable[[str, int, Wiring], Body]
