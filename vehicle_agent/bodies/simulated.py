"""A simulated body: a fleet of one, moved by the same kernel as the world's cars.

Every `GROUND_STEP_NS` it senses floor and wind of the city, as the world's cars do. The body's
time never jumps: after a stall of the process it moves by at most 0.1 s.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats
from scm.clock import NS_PER_MS, nanoseconds, seconds
from scm.geometry import Pose2
from scm.records.city_map import CityMap
from scm.v2x.messages.contact import Contact
from scm.v2x.messages.eye_track import EyeTrack
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.vehicles.bank import Bank
from scm.vehicles.battery_pack import Packs
from scm.vehicles.car import Car, load_car
from scm.vehicles.describe_effects import neutral_of, params_of
from scm.vehicles.drivers.limits import limits_of
from scm.vehicles.fleet import Fleet
from scm.vehicles.ground import Ground
from scm.vehicles.lights import Switches
from scm.vehicles.sensor import ENCODERS, all_sensors, sensor_messages
from vehicle_agent.body import Body, BodyKind, Motion, Wiring

MAX_ADVANCE_NS = 100 * NS_PER_MS  # after a stall of the process
GROUND_STEP_NS = 5 * NS_PER_MS
TICK_S = 0.02  # of the agent, in which a contact is measured
SENSORS = "scm.vehicles.sensors"


@dataclass(frozen=True, slots=True)
class Change:
    """A change of a car that it does not report, to try `scm twin` with.

    Attributes:
        car_file: Of the car as it is afterwards, by name or path.
        after_s: Of the body's time.
    """

    car_file: str
    after_s: float


class SimulatedBody:
    """One car in a kernel of its own.

    Args:
        car: Its file, by name or path.
        seed: Of the sensors' noise.
        change: After which it is another car; None: it stays as its file says.

    Raises:
        CarError: when a file is wrong.
    """

    wants_eye = False

    def __init__(self, car: str, seed: int, change: Change | None = None) -> None:
        self._car, self._left_ns = load_car(car), 0
        self._then: Mapping[str, float] = {}
        if change is not None:
            then = load_car(change.car_file)
            self._car, self._then = both(self._car, then)
            self._left_ns = nanoseconds(change.after_s)
        self._build(self._car, Pose2(0.0, 0.0, 0.0))
        self._now_ns: int | None = None
        self.limits = limits_of(self._fleet.car)
        self._ground: Ground | None = None
        self._seed = seed
        self._banks: list[Bank] = []
        self._newest: dict[str, Floats] = {}

    def learn(self, city_map: CityMap, seed: int) -> None:
        """Receive the city's floor and wind."""
        self._ground = Ground(city_map, seed)
        car = self._ground.fit(self._car)
        if car.terms != self._fleet.car.terms:
            self._build(car, self._fleet.pose(self._row))
            self._banks = []
        self._ground.warm(self._fleet)

    def _build(self, car: Car, pose: Pose2) -> None:
        self._fleet = Fleet(car, 1)
        self._row = self._fleet.add(pose)
        self._packs, self._rows = Packs(self._fleet), np.array([self._row])
        self._packs.renew(self._row)

    def place(self, pose: Pose2, now_ns: int) -> None:
        """Stand at a pose."""
        self._fleet.place(self._row, pose)
        if self._ground is not None:
            self._ground.place_at_rest(self._fleet, self._row)
        self._now_ns = now_ns

    def see(self, track: EyeTrack, now_ns: int) -> None:
        """Do nothing: it knows its own pose."""

    def was_lifted(self) -> bool:
        """Return False: nobody can lift it."""
        return False

    def inhibit_reason(self, now_ns: int) -> str:
        """Return an empty reason: it may always move."""
        del now_ns
        return ""

    def advance(self, now_ns: int) -> None:
        """Advance by whole milliseconds to now; the remainder waits for the next call."""
        if self._now_ns is None or now_ns - self._now_ns > MAX_ADVANCE_NS:
            self._now_ns = now_ns - (0 if self._now_ns is None else MAX_ADVANCE_NS)
        while now_ns - self._now_ns >= NS_PER_MS:
            whole_ns = (now_ns - self._now_ns) // NS_PER_MS * NS_PER_MS
            step_ns = min(whole_ns, GROUND_STEP_NS)
            if self._ground is not None:
                self._ground.feel(self._fleet, self._now_ns)
            self._fleet.advance(seconds(step_ns))
            self._packs.drain(self._rows, seconds(step_ns))
            self._now_ns += step_ns
            self._left_ns -= step_ns
        if self._then and self._left_ns <= 0:
            for key, value in self._then.items():
                self._fleet.set_parameter(self._row, key, value)
            self._then = {}

    def command(self, throttle: float, steering: float) -> None:
        """Set the kernel's commands."""
        self._fleet.throttle[self._row] = throttle
        self._fleet.steering[self._row] = steering

    def obeyed(self) -> None:
        """Return None: each command is applied when it is given."""

    def show(self, switches: Switches) -> None:
        """Do nothing: its lamps are those of its reports."""

    def push(self, contact: Contact) -> None:
        """Apply the velocity and position changes of a contact; the next readings include them."""
        fleet, row, yaw = self._fleet, self._row, float(self._fleet.yaw[self._row])
        c, s = math.cos(yaw), math.sin(yaw)
        fleet.contact_accel_x[row] += (c * contact.dvx_mps + s * contact.dvy_mps) / TICK_S
        fleet.contact_accel_y[row] += (c * contact.dvy_mps - s * contact.dvx_mps) / TICK_S
        fleet.contact_yaw_accel[row] += contact.dyaw_rate_radps / TICK_S
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
        volts, charge = (float(reading[row]) for reading in (self._packs.volts, self._packs.charge))
        return Motion(
            pose=fleet.pose(row),
            speed=float(fleet.speed[row]),
            lateral_speed=float(fleet.lateral_speed[row]),
            yaw_rate=float(fleet.yaw_rate[row]),
            accel=float(fleet.accel_x[row] + fleet.contact_accel_x[row]),
            steering=float(fleet.steer_angle[row]),
            source="simulated",
            battery_v=None if math.isnan(volts) else volts,
            battery_charge=None if math.isnan(charge) else charge,
        )

    def sensors(self, vehicle: str, now_ns: int, *, wanted: bool = True) -> list[VehicleSensors]:
        """Return a message for each new reading of the encoders, with the newest of the others."""
        if not self._banks:
            kinds = (sensor for sensor in all_sensors().values() if sensor.fields is not None)
            self._banks = [Bank(sensor, self._seed, 1) for sensor in kinds]
            for bank in self._banks:
                bank.fit(0, vehicle, self._fleet.car, self._fleet, self._row, now_ns)
        counted: list[int] = []
        for bank in self._banks:
            bank.wanted[0] = wanted
            for readings in bank.step(now_ns):
                self._newest[bank.sensor.name] = readings.values[:1]
                if bank.sensor.name == ENCODERS:
                    counted.append(readings.t_ns)
        if not wanted:
            self._newest.clear()
        fleet, row = self._fleet, self._row
        fleet.contact_accel_x[row] = fleet.contact_accel_y[row] = fleet.contact_yaw_accel[row] = 0.0
        return [
            message
            for t_ns in counted[-1:]
            for message in sensor_messages([vehicle], t_ns, self._newest)
        ]

    def close(self) -> None:
        """Do nothing: it holds no resources."""


def both(car: Car, then: Car) -> tuple[Car, dict[str, float]]:
    """Return a car that can become another: with its effects too, at rest, and its numbers."""
    have = {term.name for term in car.terms}
    new = [term for term in then.terms if term.name not in have]
    rest = {
        param.key: neutral_of(term)[param.name]
        for term in new
        for param in params_of(term)
        if param.name in neutral_of(term)
    }
    able = car.with_terms(new, rest)
    numbers = {
        param.key: then.value(param.key)
        for term in then.terms
        for param in params_of(term)
        if then.value(param.key) != able.value(param.key)
    }
    return able, numbers


def _open(car: str, seed: int, wiring: Wiring) -> Body:
    del wiring
    return SimulatedBody(car, seed)


BODY = BodyKind(kind="remote", open=_open)
