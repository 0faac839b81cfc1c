"""The same cars as CommonRoad's multi-body model of 29 states: its bodies, springs and tyres.

Its functions are compiled as they are. They treat a car below 0.1 m/s as a point that rolls without
slip, so the model is a car `SIZE` times as long, by Froude's similarity, which is as slow as that
below 0.01 m/s. It never rolls backwards. Needs `pip install commonroad-vehicle-models`.

Source of the model: Althoff and Wuersching, "CommonRoad: Vehicle Models", 2020.
"""

import math
from dataclasses import fields, is_dataclass
from functools import cache
from types import FunctionType, ModuleType

import numpy as np
from numba import njit
from vehiclemodels.init_mb import init_mb
from vehiclemodels.vehicle_dynamics_mb import vehicle_dynamics_mb
from vehiclemodels.vehicle_parameters import VehicleParameters

from tests.reality import motion
from tests.reality.engine import Engine, kernel
from tests.reality.motion import ROW_S, TYRE_STIFFNESS
from tests.reality.numbers import GRAVITY

SIZE = 100.0
LATER = math.sqrt(SIZE * GRAVITY / 9.81)  # its seconds per second; 9.81 is its gravity
STEP_S = 0.00125
KINEMATIC = 0.1  # m/s, below which it does not slip
SLOW = KINEMATIC * LATER / SIZE
JOINT, JOINT_DAMPING = 1.0e6, 1000.0  # between body and axles, sideways; stiff
GAMMA = 1.0 - math.sqrt(0.5)  # of the second-order Rosenbrock method: L-stable
STATES = 29
MOST_ERROR = 0.002
LEAST_STEP = 0.02  # of a whole step
SPIN = 23  # of 29 states, the first wheel's
OTHER = (1, 0, 3, 2)  # its axes have y to the right: its left wheels are ours on the right
# No camber effect, no shifts, and slips that do not disturb each other.
CALM = (
    "p_dx3", "p_hx1", "p_vx1", "r_bx1", "r_bx2", "r_ex1", "r_hx1", "p_dy3", "p_hy1", "p_hy3",
    "p_vy1", "p_vy3", "r_by1", "r_by2", "r_by3", "r_ey1", "r_hy1", "r_vy1", "r_vy3", "r_vy4",
    "r_vy5", "r_vy6",
)  # fmt: skip


def magic_formula(slide):
    """Return shape C and curvature E that follow two cubics of peak 1 at slip 1.

    The end is theirs, `slide`, and so is the force where the slip is half of the peak's.
    """
    shape = 2.0 - 2.0 / math.pi * math.asin(slide)
    slip = 0.75 / shape
    felt = math.tan(math.asin(0.6875) / shape)
    return shape, (slip - felt) / (slip - math.atan(slip))


def wheel_inertia(numbers):
    """Return the spin inertia that all wheels have alike, the motors' part among it."""
    driven = 1.0 if numbers["front_driven"] > 0.0 else 0.5
    return numbers["spin_inertia"] + driven * numbers["rotor"]


def parameters(numbers, size=1.0, later=1.0):
    """Return CommonRoad's parameters of a car; what it has and we have not is made stiff.

    Args:
        size: How many times as long the car is; masses stay.
        later: Its seconds per second.
    """
    n, p = numbers, VehicleParameters()
    stiff, damped, turning = 1.0 / later**2, 1.0 / later, size**2
    p.m, p.b = n["mass"], size * n["cog"]
    p.a = size * n["base"] - p.b
    # its one a and b are the whole car's and the sprung mass's: so are the wheels' then
    unsprung = 2.0 * n["hub"]
    p.m_s = p.m - 2.0 * unsprung
    p.m_uf, p.m_ur = (2.0 * unsprung * arm / (p.a + p.b) for arm in (p.b, p.a))
    p.I_Phi_s, p.I_y_s = turning * n["roll_inertia"], turning * n["pitch_inertia"]
    p.I_z, p.I_xz_s = turning * n["inertia"], 0.0
    p.K_sf = p.K_sr = stiff * n["spring"]
    p.K_sdf = p.K_sdr = damped * n["damper"]
    p.T_f = p.T_r = size * n["track"]
    p.K_ras, p.K_rad, p.K_lt = stiff * JOINT, damped * JOINT_DAMPING, 0.0
    p.K_tsf = p.K_tsr = p.D_f = p.D_r = p.E_f = p.E_r = 0.0
    p.h_raf = p.h_rar = 0.0
    p.h_s = p.h_cg = size * n["height"]
    p.I_uf = p.I_ur = unsprung * (0.5 * p.T_f) ** 2
    p.I_y_w = turning * wheel_inertia(n)
    p.R_w, p.K_zt = size * n["radius"], stiff * TYRE_STIFFNESS
    p.T_sb = p.T_se = 0.5
    p.steering.min, p.steering.max, p.steering.v_min, p.steering.v_max = -1.5, 1.5, -1e3, 1e3
    limits = p.longitudinal
    limits.a_max, limits.v_max, limits.v_min, limits.v_switch = 1e4, 1e4, -1e4, 1e4
    _shoe(p.tire, n)
    return p


def _shoe(tyre, n):
    """Give a tyre the slope at no slip, the peak and the sliding friction of two cubics."""
    for name in CALM:
        setattr(tyre, name, 0.0)
    tyre.r_cx1 = tyre.r_cy1 = 1.0
    tyre.p_dx1 = n["grip"] * n["force_peak"]
    tyre.p_kx1 = 1.5 * tyre.p_dx1 / n["slip_peak"]
    tyre.p_cx1, tyre.p_ex1 = magic_formula(n["force_slide"] / n["force_peak"])
    tyre.p_dy1 = n["grip"] * n["side_force_peak"]
    tyre.p_ky1 = -1.5 * tyre.p_dy1 / n["side_slip_peak"] * n["stiffness"]
    tyre.p_cy1, tyre.p_ey1 = magic_formula(n["side_force_slide"] / n["side_force_peak"])


def _record(values):
    """Return parameters as a record, which compiled code can read, and how it is laid out."""
    found, layout = [], []
    for field in fields(values):
        value = getattr(values, field.name)
        if is_dataclass(value):
            inner, kind = _record(value)
            if not kind:
                continue
        elif value is None:
            continue
        else:
            inner, kind = float(value), "f8"
        found.append(inner)
        layout.append((field.name, kind))
    return tuple(found), layout


@cache
def _compiled(function):
    """Return a function of the package compiled, with those that it calls."""
    known = function.__globals__
    used = {"__name__": known["__name__"]}
    for name in function.__code__.co_names:
        if name not in known:
            continue
        value = known[name]
        if isinstance(value, FunctionType):
            value = _compiled(value)
        elif isinstance(value, ModuleType) and value.__name__.startswith("vehiclemodels"):
            module = ModuleType(value.__name__)
            for key, inner in vars(value).items():
                if isinstance(inner, FunctionType):
                    setattr(module, key, _compiled(inner))
            value = module
        used[name] = value
    code = FunctionType(function.__code__, used, function.__name__)
    return njit(code, error_model="numpy", cache=True)


_dynamics = _compiled(vehicle_dynamics_mb)


@njit(cache=True)
def _slope(x, p, turn, shafts, outside):
    """Return the derivative of the state.

    Args:
        turn: Rate of the steering.
        shafts: Of each wheel torque, its loss per speed, dry friction; (4, 3).
        outside: Forces along and across, and a moment.
    """
    slow = abs(x[3]) < KINEMATIC
    creep = motion.CREEP * SIZE / LATER
    torques = np.empty(4)
    for i in range(4):
        spin = x[3] / p.R_w if slow else x[SPIN + i]
        dry = shafts[i, 2] * math.tanh(spin * p.R_w / creep)
        torques[i] = shafts[i, 0] - shafts[i, 1] * spin - dry
    push = torques.sum() / p.R_w
    if slow:
        pushed = (push + outside[0]) / (p.m + 4.0 * p.I_y_w / (p.R_w * p.R_w))
        return np.array(_dynamics(x.copy(), (turn, pushed), p))
    found = np.array(_dynamics(x.copy(), (turn, push / p.m), p))
    for i in range(4):  # the model gives each wheel a quarter
        found[SPIN + i] += (torques[i] - 0.25 * torques.sum()) / p.I_y_w
    found[3] += outside[0] / p.m
    found[10] += outside[1] / p.m_s
    found[5] += outside[2] / p.I_z
    return found


@njit(cache=True)
def _solved(matrix, vector):
    """Solve by Gauss with pivots; numba's own needs SciPy's LAPACK at every call."""
    a, b, n = matrix.copy(), vector.copy(), len(vector)
    for k in range(n):
        best = k + np.argmax(np.abs(a[k:, k]))
        if best != k:
            for j in range(k, n):
                a[k, j], a[best, j] = a[best, j], a[k, j]
            b[k], b[best] = b[best], b[k]
        for i in range(k + 1, n):
            share = a[i, k] / a[k, k]
            if share != 0.0:
                a[i, k:] -= share * a[k, k:]
                b[i] -= share * b[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            b[k] -= a[k, j] * b[j]
        b[k] /= a[k, k]
    return b


@njit(cache=True)
def _step(x, p, turn, shafts, outside, h):
    """Return the state a step later, by a Rosenbrock method of two stages, and its error.

    The error is that of the wheels' speeds, relative to the car's.
    """
    first = _slope(x, p, turn, shafts, outside)
    matrix = np.eye(STATES)
    for k in range(2, STATES):  # nothing depends on the place
        more = 1e-6 * max(abs(x[k]), 1e-2)
        moved = x.copy()
        moved[k] += more
        matrix[:, k] -= GAMMA * h / more * (_slope(moved, p, turn, shafts, outside) - first)
    one = _solved(matrix, first)
    two = _solved(matrix, _slope(x + h * one, p, turn, shafts, outside) - 2.0 * one)
    off = np.abs(0.5 * h * (one + two))[SPIN : SPIN + 4].max() * p.R_w
    return x + h * (1.5 * one + 0.5 * two), off / max(x[3], KINEMATIC)


@njit(cache=True)
def _settle(x, p):
    """Let a car that is slow roll without slip, and none backwards."""
    x[3] = max(x[3], 0.0)
    x[SPIN : SPIN + 4] = np.maximum(x[SPIN : SPIN + 4], 0.0)
    if x[3] >= KINEMATIC:
        return
    x[5] = x[3] * math.tan(x[2]) / (p.a + p.b)
    x[10], x[15], x[20] = p.b * x[5], (p.a + p.b) * x[5], 0.0
    x[SPIN : SPIN + 4] = x[3] / p.R_w


@njit(cache=True)
def _advanced(x, p, turn, shafts, outside, h):
    """Return the state a step later, which is cut where wheels at walking pace need it."""
    left, size = h, h
    while left > 1e-9 * h and np.isfinite(x[3]):
        size = min(size, left)
        found, error = _step(x, p, turn, shafts, outside, size)
        if not error < MOST_ERROR and size > LEAST_STEP * h:
            size *= 0.5
            continue
        x, left = found, left - size
        size *= 2.0 if error < 0.2 * MOST_ERROR else 1.0
        _settle(x, p)
    return x


@njit(cache=True)
def _see(c, s, x, before, h):
    """Fill our own state from the model's, of before and after a step."""
    s.yaw = x[4]
    s.vx, s.vy, s.yaw_rate = x[3] * LATER / SIZE, x[10] * LATER / SIZE, x[5] * LATER
    gain = LATER * LATER / SIZE
    s.push = gain * ((x[3] - before[3]) / h - x[5] * x[10])
    s.side = gain * ((x[10] - before[10]) / h + x[5] * x[3])
    s.front_side = c.mass * s.side * c.cog / c.base
    cos, sin = math.cos(s.yaw), math.sin(s.yaw)
    s.x, s.y = x[0] / SIZE - c.cog * cos, x[1] / SIZE - c.cog * sin


@kernel(vehicle_dynamics_mb.__code__.co_filename)
def advance(numbers, state, wheels, x, given, throttle, steering, shake, first, steps):
    """Advance by some steps from step `first` on."""
    c, s, p, h = numbers[0], state[0], given[0], STEP_S * LATER
    turning, forcing = SIZE**2 / LATER**2, SIZE / LATER**2
    shafts = np.empty((4, 3))
    for k in range(steps):
        t = (first + k) * STEP_S
        motion.steer(c, s, t, motion.held(c, steering, t - c.steer_delay), motion.held(c, shake, t))
        u = motion.drive(c, s, t, motion.held(c, throttle, t - c.drive_delay))
        along, across, twist = motion.outside_force(c, s, t)
        slow = abs(s.throttle) < 0.005
        for i in range(4):
            at, left = 16 if i < 2 else 21, 1.0 if i % 2 == 0 else -1.0
            squeeze = x[at] + 0.5 * left * p.T_f * math.sin(x[at - 3])
            load = max(squeeze * p.K_zt / forcing, 0.0)
            j = OTHER[i]
            torque, damping, dry, _, current, loss = motion.turn_shaft(
                c, wheels, i, u, slow, load, c.rolling
            )
            shafts[j, 0], shafts[j, 1] = turning * torque, turning * damping * LATER
            shafts[j, 2] = turning * dry
            wheels[i, 5] = current - loss * wheels[i, 0]
        outside = np.array([forcing * along, forcing * across, turning * twist])
        before = x.copy()
        x[:] = _advanced(x, p, (s.angle - x[2]) / h, shafts, outside, h)
        _see(c, s, x, before, h)
        for i in range(4):
            wheels[i, 0] = x[SPIN + OTHER[i]] * LATER
            wheels[i, 1] += STEP_S * wheels[i, 0]


class Moving(Engine):
    """A car on the floor that is driven by commands of 20 Hz; as `motion.Moving`."""

    lacks = frozenset(
        {"patch_radius", "relaxation", "warm_grip"}  # its tyres are alike, and have no memory
    )
    fixed = Engine.fixed | {
        "tyre": "pacejka", "combined_slip": "none", "friction": "smooth",
    }  # fmt: skip
    terms = {"ackermann": "parallel_steering"}  # noqa: RUF012
    shaping = (
        "mass", "inertia", "roll_inertia", "pitch_inertia", "base", "track", "cog", "height",
        "spring", "damper", "hub", "radius", "spin_inertia", "rotor", "slip_peak", "force_peak",
        "slip_slide", "force_slide", "side_slip_peak", "side_force_peak", "side_slip_slide",
        "side_force_slide", "grip", "stiffness",
    )  # fmt: skip
    step_s, x = STEP_S, None
    least_throttle = 0.0

    @classmethod
    def stated(cls, numbers):
        """Return what the file of a nominal car must say of this engine's car, by file key."""
        return {
            "wheel.spin_inertia_kgm2": wheel_inertia(numbers),
            "drive.reflected_inertia_kgm2": 0.0,
            "tyre.low_speed_m_s": round(SLOW, 3),
            "steering.geometry": "parallel",
        }

    def _build(self, numbers):
        p = parameters(numbers, SIZE, LATER)
        found, layout = _record(p)
        self.p = np.array([found], layout)
        cog = SIZE * numbers["cog"]
        if self.x is not None:
            self.x[:2] += (cog - self.cog) * np.array((math.cos(self.x[4]), math.sin(self.x[4])))
            self.cog = cog
            return
        s = self.state[0]
        at = SIZE * s["x"] + cog * math.cos(s["yaw"]), SIZE * s["y"] + cog * math.sin(s["yaw"])
        self.cog, self.x = cog, np.array(init_mb([*at, 0.0, 0.0, s["yaw"], 0.0, 0.0], p), float)
        # its height at rest is above tyres that do not give
        self.x[8] = (self.x[21] - self.x[16]) / (p.a + p.b)
        self.x[11] = self.x[16] + p.a * self.x[8]

    def _row(self, row, out):
        steps, s = round(ROW_S / STEP_S), self.state[0]
        advance(
            self.numbers, self.state, self.wheels, self.x, self.p, self.throttle, self.steering,
            self.shake, row * steps, steps,
        )  # fmt: skip
        out[:4] = (row + 1) * ROW_S, s["x"], s["y"], s["yaw"]
        out[4:7] = s["vx"], s["vy"], s["yaw_rate"]
        out[7:9] = s["push"], s["side"]
        out[9:11] = self.wheels[2, 1], self.wheels[3, 1]
