"""Where a car is since it began, from its own sensors: encoders, gyro and what its scanner sees.

An extended Kalman filter of pose, speed and gyro bias. The gyro turns the car, the encoders measure
its speed, and range flow measures how the scanner moved from one sweep to the next: the pose at the
last sweep is part of the state, so what all three agree upon is not counted thrice.

    x' = v cos yaw    y' = v sin yaw    yaw' = gyro - bias    v' = noise    bias' = noise

A sweep is some hundredths of a second old when it arrives. The filter itself stands at the last
sweep; what the other sensors measured since then is added for the present pose.
A car that measures neither, as one with the published firmware, has the Eye's speed and yaw rate in
their place.
Holds: the rear axle does not slide sideways by more than `SIDE` of the way; a level floor.
Source: stochastic cloning, Roumeliotis and Burdick, ICRA 2002; the flow is `range_flow.py`.
"""

import math
from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from scm.arrays import Floats
from scm.clock import NS_PER_S
from scm.errors import CarError
from scm.geometry import TAU, Pose2, wrap_angle
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.vehicles.car import Car
from vehicle_agent.autonomy.range_flow import Flow, range_flow, seen_at_end
from vehicle_agent.autonomy.sweep import Sweep, Twist, sweep_of

ACCELERATION = 1.5  # white, of what changes speed [m/s^2 * sqrt(s)]
SIDE, SLIP = 0.05, 0.02  # of the way: sideways of a rolling axle; of wheels that slip
GYRO_NOISE = 0.002  # of a reading, where the car file has none [rad/s]
GYRO_SCALE = 0.01  # of the yaw rate, by which a gyro may be wrong
GYRO_DRIFT = 1e-4  # of its bias [rad/s / sqrt(s)]
FIRST_BIAS = 0.05  # [rad/s]
EYE_SPEED_STD, EYE_YAW_RATE_STD = 0.03, 0.15  # it averages over 0.15 s [m/s], [rad/s]
FLOW_WIDER = 3.0  # of its std: beams beside each other see the same wall
LIKELY = 16.3  # of a flow's squared distance with three numbers: 99.9 %
CLEAR_M = 0.06  # residual of a flow between sweeps of the same surroundings
LIFTED_M, LIFTED_RAD = 0.15, 0.3  # by which a flow contradicts the rest: no car slips so far
NEXT_KEY_M, NEXT_KEY_RAD = 0.05, 0.1  # from a key sweep, before the next becomes one
CONTRARY_M, CONTRARY = 0.025, (-2.0, -0.5)  # way of the wheels; a flow's part of it
AT_REST_S = 0.2  # without a count, before a car is taken to stand
LONGEST_S = 1.0  # without a sweep, before the filter goes on alone
CHECK_MOUNT = "check how it is mounted, and the car file's [lidar]"
CONTRARY_WORDS = "the scanner sees the car drive the other way than its wheels"
X, Y, YAW, V, BIAS, LAST = 0, 1, 2, 3, 4, slice(5, 8)


@dataclass(frozen=True, slots=True, eq=False)
class Odometry:
    """Pose and motion at one time.

    Attributes:
        pose: Of the rear axle's middle since the beginning, odom frame [m, rad].
        twist: In the car's frame.
        covariance: Of x, y and yaw since the key sweep [m, m, rad].
    """

    t_ns: int
    pose: Pose2
    twist: Twist
    covariance: Floats


@dataclass(frozen=True, slots=True, eq=False)
class _State:
    t_ns: int
    mean: Floats
    covariance: Floats
    yaw_rate: float = 0.0


@dataclass(frozen=True, slots=True)
class Seen:
    """How the Eye saw the car move."""

    t_ns: int
    speed_mps: float
    yaw_rate_radps: float


class OdometryFilter:
    """Odometry of one car.

    Args:
        car: With `lidar.position_m`, wheel radius and encoders in its file.

    Attributes:
        is_contrary: Two flows in a row had the car drive the other way than its wheels, or the Eye.
        was_lifted: Whether the last sweep was from a place where the car cannot have driven.

    Raises:
        CarError: when the file has no scanner.
    """

    def __init__(self, car: Car) -> None:
        self._mount = mount_of(car)
        counts = car.value("encoder.counts_per_revolution") if _has_encoders(car) else 0.0
        self._per_count_m = TAU * car.value("wheel.radius_m") / counts if counts else None
        self._gyro_noise = GYRO_NOISE
        if car.has("imu.gyro_noise_rad_s"):
            self._gyro_noise = max(GYRO_NOISE, car.value("imu.gyro_noise_rad_s"))
        self._state: _State | None = None
        self._waiting = deque[VehicleSensors | Seen]()
        self._before: VehicleSensors | Seen | None = None
        self._turned_ns = 0
        self._key: Sweep | None = None
        self._way_m = 0.0  # of the wheels, since the key sweep
        self._contraries = 0
        self.is_contrary = False
        self.was_lifted = False

    def sensors(self, measured: VehicleSensors | Seen) -> None:
        """Take what the car's other sensors measured, or the Eye; older is ignored."""
        newest = self._waiting[-1] if self._waiting else self._before
        if newest is not None and measured.t_ns <= newest.t_ns:
            return
        if self._state is None:
            self._begin(measured.t_ns)
        self._waiting.append(measured)
        state = self._state
        if state is not None and measured.t_ns - state.t_ns > LONGEST_S * NS_PER_S:
            self._state = self._on_to(state, self._waiting.popleft())

    def scan(self, message: LidarScan) -> Flow | None:
        """Take a sweep; return how the scanner moved since the key sweep, None: that is not used.

        Raises:
            MessageError: when the message is damaged.
        """
        sweep = sweep_of(message)
        if self._state is None:
            self._begin(sweep.t_ns)
        state, key, self.was_lifted = self._state, self._key, False
        if state is None or sweep.t_ns < state.t_ns:
            return None
        while self._waiting and self._waiting[0].t_ns <= sweep.t_ns:
            measured = self._waiting.popleft()
            self._way_m += self._way(measured)
            state = self._on_to(state, measured)
        state = _moved(state, sweep.t_ns, state.yaw_rate, self._gyro_noise)
        sweep = seen_at_end(sweep, self._of_scanner(state))
        flow = None
        if key is not None and len(key.ranges) == len(sweep.ranges):
            flow = range_flow(key, sweep, self._guess(state))
            self._compare(flow)
            state, is_used = self._seen(state, flow)
            flow = flow if is_used else None
        moved = self._guess(state)
        far = math.hypot(moved.x, moved.y) > NEXT_KEY_M or abs(moved.yaw) > NEXT_KEY_RAD
        if key is None or far or flow is None:
            self._key, state, self._way_m = sweep, _cloned(state), 0.0
        self._state = state
        return flow

    def _way(self, measured: VehicleSensors | Seen) -> float:
        """Return the way since the measurement before, by the wheels or the Eye, + forward [m]."""
        before = self._before
        if before is None or measured.t_ns <= before.t_ns:
            return 0.0
        if isinstance(measured, Seen):
            return measured.speed_mps * (measured.t_ns - before.t_ns) / NS_PER_S
        if self._per_count_m is None or not isinstance(before, VehicleSensors):
            return 0.0
        counts = measured.encoder_left - before.encoder_left
        counts += measured.encoder_right - before.encoder_right
        return 0.5 * counts * self._per_count_m

    def _compare(self, flow: Flow) -> None:
        """Notice a scanner that looks backward: it sees the car drive the other way."""
        if abs(self._way_m) < CONTRARY_M:
            return
        seen = (self._mount @ flow.motion @ self._mount.inverse()).x
        std = FLOW_WIDER * math.sqrt(flow.covariance[0, 0])
        is_clear = flow.residual_m < CLEAR_M and abs(seen) > std
        least, most = CONTRARY
        is_contrary = is_clear and least < seen / self._way_m < most
        self._contraries = self._contraries + 1 if is_contrary else 0
        self.is_contrary |= self._contraries > 1

    def _of_scanner(self, state: _State) -> Twist:
        """Return the motion of the scanner, in its own frame."""
        speed, rate = float(state.mean[V]), state.yaw_rate
        along, across = speed - rate * self._mount.y, rate * self._mount.x
        c, s = math.cos(self._mount.yaw), math.sin(self._mount.yaw)
        return Twist(c * along + s * across, c * across - s * along, rate)

    @property
    def at_sweep(self) -> Odometry | None:
        """Odometry at the end of the last sweep; None before one."""
        return None if self._state is None or self._key is None else _odometry(self._state)

    def now(self) -> Odometry | None:
        """Return the newest odometry; None before anything was measured."""
        state, before, turned_ns = self._state, self._before, self._turned_ns
        if state is None:
            return None
        for measured in self._waiting:
            state = self._on_to(state, measured)
        self._before, self._turned_ns = before, turned_ns
        return _odometry(state)

    def _begin(self, t_ns: int) -> None:
        covariance = np.zeros((8, 8))
        covariance[V, V], covariance[BIAS, BIAS] = 1.0, FIRST_BIAS**2
        self._state = _State(t_ns, np.zeros(8), covariance)

    def _on_to(self, state: _State, measured: VehicleSensors | Seen) -> _State:
        """Return the state at the time of a measurement, with it."""
        if isinstance(measured, Seen):
            self._before = measured
            rate = measured.yaw_rate_radps - float(state.mean[BIAS])
            state = _moved(state, measured.t_ns, rate, EYE_YAW_RATE_STD)
            left = np.array([measured.speed_mps - state.mean[V]])
            return _corrected(state, left, _row(V), EYE_SPEED_STD**2 * np.eye(1))
        rate = measured.gyro_radps[2] - float(state.mean[BIAS])
        state = _moved(state, measured.t_ns, rate, self._gyro_noise)
        way_m = self._way(measured)
        before, self._before = self._before, measured
        if self._per_count_m is None or not isinstance(before, VehicleSensors):
            return state
        if measured.t_ns <= before.t_ns:
            return state
        dt = (measured.t_ns - before.t_ns) / NS_PER_S
        speed = way_m / dt
        std = math.hypot(0.5 * self._per_count_m / dt, SLIP * speed)
        state = _corrected(state, np.array([speed - state.mean[V]]), _row(V), std**2 * np.eye(1))
        if way_m:
            self._turned_ns = measured.t_ns
        elif measured.t_ns - self._turned_ns > AT_REST_S * NS_PER_S:
            bias = np.array([measured.gyro_radps[2] - state.mean[BIAS]])
            state = _corrected(state, bias, _row(BIAS), self._gyro_noise**2 * np.eye(1))
            state = replace(state, yaw_rate=0.0)
        return state

    def _guess(self, state: _State) -> Pose2:
        """Return how the scanner moved since the last sweep, by the state."""
        last, now = _poses(state)
        return (last @ self._mount).inverse() @ (now @ self._mount)

    def _seen(self, state: _State, flow: Flow) -> tuple[_State, bool]:
        """Return the state with a flow, and whether that was used.

        A flow that contradicts the wheels is right where both sweeps see the same surroundings:
        then the wheels slip, and the state may be wrong by as much as the two differ.
        """
        expected = self._guess(state)
        rows, small = np.zeros((3, 8)), 1e-6
        for j in (X, Y, YAW, 5, 6, 7):
            mean = state.mean.copy()
            mean[j] += small
            rows[:, j] = _apart(self._guess(replace(state, mean=mean)), expected) / small
        noise = FLOW_WIDER**2 * flow.covariance
        left = _apart(flow.motion, expected)
        spread = rows @ state.covariance @ rows.T + noise
        distance = float(left @ np.linalg.solve(spread, left))
        if distance > LIKELY:
            if flow.residual_m > CLEAR_M:
                return state, False
            self.was_lifted = math.hypot(*left[:2]) > LIFTED_M or abs(left[2]) > LIFTED_RAD
            slip = np.zeros(8)
            slip[[X, Y]] = left[:2] @ left[:2]
            slip[YAW] = left[2] ** 2
            state = replace(state, covariance=state.covariance + np.diag(slip))
        return _corrected(state, left, rows, noise), True


def _odometry(state: _State) -> Odometry:
    x, y, yaw, speed, _ = map(float, state.mean[:5])
    pose = Pose2(x, y, wrap_angle(yaw))
    return Odometry(state.t_ns, pose, Twist(speed, 0.0, state.yaw_rate), state.covariance[:3, :3])


def mount_of(car: Car) -> Pose2:
    """Return where a car file has the scanner.

    Raises:
        CarError: when it has none.
    """
    if not car.has("lidar.position_m"):
        msg = f"{car.path}: [lidar]: expected the place of a scanner, position_m, got none"
        raise CarError(msg)
    x_m, y_m, _ = car.vector("lidar.position_m")
    return Pose2(x_m, y_m, 0.0)


def _row(number: int) -> Floats:
    """Return the derivatives of one number of the state."""
    return np.eye(8)[number : number + 1]


def _has_encoders(car: Car) -> bool:
    return car.has("encoder.counts_per_revolution") and car.has("wheel.radius_m")


def _poses(state: _State) -> tuple[Pose2, Pose2]:
    """Return the pose at the last sweep, and now."""
    return Pose2(*map(float, state.mean[LAST])), Pose2(*map(float, state.mean[:3]))


def _apart(one: Pose2, other: Pose2) -> Floats:
    return np.array((one.x - other.x, one.y - other.y, wrap_angle(one.yaw - other.yaw)))


def _moved(state: _State, t_ns: int, yaw_rate: float, gyro_noise: float) -> _State:
    """Return the state at a later time, at a yaw rate and a gyro's noise in it [rad/s]."""
    dt = (t_ns - state.t_ns) / NS_PER_S
    if dt <= 0.0:
        return replace(state, yaw_rate=yaw_rate)
    mean, speed = state.mean.copy(), float(state.mean[V])
    middle = float(mean[YAW]) + 0.5 * yaw_rate * dt
    c, s, way = math.cos(middle), math.sin(middle), speed * dt
    mean[:3] += way * c, way * s, yaw_rate * dt
    on = np.eye(8)
    on[X, YAW], on[Y, YAW] = -way * s, way * c
    on[X, V], on[Y, V] = dt * c, dt * s
    on[YAW, BIAS] = -dt
    on[X, BIAS], on[Y, BIAS] = 0.5 * dt * way * s, -0.5 * dt * way * c
    noise = np.zeros((8, 8))
    noise[:2, :2] = (SIDE * way) ** 2 * np.array(((s * s, -s * c), (-s * c, c * c)))
    noise[YAW, YAW] = (gyro_noise**2 + (GYRO_SCALE * yaw_rate) ** 2) * dt * dt
    noise[V, V] = ACCELERATION**2 * dt
    noise[BIAS, BIAS] = GYRO_DRIFT**2 * dt
    return _State(t_ns, mean, on @ state.covariance @ on.T + noise, yaw_rate)


def _corrected(state: _State, left: Floats, rows: Floats, noise: Floats) -> _State:
    """Return the state with a measurement: what is `left` of it, its derivatives, its noise."""
    gain = np.linalg.solve(rows @ state.covariance @ rows.T + noise, rows @ state.covariance).T
    keep = np.eye(8) - gain @ rows
    covariance = keep @ state.covariance @ keep.T + gain @ noise @ gain.T
    return replace(state, mean=state.mean + gain @ left, covariance=covariance)


def _cloned(state: _State) -> _State:
    """Return the state with the pose at the last sweep that of now, which is known from here on."""
    mean, covariance = state.mean.copy(), state.covariance.copy()
    mean[LAST] = mean[:3]
    covariance[:3, :], covariance[:, :3] = 0.0, 0.0  # drift counts from here on
    covariance[LAST, :], covariance[:, LAST] = 0.0, 0.0
    return replace(state, mean=mean, covariance=covariance)
