"""The F1TENTH car as CommonRoad's single-track and multi-body models of equal parameters.

All three get the steering angle that our servo made; the speed of ours is held by the models'
acceleration input, so that what differs is what the models make of it.
Source of the models: Althoff and Wuersching, "CommonRoad: Vehicle Models", 2020.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares
from vehiclemodels.init_mb import init_mb
from vehiclemodels.vehicle_dynamics_mb import vehicle_dynamics_mb
from vehiclemodels.vehicle_dynamics_st import vehicle_dynamics_st
from vehiclemodels.vehicle_parameters import VehicleParameters

from scm.arrays import Floats
from scm.geometry import Pose2
from scm.vehicles.body14 import GRAVITY
from scm.vehicles.car import Car, load_car
from scm.vehicles.fleet import Fleet
from scm.vehicles.jit import plain
from scm.vehicles.tyre_curve import curve_over_slip

STEP_S = 1e-3
HOLD = 40.0  # 1/s: how hard the models' acceleration follows our speed
SLIPS = np.linspace(0.002, 0.35, 60)
# No camber effect, no shifts, and slips that do not disturb each other: as the paper's tyre.
_CALM = (
    "p_dx3",
    "p_hx1",
    "p_vx1",
    "r_bx1",
    "r_bx2",
    "r_ex1",
    "r_hx1",
    "p_dy3",
    "p_hy1",
    "p_hy3",
    "p_vy1",
    "p_vy3",
    "r_by1",
    "r_by2",
    "r_by3",
    "r_ey1",
    "r_hy1",
    "r_vy1",
    "r_vy3",
    "r_vy4",
    "r_vy5",
    "r_vy6",
)


@dataclass(frozen=True)
class Manoeuvre:
    """What the driver does: commands over time since the start, at a first speed [m/s]."""

    name: str
    speed: float
    seconds: float
    steering: Callable[[Floats], Floats]
    throttle: Callable[[Floats], Floats]


def _steps(before: float, after: float, at: float) -> Callable[[Floats], Floats]:
    return lambda t: np.where(t < at, before, after)


MANOEUVRES = (
    Manoeuvre("step steer", 2.5, 1.5, _steps(0.0, 0.2, 0.2), _steps(0.45, 0.45, 0.0)),
    Manoeuvre("sine sweep", 2.5, 4.0,
              lambda t: 0.15 * np.sin(2.0 * math.pi * (0.5 * t + 0.25 * t * t)),
              _steps(0.45, 0.45, 0.0)),
    Manoeuvre("braking in a turn", 2.5, 1.5, _steps(0.15, 0.15, 0.0), _steps(0.45, -0.15, 0.7)),
    Manoeuvre("beyond the grip", 3.5, 1.5, _steps(0.0, 0.6, 0.2), _steps(0.5, 0.5, 0.0)),
)  # fmt: skip


@dataclass(frozen=True)
class Motion:
    """One model's answer; arrays over time. Velocities and yaw rate at the centre of gravity."""

    t: Floats
    x: Floats
    y: Floats
    speed: Floats
    lateral_speed: Floats
    yaw_rate: Floats


def ours(manoeuvre: Manoeuvre) -> tuple[Motion, Floats]:
    """Drive our car; return its motion and its mean road-wheel angle [rad]."""
    car = load_car("f1tenth")
    back = car.value("body.cog_to_rear_axle_m")
    fleet = Fleet(car, 1)
    row = fleet.add(Pose2(0.0, 0.0, 0.0), speed=manoeuvre.speed)
    t = np.arange(round(manoeuvre.seconds / STEP_S)) * STEP_S
    throttle, steering = manoeuvre.throttle(t), manoeuvre.steering(t)
    rows = np.zeros((len(t), 7))
    for i in range(len(t)):
        x, y, yaw = fleet.pose(row)
        rows[i] = (
            x + back * math.cos(yaw),
            y + back * math.sin(yaw),
            fleet.speed[row],
            fleet.lateral_speed[row] + back * fleet.yaw_rate[row],
            fleet.yaw_rate[row],
            fleet.steer_angle[row],
            0.0,
        )
        fleet.throttle[row], fleet.steering[row] = throttle[i], steering[i]
        fleet.advance(STEP_S)
    x, y, speed, lateral, rate, angle, _ = rows.T
    return Motion(t, x, y, speed, lateral, rate), angle


def single_track(reference: Motion, angle: Floats) -> Motion:
    """Let CommonRoad's single-track model do the same."""
    p = parameters(load_car("f1tenth"))
    inputs = _Inputs(reference, angle)

    def slope(t: float, state: Floats) -> list[float]:
        state = state.copy()
        state[2] = inputs.angle(t)
        return list(vehicle_dynamics_st(state, inputs.at(t, state[3]), p))

    start = np.array([reference.x[0], 0.0, angle[0], reference.speed[0], 0.0, 0.0, 0.0])
    found = _solve(slope, reference.t, start)
    speed, slip = found[3], found[6]
    return Motion(
        reference.t, found[0], found[1], speed * np.cos(slip), speed * np.sin(slip), found[5]
    )


def multi_body(reference: Motion, angle: Floats) -> Motion:
    """Let CommonRoad's 29-state multi-body model do the same."""
    p = parameters(load_car("f1tenth"))
    inputs = _Inputs(reference, angle)

    def slope(t: float, state: Floats) -> list[float]:
        state = state.copy()
        state[2] = inputs.angle(t)
        return list(vehicle_dynamics_mb(state, inputs.at(t, state[3]), p))

    core = [reference.x[0], 0.0, angle[0], reference.speed[0], 0.0, 0.0, 0.0]
    found = _solve(slope, reference.t, np.array(init_mb(core, p)))
    return Motion(reference.t, found[0], found[1], found[3], found[10], found[5])


class _Inputs:
    """Steering velocity (unused: the angle is given) and the acceleration that holds our speed."""

    def __init__(self, reference: Motion, angle: Floats) -> None:
        self._t, self._angle, self._speed = reference.t, angle, reference.speed
        self._slope = np.gradient(reference.speed, reference.t)

    def angle(self, t: float) -> float:
        return float(np.interp(t, self._t, self._angle))

    def at(self, t: float, speed: float) -> list[float]:
        wanted = float(np.interp(t, self._t, self._speed))
        return [0.0, float(np.interp(t, self._t, self._slope)) + HOLD * (wanted - speed)]


def _solve(slope: Callable[[float, Floats], list[float]], t: Floats, start: Floats) -> Floats:
    found = solve_ivp(slope, (t[0], t[-1]), start, "BDF", t, max_step=5e-3, rtol=1e-6, atol=1e-8)
    if not found.success:
        msg = f"SciPy gave up: {found.message}"
        raise RuntimeError(msg)
    return np.asarray(found.y)


def magic_formula(peak: float, slope: float, car_curve: Floats) -> tuple[float, float]:
    """Return shape C and curvature E that follow our tyre best over `SLIPS`, by least squares."""

    def off(shape: Floats) -> Floats:
        c, e = shape
        b = slope / (c * peak) * SLIPS
        return np.asarray(peak * np.sin(c * np.arctan(b - e * (b - np.arctan(b)))) - car_curve)

    found = least_squares(off, (1.4, 0.0), bounds=((1.01, -10.0), (1.99, 1.0)))
    return float(found.x[0]), float(found.x[1])


def curve(car: Car, lateral: str) -> tuple[float, float, Floats]:
    """Return peak, slope at zero and the force over load at `SLIPS` of our tyre."""
    keys = ("slip_extremum", "force_extremum", "slip_asymptote", "force_asymptote")
    numbers = [car.value(f"tyre.{lateral}{key}") for key in keys]
    forces = [slip * plain(curve_over_slip)(slip, *numbers) for slip in SLIPS]
    return numbers[1], 1.5 * numbers[1] / numbers[0], np.array(forces)


def parameters(car: Car) -> VehicleParameters:
    """Return CommonRoad's parameters of the same car; what it has and we have not is made stiff."""
    p = VehicleParameters()
    v = car.value
    p.m = v("body.mass_kg")
    p.b = v("body.cog_to_rear_axle_m")
    p.a = v("body.wheelbase_m") - p.b
    # its one a and b are the whole car's and the sprung mass's: so are the wheels' then
    unsprung = 2.0 * v("wheel.mass_kg")
    p.m_s = p.m - 2.0 * unsprung
    p.m_uf, p.m_ur = (2.0 * unsprung * arm / (p.a + p.b) for arm in (p.b, p.a))
    p.I_Phi_s, p.I_y_s = v("body.roll_inertia_kgm2"), v("body.pitch_inertia_kgm2")
    p.I_z, p.I_xz_s = v("body.yaw_inertia_kgm2"), 0.0
    p.K_sf = p.K_sr = v("suspension.spring_n_m")
    p.K_sdf = p.K_sdr = v("suspension.damper_ns_m")
    p.T_f = p.T_r = v("body.track_m")
    p.K_ras, p.K_rad, p.K_lt = 2.0e4, 100.0, 0.0
    p.K_tsf = p.K_tsr = p.D_f = p.D_r = p.E_f = p.E_r = 0.0
    p.h_raf = p.h_rar = 0.0
    p.h_s = p.h_cg = v("body.cog_height_m")
    p.I_uf = p.I_ur = unsprung * (0.5 * p.T_f) ** 2
    p.I_y_w = v("wheel.spin_inertia_kgm2") + v("drive.reflected_inertia_kgm2")
    p.R_w, p.K_zt = v("wheel.radius_m"), 2.0e4
    p.T_sb = p.T_se = 0.5
    p.steering.min, p.steering.max = -1.0, 1.0
    p.steering.v_min, p.steering.v_max = -10.0, 10.0
    limits = p.longitudinal
    limits.a_max, limits.v_max, limits.v_min, limits.v_switch = 3 * GRAVITY, 50.0, -50.0, 50.0
    for name in _CALM:
        setattr(p.tire, name, 0.0)
    p.tire.r_cx1 = p.tire.r_cy1 = 1.0
    peak, slope, forces = curve(car, "")
    p.tire.p_cx1, p.tire.p_ex1 = magic_formula(peak, slope, forces)
    p.tire.p_dx1, p.tire.p_kx1 = peak, slope
    peak, slope, forces = curve(car, "lateral_")
    p.tire.p_cy1, p.tire.p_ey1 = magic_formula(peak, slope, forces)
    p.tire.p_dy1, p.tire.p_ky1 = peak, -slope
    return p
