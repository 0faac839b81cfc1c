"""A body of one's own dynamics: a fleet of one, moved by the same kernel as the world's cars.

The body's time never jumps: after a stall of the process it has moved by at most 0.1 s.
"""

import numpy as np

from scm import registry
from scm.clock import NS_PER_MS, seconds
from scm.geometry import Pose2
from scm.v2x.messages.contact import Contact
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.vehicles.car import load_car
from scm.vehicles.drivers.limits import limits_of
from scm.vehicles.fleet import Fleet
from scm.vehicles.sensor import Sampler, Sensor
from vehicle_agent.body import Body, BodyKind, Motion

LONGEST_NS = 100 * NS_PER_MS
SENSORS = "scm.vehicles.sensors"


class SimulatedBody:
    """One car in a kernel of its own."""

    def __init__(self, car: str, seed: int) -> None:
        self._fleet = Fleet(load_car(car), 1)
        self._row = self._fleet.add(Pose2(0.0, 0.0, 0.0))
        self._rows = np.array([self._row])
        self._now_ns: int | None = None
        self.limits = limits_of(self._fleet.car)
        generators = np.random.default_rng(seed).spawn(2)
        self._encoders, self._imu = (
            _Device(name, self._fleet, generator)
            for name, generator in zip(("encoders", "imu"), generators, strict=True)
        )

    def place(self, pose: Pose2, now_ns: int) -> None:
        """Stand at a pose."""
        self._fleet.place(self._row, pose)
        self._now_ns = now_ns

    def advance(self, now_ns: int) -> None:
        """Move by whole milliseconds up to now; what is left over is for the next time."""
        if self._now_ns is None or now_ns - self._now_ns > LONGEST_NS:
            self._now_ns = now_ns - (0 if self._now_ns is None else LONGEST_NS)
        steps = (now_ns - self._now_ns) // NS_PER_MS
        if steps > 0:
            self._fleet.advance(seconds(steps * NS_PER_MS))
            self._now_ns += steps * NS_PER_MS

    def command(self, throttle: float, steering: float) -> None:
        """Set the kernel's commands."""
        self._fleet.throttle[self._row] = throttle
        self._fleet.steering[self._row] = steering

    def push(self, contact: Contact) -> None:
        """Change velocity and place as the contact did."""
        self._fleet.push(
            self._row,
            contact.dvx_mps,
            contact.dvy_mps,
            contact.dyaw_rate_radps,
            contact.dx_m,
            contact.dy_m,
            contact.dyaw_rad,
        )

    def motion(self) -> Motion:
        """Return the kernel's state."""
        fleet, row = self._fleet, self._row
        return Motion(
            pose=fleet.pose(row),
            speed=float(fleet.speed[row]),
            lateral_speed=float(fleet.lateral_speed[row]),
            yaw_rate=float(fleet.yaw_rate[row]),
            accel=float(fleet.accel_x[row]),
            steering=float(fleet.steer_angle[row]),
            source="simulated",
        )

    def sensors(self, vehicle: str, now_ns: int) -> list[VehicleSensors]:
        """Return a message for each new reading of the encoders, with the newest of the IMU."""
        self._imu.read(now_ns)
        if not self._encoders.read(now_ns) or not self._imu.newest:
            return []
        left, right = self._encoders.newest
        ax, ay, az, roll_rate, pitch_rate, yaw_rate = self._imu.newest[:6]
        return [
            VehicleSensors(
                vehicle=vehicle,
                t_ns=now_ns,
                encoder_left=int(left),
                encoder_right=int(right),
                accel_mps2=(ax, ay, az),
                gyro_radps=(roll_rate, pitch_rate, yaw_rate),
            )
        ]


class _Device:
    """One sensor on the one car."""

    def __init__(self, name: str, fleet: Fleet, generator: np.random.Generator) -> None:
        self._sensor = registry.load(SENSORS, name, "SENSOR", Sensor)
        self._fleet = fleet
        fitted = self._sensor.is_fitted(fleet.car)
        self._sampler = Sampler(self._sensor.facts(fleet.car), generator) if fitted else None
        self.newest: tuple[float, ...] = ()

    def read(self, now_ns: int) -> bool:
        """Take a reading if one is due; return whether there is a new one."""
        if self._sampler is None:
            return False
        if self._sampler.is_due(now_ns):
            rows = np.flatnonzero(self._fleet.alive)
            exact = self._sensor.measure(self._fleet.car, self._fleet, rows, None)
            self._sampler.take(now_ns, exact[0])
        ready = self._sampler.ready(now_ns)
        if ready:
            self.newest = tuple(float(value) for value in ready[-1].values)
        return bool(ready)


def _open(car: str, seed: int) -> Body:
    return SimulatedBody(car, seed)


BODY = BodyKind(kind="remote", open=_open)
