"""A real Nigel: commanded over a serial cable, its motion measured by the overhead cameras.

The published firmware reports nothing about the car, so its motion comes from the Eye alone,
extrapolated to now along the arc of its speed and yaw rate. Dead-band, gains and trim of this one
car are parameters of its calibration and are corrected by `nigel/command_correction.py`.
"""

import logging
import math
from collections.abc import Sequence

from scm.clock import NS_PER_MS, seconds
from scm.errors import RunError
from scm.geometry import Pose2
from scm.log import event
from scm.records.city_map import CityMap
from scm.v2x.messages.contact import Contact
from scm.v2x.messages.eye_track import EyeTrack
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.vehicles.battery_pack import pack_of
from scm.vehicles.car import Car, load_car
from scm.vehicles.drivers.limits import limits_of
from scm.vehicles.lights import Switches
from vehicle_agent.body import Body, BodyKind, Motion, Obeyed, Wiring
from vehicle_agent.lidar_port import LidarPort, open_lidar
from vehicle_agent.nigel.command_correction import DEADBAND, CommandCorrection, correction_of
from vehicle_agent.nigel.host import NigelCommand
from vehicle_agent.nigel.watchdog_client import WatchdogClient

MAX_TRACK_AGE_NS = 250 * NS_PER_MS  # older than that, the car must not move
LIFTED_M = 0.25
"""At a larger distance from its expected pose the car was carried: the Eye is right within 3 cm."""
SMOOTH_S = 0.15
"""Averaging time of the Eye's speed differences: one alone is 5 mm/s uncertain."""
LEVEL_MPS2 = 9.80665
"""Upwards on a level floor: the firmware reports only accelerations in the plane."""

_log = logging.getLogger(__name__)


class NigelBody:
    """One car on a cable.

    Args:
        car: Its file, calibrated.
        watchdog: Sends commands to the serial watchdog.
        lidar: Its scanner; None if it has none.
        raw: Whether commands go to the wheels uncorrected.
    """

    def __init__(
        self,
        car: Car,
        watchdog: WatchdogClient,
        lidar: LidarPort | None = None,
        *,
        raw: bool = False,
    ) -> None:
        self.limits = limits_of(car)
        self.wants_eye = True
        self._correction = (
            CommandCorrection() if raw else correction_of(car, self.limits.steer_limit)
        )
        if not (raw or self._correction.deadband):
            event(_log, "no_deadband", level=logging.WARNING, car=car.name, key=DEADBAND)
        self._watchdog, self._lidar = watchdog, lidar
        self._pack, self._wheel_m = pack_of(car), car.value("wheel.radius_m")
        self._throttle = 0.0
        self._start = Pose2(0.0, 0.0, 0.0)
        self._track: EyeTrack | None = None
        self._track_ns = self._now_ns = 0
        self._was_lifted = False
        self._lamps = 0
        self._wheels = self._wanted = self._accel = 0.0
        self._readings = 0

    def learn(self, city_map: CityMap, seed: int) -> None:
        """Do nothing: the real floor needs no model."""

    def place(self, pose: Pose2, now_ns: int) -> None:
        """Assume a pose until the Eye reports one."""
        self._start, self._track, self._now_ns = pose, None, now_ns
        self.command(0.0, 0.0)

    def see(self, track: EyeTrack, now_ns: int) -> None:
        """Receive a track from the Eye; one with a number that is not finite is ignored."""
        numbers = (track.x_m, track.y_m, track.yaw_rad, track.speed_mps, track.lateral_speed_mps)
        if not all(map(math.isfinite, (*numbers, track.yaw_rate_radps, track.age_s))):
            return
        if self._track is not None and track.t_ns <= self._track.t_ns:
            return
        if not track.stale:
            old = self._pose(now_ns)
            away = math.hypot(track.x_m - old.x, track.y_m - old.y)
            self._was_lifted |= self._track is None or away > LIFTED_M
        self._accel = 0.0 if track.stale else self._acceleration(track)
        self._track, self._track_ns = track, now_ns

    def was_lifted(self) -> bool:
        """Return, once, whether it was seen somewhere that it did not drive to."""
        lifted, self._was_lifted = self._was_lifted, False
        return lifted

    def inhibit_reason(self, now_ns: int) -> str:
        """Return why it must not move, in words; empty if it may."""
        trouble = self._watchdog.trouble(now_ns)
        if trouble:
            return trouble
        if self._track is None:
            return "the Eye has not seen it yet"
        age_ns = now_ns - self._track_ns + round(1e9 * self._track.age_s)
        if self._track.stale or age_ns > MAX_TRACK_AGE_NS:
            return f"the Eye has not seen it for {seconds(age_ns):.1f} s"
        return ""

    def advance(self, now_ns: int) -> None:
        """Advance the estimated wheel angle to now."""
        most = self.limits.steer_rate * seconds(max(0, now_ns - self._now_ns))
        self._wheels += min(most, max(-most, self._wanted - self._wheels))
        self._now_ns = now_ns

    def command(self, throttle: float, steering: float) -> None:
        """Send a command on; zeros while the car must not move."""
        if self.inhibit_reason(self._now_ns):
            self._watchdog.command(NigelCommand(lamps=self._lamps), self._now_ns)
            self._wanted = self._throttle = 0.0
            return
        self._wanted, self._throttle = steering * self.limits.steer_limit, throttle
        corrected = NigelCommand(
            self._correction.throttle(throttle), self._correction.steering(steering), self._lamps
        )
        self._watchdog.command(corrected, self._now_ns)

    def obeyed(self) -> list[Obeyed]:
        """Return the commands that the watchdog wrote to the port, and when."""
        return [Obeyed(one.t_ns, one.throttle, one.steering) for one in self._watchdog.written()]

    def show(self, switches: Switches) -> None:
        """Switch the lamps; the firmware does the flashing."""
        beams = {"off": 0, "low": 1, "high": 3}[switches.headlights]
        sides = {"off": 0, "left": 4, "right": 8, "hazard": 12}[switches.indicators]
        self._lamps = beams | sides

    def push(self, contact: Contact) -> None:
        """Do nothing: a real car feels real contacts."""

    def motion(self) -> Motion:
        """Return the motion that the Eye measured, extrapolated to now."""
        track = self._track
        is_seen = track is not None and not track.stale
        speed = track.speed_mps if track is not None and is_seen else 0.0
        volts = None if self._watchdog.report is None else self._watchdog.report.battery_v
        return Motion(
            pose=self._pose(self._now_ns),
            speed=speed,
            lateral_speed=track.lateral_speed_mps if track is not None and is_seen else 0.0,
            yaw_rate=track.yaw_rate_radps if track is not None and is_seen else 0.0,
            accel=self._accel,
            steering=self._wheels,
            source="eye",
            battery_v=volts,
            battery_charge=None if volts is None else self._charge(volts, speed),
        )

    def sensors(
        self, vehicle: str, now_ns: int, *, wanted: bool = True
    ) -> Sequence[VehicleSensors | LidarScan]:
        """Return the scanner's turns, and the newest telemetry if the firmware has some."""
        scans = [] if self._lidar is None else self._lidar.step(vehicle, now_ns)
        return [*scans, *self._telemetry(vehicle, now_ns)]

    def close(self) -> None:
        """Command zeros and release the cables."""
        self._watchdog.close()
        if self._lidar is not None:
            self._lidar.close()

    def _telemetry(self, vehicle: str, now_ns: int) -> list[VehicleSensors]:
        report = self._watchdog.report
        if report is None or report.telemetry is None or report.readings == self._readings:
            return []
        self._readings = report.readings
        reading = report.telemetry
        if not reading.has_imu:
            return []
        return [
            VehicleSensors(
                vehicle=vehicle,
                t_ns=now_ns,
                encoder_left=reading.left,
                encoder_right=reading.right,
                accel_mps2=(*reading.accel_mps2, LEVEL_MPS2),
                gyro_radps=(0.0, 0.0, reading.gyro_radps),
            )
        ]

    def _charge(self, volts: float, speed: float) -> float | None:
        """Return the charge for a voltage, corrected for the present current; None: no pack."""
        if self._pack is None:
            return None
        return self._pack.charge_at(volts, self._throttle, speed / self._wheel_m)

    def _pose(self, now_ns: int) -> Pose2:
        """Return the last seen pose, extrapolated by at most `MAX_TRACK_AGE_NS`."""
        track = self._track
        if track is None:
            return self._start
        seen = Pose2(track.x_m, track.y_m, track.yaw_rad)
        if track.stale:
            return seen
        dt = seconds(min(max(0, now_ns - self._track_ns), MAX_TRACK_AGE_NS))
        half = 0.5 * track.yaw_rate_radps * dt
        c, s = math.cos(half) * dt, math.sin(half) * dt
        vx, vy = track.speed_mps, track.lateral_speed_mps
        return seen @ Pose2(c * vx - s * vy, s * vx + c * vy, 2.0 * half)

    def _acceleration(self, track: EyeTrack) -> float:
        """Return the smoothed acceleration from the speeds of the last tracks [m/s^2]."""
        if self._track is None or self._track.stale:
            return 0.0
        dt = seconds(track.t_ns - self._track.t_ns)
        slope = (track.speed_mps - self._track.speed_mps) / dt
        return self._accel + (slope - self._accel) * dt / (dt + SMOOTH_S)


def _open(car: str, seed: int, wiring: Wiring) -> Body:
    del seed
    if not wiring.port:
        msg = "body nigel: no serial port given; expected a path such as /dev/ttyUSB0"
        raise RunError(msg)
    lidar = open_lidar(wiring.lidar, wiring.lidar_kind) if wiring.lidar else None
    watchdog = WatchdogClient(wiring.port, wiring.baud)
    return NigelBody(load_car(wiring.calibration or car), watchdog, lidar, raw=wiring.raw)


BODY = BodyKind(kind="real", open=_open)
