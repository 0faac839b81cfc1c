"""All cars of one car file, advanced together: a struct of arrays, a row is a whole car.

Every array is a view of one block that the compiled kernel works on. Poses are of the rear axle's
centre on the ground; wheels stand front-left, front-right, rear-left, rear-right.
"""

import math
from enum import IntEnum

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.errors import RunError
from scm.geometry import Pose2
from scm.vehicles.body14 import GRAVITY, STATUS_DIVERGED, STATUS_OK
from scm.vehicles.car import Car
from scm.vehicles.kernel_file import compile_kernel
from scm.vehicles.layout import columns_of, find_column, slots_of
from scm.vehicles.signals import SIGNALS

SUBSTEP_S = 1e-3


class VehicleStatus(IntEnum):
    """What became of a car in the kernel."""

    OK = STATUS_OK
    DIVERGED = STATUS_DIVERGED

    @property
    def sentence(self) -> str:
        """Say it in words."""
        if self is VehicleStatus.OK:
            return "The car drives."
        return (
            "The car rolled over, its motion left every physical range, or a command was no number:"
            " it is frozen where it last made sense."
        )


class Fleet:
    """All cars of one car file.

    Attributes:
        throttle: Commands in [-1, 1], + forward, shape (capacity,); write here. Beyond counts as
            full, and a command that is no number freezes the car, marked DIVERGED.
        steering: Likewise, + left.
        battery: Battery voltage [V], shape (capacity,); write here.
        air_x, air_y: Wind velocity in the world [m/s], shape (capacity,); write here. 0 is still.
        floor_height, floor_slope_x, floor_slope_y: Floor under each wheel [m] and its rise along
            world x and y [1], shape (capacity, 4); write here. The kernel carries the height along
            the slope, so it stays that of the wheel's place until written anew.
        floor_grip, floor_rolling: Factor on tyre friction, and what the floor adds to the rolling
            coefficient [1], shape (capacity, 4); write here. Adding or placing a car makes its
            floor level and of grip 1, its air still.
        wheel_x, wheel_y: Contact points in the world, (capacity, 4) [m].
        time: Since the car was placed [s], shape (capacity,); may be written.
        impact_x, impact_y, impact_yaw: What contacts added to the acceleration over the last tick,
            level body frame [m/s^2, rad/s^2], shape (capacity,); written by who finds the contacts.
        alive: Rows in use, shape (capacity,).
        status: `VehicleStatus` of each row, shape (capacity,).
        x, y, z, roll, pitch, yaw: Rear-axle pose in the world [m, rad]; yaw in (-pi, pi]. The
            point is fixed to the leaning body at floor height: a stopped car that still rocks on
            its springs has stopped.
        speed, lateral_speed: Velocity of the rear axle along and across the body [m/s].
        roll_rate, pitch_rate, yaw_rate: [rad/s]; roll_accel, pitch_accel, yaw_accel: [rad/s^2].
        accel_x, accel_y, accel_z: Acceleration of the centre of gravity over the last substep, in
            the level body frame, without gravity [m/s^2].
        steer_angle: Mean road-wheel angle, + left [rad].
        wheel_speed, wheel_angle, wheel_steer: Of each wheel, (capacity, 4) [rad/s, rad, rad].
        wheel_load: Floor on tyre, (capacity, 4) [N].
    """

    def __init__(self, car: Car, capacity: int) -> None:
        self.car, self.capacity = car, capacity
        self._columns = columns_of(car.terms)
        self._slots = slots_of(car.terms)
        self._advance = compile_kernel(car.name, car.terms)
        width = sum(slot[1] for slot in self._slots.values())
        self._block: Floats = np.zeros((capacity, width))
        self._nominal: Floats = np.array([car.value(c.param.key) for c in self._columns])
        self.parameter_names = tuple(column.name for column in self._columns)
        self.parameters: Floats = np.tile(self._nominal, (capacity, 1))
        self.alive: Bools = np.zeros(capacity, dtype=np.bool_)
        self.status: Ints = np.zeros(capacity, dtype=np.int64)
        self.throttle, self.steering = (
            self._view("throttle_command"),
            self._view("steering_command"),
        )
        self.battery = self._view("battery")
        self.air_x, self.air_y = self._view("air_x"), self._view("air_y")
        self.floor_height = self._view("floor_height")
        self.floor_slope_x = self._view("floor_slope_x")
        self.floor_slope_y = self._view("floor_slope_y")
        self.floor_grip = self._view("floor_grip")
        self.floor_rolling = self._view("floor_rolling")
        self.time = self._view("time")
        self.impact_x, self.impact_y, self.impact_yaw = np.zeros((3, capacity))
        for name in (
            "x", "y", "z", "roll", "pitch", "yaw", "speed", "lateral_speed", "yaw_rate",
            "roll_rate", "pitch_rate", "accel_x", "accel_y", "accel_z", "roll_accel", "pitch_accel",
            "yaw_accel", "steer_angle", "wheel_speed", "wheel_angle", "wheel_steer", "wheel_load",
            "wheel_x", "wheel_y",
        ):  # fmt: skip
            view = self._view(name)
            view.flags.writeable = False
            setattr(self, name, view)
        self._run(0, capacity, 0, SUBSTEP_S)  # loads or compiles now, not at the first car

    x: Floats
    y: Floats
    z: Floats
    roll: Floats
    pitch: Floats
    yaw: Floats
    speed: Floats
    lateral_speed: Floats
    yaw_rate: Floats
    roll_rate: Floats
    pitch_rate: Floats
    accel_x: Floats
    accel_y: Floats
    accel_z: Floats
    roll_accel: Floats
    pitch_accel: Floats
    yaw_accel: Floats
    steer_angle: Floats
    wheel_speed: Floats
    wheel_angle: Floats
    wheel_steer: Floats
    wheel_load: Floats
    wheel_x: Floats
    wheel_y: Floats

    def add(self, pose: Pose2, speed: float = 0.0) -> int:
        """Put a car on the floor with its rear axle at `pose`, settled and rolling; return its row.

        Raises:
            RunError: when all rows are in use.
        """
        free = np.flatnonzero(~self.alive)
        if len(free) == 0:
            msg = f"fleet of {self.car.name}: all {self.capacity} rows are in use"
            raise RunError(msg)
        row = int(free[0])
        self.parameters[row] = self._nominal
        self.alive[row] = True
        self.place(row, pose, speed)
        return row

    def remove(self, row: int) -> None:
        """Take a car off the floor; its row is free again."""
        self.alive[row] = False
        self._block[row] = 0.0
        self.status[row] = VehicleStatus.OK

    def place(
        self,
        row: int,
        pose: Pose2,
        speed: float = 0.0,
        lateral_speed: float = 0.0,
        yaw_rate: float = 0.0,
        steer_angle: float | None = None,
        throttle: float = 0.0,
        *,
        keep_actuators: bool = False,
    ) -> None:
        """Restart a row from a measured state of its rear axle; no angle means wheels straight.

        Lags start settled at `steer_angle` [rad] and `throttle`; the commands themselves start at
        zero and the battery at its nominal voltage, so write commands after placing. With
        `keep_actuators` lags and servo stay as they are, whatever angle and throttle are given.
        """
        car, param = self._block[row], self._parameter
        lags = [term.target for term in self.car.terms if term.keeps is not None]
        kept = {name: self._view(name)[row].copy() for name in {*lags, "steer_angle"}}
        car[:] = 0.0
        cog, c, s = param(row, "cog_to_rear_axle"), math.cos(pose.yaw), math.sin(pose.yaw)
        across = lateral_speed + cog * yaw_rate
        self._set(row, "x_cog", pose.x + c * cog)
        self._set(row, "y_cog", pose.y + s * cog)
        self._set(row, "z_cog", param(row, "cog_height"))
        self._set(row, "yaw", pose.yaw)
        self._set(row, "vx_world", c * speed - s * across)
        self._set(row, "vy_world", s * speed + c * across)
        self._set(row, "yaw_rate", yaw_rate)
        self._set(row, "battery", self._nominal_battery(row))
        self._set(row, "floor_grip", 1.0)
        self.impact_x[row] = self.impact_y[row] = self.impact_yaw[row] = 0.0
        settled = {"steer": steer_angle, "throttle": throttle}
        for term in self.car.terms:
            if term.keeps is not None:
                start = settled.get(SIGNALS[term.target].settles)
                self._set(row, term.target, start or term.keeps)
        self._set(row, "steer_angle", steer_angle or 0.0)
        for name in kept if keep_actuators else ():
            self._set(row, name, kept[name])
        offset = self._slots["wheel_speed"][0]
        half = 0.5 * param(row, "track") * yaw_rate
        rolling = np.array([speed - half, speed + half, speed - half, speed + half])
        car[offset : offset + 4] = rolling / param(row, "wheel_radius")
        front = cog / param(row, "wheelbase")
        offset = self._slots["wheel_load"][0]
        weight = 0.5 * GRAVITY * (param(row, "mass") - 4.0 * param(row, "wheel_mass"))
        load = np.array([front, front, 1.0 - front, 1.0 - front]) * weight
        car[offset : offset + 4] = load + param(row, "wheel_mass") * GRAVITY
        self.status[row] = VehicleStatus.OK
        self._run(row, row + 1, 0, SUBSTEP_S)

    def settle(self, row: int) -> None:
        """Let a car that was just placed stand on the heights that `floor_height` has for it."""
        front_left, front_right, rear_left, rear_right = self.floor_height[row].tolist()
        rear, cog = 0.5 * (rear_left + rear_right), self._parameter(row, "cog_to_rear_axle")
        rise = (0.5 * (front_left + front_right) - rear) / self._parameter(row, "wheelbase")
        left_up = 0.5 * (front_left + rear_left - front_right - rear_right)
        roll, height = left_up / self._parameter(row, "track"), self._parameter(row, "cog_height")
        c, s = math.cos(float(self.yaw[row])), math.sin(float(self.yaw[row]))
        for name, change in (
            ("x_cog", height * (s * roll - c * rise)),
            ("y_cog", -height * (c * roll + s * rise)),
            ("z_cog", rear + cog * rise),
            ("roll", roll),
            ("pitch", -rise),
            ("hop", self.floor_height[row].copy()),
        ):
            self._set(row, name, self._view(name)[row] + change)
        self._run(row, row + 1, 0, SUBSTEP_S)

    def advance(self, duration: float, substep: float = SUBSTEP_S) -> None:
        """Advance all cars by whole substeps in one call, without the interpreter lock [s]."""
        self.advance_rows(0, self.capacity, duration, substep)

    def advance_rows(
        self, first: int, last: int, duration: float, substep: float = SUBSTEP_S
    ) -> None:
        """Advance the rows first..last-1 only: threads may share a fleet by rows."""
        self._run(first, last, round(duration / substep), substep)

    def pose(self, row: int) -> Pose2:
        """Return the rear axle's pose in the world."""
        return Pose2(float(self.x[row]), float(self.y[row]), float(self.yaw[row]))

    def planar_cog(self, row: int) -> tuple[float, float, float, float, float, float]:
        """Return (x, y, yaw, vx, vy, yaw_rate) of the centre of gravity in the world frame."""
        names = ("x_cog", "y_cog", "yaw", "vx_world", "vy_world", "yaw_rate")
        x, y, yaw, vx, vy, rate = (float(self._block[row, self._slots[n][0]]) for n in names)
        return x, y, yaw, vx, vy, rate

    def planar_cogs(self, rows: Ints) -> Floats:
        """Return `planar_cog` of many rows at once, shape (n, 6)."""
        names = ("x_cog", "y_cog", "yaw", "vx_world", "vy_world", "yaw_rate")
        columns = [self._slots[name][0] for name in names]
        return self._block[rows[:, None], columns]

    def push(
        self,
        row: int,
        dvx: float,
        dvy: float,
        dyaw_rate: float,
        dx: float = 0.0,
        dy: float = 0.0,
        dyaw: float = 0.0,
    ) -> None:
        """Apply a contact's result: change of velocity and pose of the COG, in the world frame.

        A change that is no number is not applied: it freezes the car, marked DIVERGED.
        """
        if self.status[row] != VehicleStatus.OK:
            return
        changes = (dvx, dvy, dyaw_rate, dx, dy, dyaw)
        if not all(map(math.isfinite, changes)):
            self.status[row] = VehicleStatus.DIVERGED
            return
        names = ("vx_world", "vy_world", "yaw_rate", "x_cog", "y_cog", "yaw")
        for name, change in zip(names, changes, strict=True):
            self._block[row, self._slots[name][0]] += change
        self._run(row, row + 1, 0, SUBSTEP_S)

    def set_parameter(self, row: int, name: str, value: float) -> None:
        """Give one car another number, by the parameter's name or its key in the car file.

        Raises:
            TermError: when the car has no such parameter.
        """
        self.parameters[row, find_column(self._columns, name)] = value

    def _parameter(self, row: int, name: str) -> float:
        return float(self.parameters[row, self.parameter_names.index(name)])

    def _nominal_battery(self, row: int) -> float:
        key = "drive.battery_nominal_v"
        known = "battery_nominal" in self.parameter_names
        if known:
            return self._parameter(row, "battery_nominal")
        return self.car.value(key) if self.car.has(key) else 0.0

    def _view(self, name: str) -> Floats:
        offset, width = self._slots[name]
        return self._block[:, offset] if width == 1 else self._block[:, offset : offset + width]

    def _set(self, row: int, name: str, value: float | Floats) -> None:
        offset, width = self._slots[name]
        self._block[row, offset : offset + width] = value

    def _run(self, first: int, last: int, steps: int, substep: float) -> None:
        self._advance(
            self._block, self.parameters, self.alive, self.status, first, last, steps, substep
        )
