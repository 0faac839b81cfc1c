"""A car of the independent reality, `tests/reality`, as the body of an agent in a city.

Another simulator moves it, by commands of 20 Hz that it holds. Its agent reports where it is, so
that the world can measure its ranges; encoders, gyro and steering angle are read from its motion.
Needs a clone of the repository as the working directory.
"""

import math

import numpy as np

from scm.clock import NS_PER_S
from scm.geometry import TAU, Pose2
from scm.records.city_map import CityMap
from scm.v2x.messages.contact import Contact
from scm.v2x.messages.eye_track import EyeTrack
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.vehicles.car import load_car
from scm.vehicles.drivers.limits import limits_of
from scm.vehicles.lights import Switches
from tests.reality.engine import find_engine
from tests.reality.motion import COMMAND_S, ROW_S
from tests.reality.numbers import nominal, scattered
from vehicle_agent.body import Motion

COMMAND_NS, ROW_NS = round(COMMAND_S * NS_PER_S), round(ROW_S * NS_PER_S)
STEERING_STD_RAD = 0.002  # of the potentiometer
GRAVITY = 9.80665
CONCEALED = {
    "nothing": {},
    "drive_delay": {"drive_delay": 0.25},
    "drive_deadband": {"drive_deadband": 0.15},
    "drive_gain": {"drive_gain": 0.7},
    "steer_trim": {"trim": 0.05},
    "steer_gain": {"steer_gain": 0.8},
    "servo_rate": {"rate": 0.21},
}
CONCEALED["all"] = {name: value for one in CONCEALED.values() for name, value in one.items()}
CONCEALED |= {
    "late_throttle_weak_steering": {"drive_delay": 0.2, "steer_gain": 0.85},
    "late_weak_steering": {"steer_delay": 0.2, "steer_gain": 0.85},
}
"""Effects by the names of `parking.py`, and what `cloning.py` tries, as that reality's numbers."""


class RealityBody:
    """One car.

    Args:
        engine: That moves it, a key of `tests.reality.engine.ENGINES`.
        concealed: A key of `CONCEALED`.
        lasts_s: For so long it can drive.
        rng: How it differs from its kind, and its sensors' noise.
    """

    wants_eye = False

    def __init__(
        self, engine: str, concealed: str, lasts_s: float, rng: np.random.Generator
    ) -> None:
        self.limits = limits_of(load_car("nigel"))
        self._moving, self._rng = find_engine(engine), rng
        self._numbers = scattered(nominal("nigel"), rng) | CONCEALED[concealed]
        self._commands = math.ceil(lasts_s / COMMAND_S) + 1
        self._command, self._count = (0.0, 0.0), 0
        self.pose = Pose2(0.0, 0.0, 0.0)

    def learn(self, city_map: CityMap, seed: int) -> None:
        """Do nothing: its floor is level and even."""

    def place(self, pose: Pose2, now_ns: int) -> None:
        """Stand at a pose."""
        self.pose, self._begin_ns, self._count = pose, now_ns, 0
        self._car = self._moving(self._numbers, tuple(pose), self._commands)
        self._rows = np.array([[0.0, *pose, *np.zeros(7)]])
        self._row = self._rows[0]

    def see(self, track: EyeTrack, now_ns: int) -> None:
        """Do nothing: it needs no Eye."""

    def was_lifted(self) -> bool:
        """Return False: nobody lifts it."""
        return False

    def inhibit_reason(self, now_ns: int) -> str:
        """Return an empty reason: it may always move."""
        del now_ns
        return ""

    def advance(self, now_ns: int) -> None:
        """Advance to now; the command of a 20 Hz cycle's beginning acts to its end."""
        while self._begin_ns + self._count * COMMAND_NS < now_ns:
            if self._count < self._commands:
                self._rows = self._car.command(self._count, *self._command)
            self._count += 1
        left = max(0, (self._begin_ns + self._count * COMMAND_NS - now_ns) // ROW_NS)
        self._row = self._rows[max(len(self._rows) - 1 - left, 0)]
        self.pose = Pose2(*map(float, self._row[1:4]))

    def command(self, throttle: float, steering: float) -> None:
        """Apply a command from the next cycle on."""
        self._command = throttle, steering

    def obeyed(self) -> None:
        """Return None: each command is sent when it is given."""

    def show(self, switches: Switches) -> None:
        """Do nothing: it has no lamps."""

    def push(self, contact: Contact) -> None:
        """Do nothing: a case ends at the first contact."""

    def motion(self) -> Motion:
        """Return how it moves."""
        speed, across, rate, accel = map(float, self._row[4:8])
        return Motion(self.pose, speed, across, rate, accel, self._angle(), "simulated")

    def sensors(self, vehicle: str, now_ns: int, *, wanted: bool = True) -> list[VehicleSensors]:
        """Return what its sensors measure."""
        if not wanted:
            return []
        left, right = (math.floor(turned / TAU * self._numbers["counts"])
                       for turned in self._row[9:11])  # fmt: skip
        gyro = self._row[6] + self._numbers["gyro_noise"] * self._rng.standard_normal()
        along, across = self._row[7:9] + self._numbers["accel_noise"] * self._rng.standard_normal(2)
        return [
            VehicleSensors(
                vehicle=vehicle, t_ns=now_ns, encoder_left=left, encoder_right=right,
                accel_mps2=(float(along), float(across), GRAVITY),
                gyro_radps=(0.0, 0.0, float(gyro)),
                steering_rad=self._angle() + STEERING_STD_RAD * self._rng.standard_normal(),
            )
        ]  # fmt: skip

    def close(self) -> None:
        """Do nothing: it holds no resources."""

    def _angle(self) -> float:
        return float(self._car.state["angle"][0])
