"""All cars of one car file, advanced together: a struct of arrays with one row per car.

Every array is a view of one block that the compiled kernel works on. Poses are of the rear axle's
centre on the ground; wheel order is front-left, front-right, rear-left, rear-right.
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, cast

import numpy as np

from scm.arrays import AnyArray, Bools, Floats, Ints
from scm.errors import RunError, TermError, nearest
from scm.geometry import Pose2
from scm.vehicles.body14 import GRAVITY, sprung_part
from scm.vehicles.car import Car
from scm.vehicles.command_delay import history_of
from scm.vehicles.compiler.kernel_file import compile_kernel
from scm.vehicles.compiler.vector_code import LANES
from scm.vehicles.fleet_rows import (
    COG,
    COG_CHANGED,
    READ,
    VARIABLE_OF,
    WRITTEN,
    aligned,
    columns_of_command,
    offsets_of_variables,
    pool,
    steps_of,
    whole_steps,
)  # fmt: skip
from scm.vehicles.jit import plain
from scm.vehicles.layout import columns_of, find_column, rows_of
from scm.vehicles.physics_variables import VARIABLES
from scm.vehicles.placing import directions
from scm.vehicles.shape import Shape, shape_function
from scm.vehicles.vehicle_status import VehicleStatus

SUBSTEP_S = 1e-3

_TILES_A_THREAD = 8  # below, a second thread costs more than it does


class Fleet:
    """All cars of one car file.

    Attributes:
        throttle: Commands in [-1, 1], + forward, shape (capacity,); write here. Larger values are
            clipped; a NaN freezes the car, marked DIVERGED.
        steering: Likewise, + left.
        battery: Battery voltage [V], shape (capacity,); write here.
        air_x, air_y: Wind velocity in the world [m/s], shape (capacity,); write here.
        floor_height, floor_slope_x, floor_slope_y: Floor under each wheel [m] and its rise along
            world x and y [1], shape (capacity, 4); write here. The kernel extrapolates the height
            along the slope until it is written again.
        floor_grip, floor_rolling: Factor on tyre friction, and addition to the rolling coefficient
            [1], shape (capacity, 4); write here. Adding or placing a car resets its floor to level
            with grip 1, and its wind to 0.
        wheel_x, wheel_y: Contact points in the world, (capacity, 4) [m].
        time, wheel_angle: Since the car was placed, (capacity,) [s], and how far each wheel has
            turned since, (capacity, 4) [rad]; may be written.
        contact_accel_x, contact_accel_y, contact_yaw_accel: Acceleration by contacts over the last
            tick, level body frame [m/s^2, rad/s^2], shape (capacity,); written by the contact
            solver.
        columns: Meaning of each column of `parameters`.
        history: Past commands, if an effect answers late to them.
        threads: Number of threads of `advance` for large fleets; default 1.
        alive, status: Rows in use, and the `VehicleStatus` of each, shape (capacity,).
        x, y, z, roll, pitch, yaw: Rear-axle pose in the world [m, rad]; yaw in (-pi, pi]. The
            point is fixed to the rolling body at floor height, so a stopped car that still
            oscillates on its springs has zero speed.
        speed, lateral_speed: Velocity of the rear axle along and across the body [m/s].
        roll_rate, pitch_rate, yaw_rate: [rad/s]; roll_accel, pitch_accel, yaw_accel: [rad/s^2].
        accel_x, accel_y, accel_z: Acceleration of the centre of gravity over the last substep, in
            the level body frame, without gravity [m/s^2].
        steer_angle: Mean road-wheel angle, + left [rad].
        wheel_speed, wheel_steer: Of each wheel, (capacity, 4) [rad/s, rad].
        wheel_load: Floor on tyre, (capacity, 4) [N].
    """

    def __init__(self, car: Car, capacity: int) -> None:
        self.car, self.capacity = car, capacity
        self.threads = 1
        self.columns = columns_of(car.terms)
        self._places = {column.param.key: i for i, column in enumerate(self.columns)}
        self._shape_of = shape_function(car)
        self._states = {term.target: term.keeps for term in car.terms if term.keeps is not None}
        self._offsets = rows_of(car.terms)
        self._variable_offsets = offsets_of_variables(self._offsets)
        self._kernel = compile_kernel(car.terms)
        padded = -(-capacity // LANES) * LANES
        height = max(offset + width for offset, width in self._offsets.values())
        self._block: Floats = aligned((height, padded))
        self._nominal: Floats = np.array([car.value(c.param.key) for c in self.columns])
        self.parameter_names = tuple(column.name for column in self.columns)
        self._numbers: Floats = aligned((len(self.columns), padded))
        self._numbers[:] = self._nominal[:, None]
        self.parameters: Floats = self._numbers[:, :capacity].T
        self._alive: Bools = np.zeros(padded, dtype=np.bool_)
        self.alive: Bools = self._alive[:capacity]
        self._status: Ints = np.zeros(padded, dtype=np.int64)
        self.status: Ints = self._status[:capacity]
        self.history = history_of(car.terms, self._places, self._offsets, padded)
        self.contact_accel_x, self.contact_accel_y, self.contact_yaw_accel = np.zeros((3, capacity))
        for name, variable in WRITTEN.items():
            setattr(self, name, self._view(variable))
        for name in READ:
            view = self._view(VARIABLE_OF.get(name, name))
            view.flags.writeable = False
            setattr(self, name, view)

    throttle: Floats
    steering: Floats
    battery: Floats
    air_x: Floats
    air_y: Floats
    floor_height: Floats
    floor_slope_x: Floats
    floor_slope_y: Floats
    floor_grip: Floats
    floor_rolling: Floats
    time: Floats
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
        """Add a car with its rear axle at `pose`, in equilibrium and rolling; return its row.

        Raises:
            RunError: when all rows are in use.
        """
        row = self.claim_row()
        self.parameters[row] = self._nominal
        self.place(row, pose, speed)
        return row

    def claim_row(self) -> int:
        """Return a free row, for a car whose `memory` is to be written.

        Raises:
            RunError: when all rows are in use.
        """
        free = np.flatnonzero(~self.alive)
        if not len(free):
            raise RunError(f"fleet of {self.car.name}: all {self.capacity} rows are in use")
        self.alive[free[0]] = True
        return int(free[0])

    def memory(self, row: int) -> tuple[AnyArray, ...]:
        """Return views of all that is stored of a row: what is written there makes the same car."""
        struck = (self.contact_accel_x, self.contact_accel_y, self.contact_yaw_accel)
        own = tuple(values[row : row + 1] for values in (self._status, *struck))
        past = () if self.history is None else self.history.memory(row)
        return (self._block[:, row], self._numbers[:, row], *own, *past)

    def remove(self, row: int) -> None:
        """Remove a car; its row is free again.

        Raises:
            RunError: when there is no such row.
        """
        self._check(row)
        self.alive[row] = False
        self._block[:, row] = 0.0
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
        """Restart a row from a measured state of its rear axle; by default with straight wheels.

        Lags and servo start in steady state at `steer_angle` [rad] and `throttle`; a trim adds its
        angle to the servo's. Commands start at zero and the battery at its nominal voltage, so
        write commands after placing. With `keep_actuators` lags keep their state, and so does the
        servo where no `steer_angle` is given; `throttle` is ignored.

        Raises:
            RunError: when there is no such row.
        """
        self._check(row)
        car = self._block[:, row]
        actuators = {name: self._view(name)[row].copy() for name in {*self._states, "steer_angle"}}
        car[:] = 0.0
        shape = self.shape(row)
        cog, c, s = shape.cog_to_rear_axle, math.cos(pose.yaw), math.sin(pose.yaw)
        across = lateral_speed + cog * yaw_rate
        self._set(row, "x_cog", pose.x + c * cog)
        self._set(row, "y_cog", pose.y + s * cog)
        self._set(row, "z_cog", shape.cog_height)
        self._set(row, "yaw", pose.yaw)
        self._set(row, "vx_world", c * speed - s * across)
        self._set(row, "vy_world", s * speed + c * across)
        self._set(row, "yaw_rate", yaw_rate)
        self._set(row, "battery", self._nominal_battery(row))
        self._set(row, "floor_grip", 1.0)
        self.contact_accel_x[row] = self.contact_accel_y[row] = self.contact_yaw_accel[row] = 0.0
        at_rest = {"steer": steer_angle, "throttle": throttle}
        for name, initial in self._states.items():
            self._set(row, name, at_rest.get(VARIABLES[name].starts_at) or initial)
        self._set(row, "steer_angle", steer_angle or 0.0)
        for name in actuators if keep_actuators else ():
            if steer_angle is None or VARIABLES[name].starts_at != "steer":
                self._set(row, name, actuators[name])
        self._roll(row, shape, speed, yaw_rate)
        self.status[row] = VehicleStatus.OK
        if self.history is not None and not keep_actuators:
            self.history.reset(row, throttle, 0.0 if steer_angle is None else None)
        self._run(row, row + 1, 0, SUBSTEP_S)

    def place_rows(self, rows: Ints, poses: Floats, speed: Floats) -> None:
        """Restart many rows at once, poses (n, 3) and speeds (n,); see `place`.

        Wheels are straight, lags and servo at rest. Where a row stands in the fleet, and which
        others are placed with it, changes no bit of it.
        """
        self._block[:, rows] = 0.0
        shape = self._shape_of(lambda key: self.parameters[rows, self._places[key]])
        cog, (s, c) = shape.cog_to_rear_axle, directions(poses[:, 2])
        for name, value in {
            "x_cog": poses[:, 0] + c * cog, "y_cog": poses[:, 1] + s * cog,
            "z_cog": shape.cog_height, "yaw": poses[:, 2], "vx_world": c * speed,
            "vy_world": s * speed, "battery": self._nominal_battery(rows), "floor_grip": 1.0,
            **self._states,
        }.items():  # fmt: skip
            self._set(rows, name, value)
        for values in (self.contact_accel_x, self.contact_accel_y, self.contact_yaw_accel):
            values[rows] = 0.0
        self._roll(rows, shape, speed, 0.0)
        self.status[rows] = VehicleStatus.OK
        if self.history is not None:
            self.history.reset(rows, 0.0, 0.0)
        if len(rows):
            first, last = (LANES * (int(row) // LANES) for row in (rows.min(), rows.max()))
            self._run(first, min(last + LANES, self.capacity), 0, SUBSTEP_S)

    def _roll(self, row: int | Ints, shape: Shape, speed: float | Floats, yaw_rate: float) -> None:
        """Initialise placed cars' wheels: rolling without slip, under the static load."""
        half = 0.5 * self._parameter(row, "track") * yaw_rate
        rolling = np.array([speed - half, speed + half, speed - half, speed + half])
        self._set(row, "wheel_speed", rolling / self._parameter(row, "wheel_radius"))
        front = shape.cog_to_rear_axle / self._parameter(row, "wheelbase")
        shares = np.array([front, front, 1.0 - front, 1.0 - front])
        self._set(row, "wheel_load", 0.5 * shape.mass * GRAVITY * shares)

    def copy_row(self, source: int, row: int | slice) -> None:
        """Copy a car with its numbers and its whole state to another row, or to several."""
        for array in (self._block, self._numbers):
            array.T[row] = array[:, source]
        self.alive[row], self.status[row] = self.alive[source], self.status[source]
        if self.history is not None:
            self.history.copy_row(source, row)

    def place_at_rest(self, row: int) -> None:
        """Put a newly placed car at rest on the heights in `floor_height`."""
        front_left, front_right, rear_left, rear_right = self.floor_height[row].tolist()
        shape, rear = self.shape(row), 0.5 * (rear_left + rear_right)
        rise = (0.5 * (front_left + front_right) - rear) / self._parameter(row, "wheelbase")
        left_up = 0.5 * (front_left + rear_left - front_right - rear_right)
        roll, height = left_up / self._parameter(row, "track"), shape.cog_height
        masses = (self._parameter(row, name) for name in ("wheel_mass", "wheelbase"))
        _, ahead = plain(sprung_part)(shape.mass, shape.cog_to_rear_axle, *masses)
        c, s = math.cos(float(self.yaw[row])), math.sin(float(self.yaw[row]))
        for name, change in (
            ("x_cog", height * (s * roll - c * rise)),
            ("y_cog", -height * (c * roll + s * rise)),
            ("z_cog", rear + ahead * rise),
            ("roll", roll),
            ("pitch", -rise),
            ("hop", self.floor_height[row].copy()),
        ):
            self._set(row, name, self._view(name)[row] + change)
        self._run(row, row + 1, 0, SUBSTEP_S)

    def shape(self, row: int) -> Shape:
        """Return one car's mass properties, effects included."""
        return self._shape_of(lambda key: float(self.parameters[row, self._places[key]]))

    def advance(self, duration: float, substep: float = SUBSTEP_S) -> None:
        """Advance all cars by whole substeps in one call, without the interpreter lock [s].

        With `threads` above 1 large fleets are divided by whole tiles; the result is the same.

        Raises:
            RunError: when duration or substep is negative or no number.
        """
        tiles = self._alive.size // LANES
        parts = min(self.threads, tiles // _TILES_A_THREAD)
        if parts < 2:
            self.advance_rows(0, self.capacity, duration, substep)
            return
        cuts = [LANES * (tiles * i // parts) for i in range(parts)] + [self.capacity]
        work = [
            pool(self.threads).submit(self.advance_rows, first, last, duration, substep)
            for first, last in pairwise(cuts[1:])
        ]
        self.advance_rows(0, cuts[1], duration, substep)
        for part in work:
            part.result()

    def advance_rows(
        self, first: int, last: int, duration: float, substep: float = SUBSTEP_S
    ) -> None:
        """Advance only the rows first..last-1, so that threads can share a fleet.

        Raises:
            RunError: when there are no such rows, or duration or substep is negative or no number.
        """
        if not 0 <= first <= last <= self.capacity:
            raise RunError(f"rows {first} to {last}: expected rows between 0 and {self.capacity}")
        self._run(first, last, whole_steps(duration, substep), substep)

    def rollout(
        self, throttle: Floats, steering: Floats, step_s: float,
        variables: Sequence[str] = ("x", "y", "yaw", "speed"), substep: float = SUBSTEP_S,
    ) -> dict[str, Floats]:  # fmt: skip
        """Simulate all cars with recorded commands in one call, each with its own numbers.

        Args:
            throttle: Commands at the start of each step, (T,), or (T, capacity) for each car.
            steering: Likewise.
            step_s: Length of one step of the recording [s], in whole substeps.
            variables: Names of the results; one wheel as `wheel_angle.rl`.
            substep: Length of a substep [s].

        Returns:
            Each variable after every step, (T, capacity).

        Raises:
            RunError: when shapes or steps do not fit, or a name is unknown.
        """
        commands = [columns_of_command(c, self.capacity) for c in (throttle, steering)]
        if len(commands[0]) != len(commands[1]):
            msg = f"{len(commands[0])} throttles and {len(commands[1])} steerings: expected as many"
            raise RunError(msg)
        offsets = np.array([self._offset_of(name) for name in variables], dtype=np.int64)
        out = np.zeros((len(commands[0]), len(offsets), self._alive.size))
        steps = steps_of(step_s, substep)
        if self.history is None:
            self._kernel.rollout(
                self._block, self._numbers, self._alive, self._status, 0, self.capacity, steps,
                substep, *commands, offsets, out,
            )  # fmt: skip
        else:
            for t in range(len(out)):
                now = (np.resize(command[t], self.capacity) for command in commands)
                self.throttle[:], self.steering[:] = now
                self._run(0, self.capacity, steps, substep)
                out[t] = self._block[offsets]
        return {name: out[:, k, : self.capacity] for k, name in enumerate(variables)}

    def pose(self, row: int) -> Pose2:
        """Return the rear axle's pose in the world."""
        return Pose2(float(self.x[row]), float(self.y[row]), float(self.yaw[row]))

    def variables(self, row: int) -> dict[str, Floats]:
        """Return all that the kernel keeps of a car, by name: views (width,), of width 1 or 4."""
        return {name: self._block[i : i + n, row] for name, (i, n) in self._offsets.items()}

    def planar_cog(self, row: int) -> tuple[float, float, float, float, float, float]:
        """Return (x, y, yaw, vx, vy, yaw_rate) of the centre of gravity in the world frame."""
        x, y, yaw, vx, vy, rate = (float(self._block[self._offsets[n][0], row]) for n in COG)
        return x, y, yaw, vx, vy, rate

    def planar_cogs(self, rows: Ints) -> Floats:
        """Return `planar_cog` of many rows at once, shape (n, 6)."""
        offsets = [self._offsets[name][0] for name in COG]
        return self._block[offsets, rows[:, None]]

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

        A change that is not finite is not applied: it freezes the car, marked DIVERGED.
        """
        if self.status[row] != VehicleStatus.OK:
            return
        changes = (dvx, dvy, dyaw_rate, dx, dy, dyaw)
        if not all(map(math.isfinite, changes)):
            self.status[row] = VehicleStatus.DIVERGED
            return
        for name, change in zip(COG_CHANGED, changes, strict=True):
            self._block[self._offsets[name][0], row] += change
        self._run(row, row + 1, 0, SUBSTEP_S)

    def push_rows(self, rows: Ints, changes: Floats) -> None:
        """Do `push` for many cars: each row once, changes (n, 6) in the order of `push`."""
        rows, changes = np.asarray(rows), np.asarray(changes)
        fine = self.status[rows] == VehicleStatus.OK
        finite = np.isfinite(changes).all(axis=1)
        self.status[rows[fine & ~finite]] = VehicleStatus.DIVERGED
        rows, changes = rows[fine & finite], changes[fine & finite]
        for name, change in zip(COG_CHANGED, changes.T, strict=True):
            self._block[self._offsets[name][0], rows] += change
        tiles = np.unique(rows // LANES) * LANES
        for start in tiles:
            self._run(start, min(start + LANES, self.capacity), 0, SUBSTEP_S)

    def set_parameter(self, row: int, name: str, value: float) -> None:
        """Set one car's number by the parameter's name or its key in the car file.

        Raises:
            TermError: when the car has no such parameter, or the value lies outside its bounds.
            RunError: when there is no such row.
        """
        self._check(row)
        column = find_column(self.columns, name)
        param = self.columns[column].param
        low, high = param.bounds
        if not low <= value <= high:
            raise TermError(f"{param.key} = {value}: expected {low:g} to {high:g} {param.unit}")
        self.parameters[row, column] = value

    @property
    def bytes_per_car(self) -> int:
        """Memory per car."""
        arrays = (self._block, self._numbers, self._alive, self._status)
        past = self.history.bytes_per_car if self.history else 0
        return sum(a.nbytes for a in arrays) // self._alive.size + past + 3 * 8

    def _check(self, row: int) -> None:
        if not 0 <= row < self.capacity:
            msg = f"fleet of {self.car.name}: no row {row}, expected 0 to {self.capacity - 1}"
            raise RunError(msg)

    def _offset_of(self, name: str) -> int:
        if name not in self._variable_offsets:
            hint = nearest(name, sorted(self._variable_offsets))
            raise RunError(f"rollout: {name!r} is no variable of each car{hint}")
        return self._variable_offsets[name]

    def _parameter(self, row: int | Ints, name: str) -> Any:
        return self.parameters[row, self.parameter_names.index(name)]

    def _nominal_battery(self, row: int | Ints) -> float | Floats:
        key = "drive.battery_nominal_v"
        if "battery_nominal" in self.parameter_names:
            return cast("Floats", self._parameter(row, "battery_nominal"))
        return self.car.value(key) if self.car.has(key) else 0.0

    def _view(self, name: str) -> Floats:
        offset, width = self._offsets[name]
        if width == 1:
            return self._block[offset, : self.capacity]
        return self._block[offset : offset + width, : self.capacity].T

    def _set(self, row: int | Ints, name: str, value: float | Floats) -> None:
        offset, width = self._offsets[name]
        self._block[offset : offset + width, row] = value

    def _run(self, first: int, last: int, steps: int, substep: float) -> None:
        if self.history is not None and steps > 0:
            span = steps * substep
            self.history.apply(self._block, self._numbers, self._alive, first, last, span)
        self._kernel.advance(
            self._block, self._numbers, self._alive, self._status, first, last, steps, substep
        )
