"""The skeleton's implicit step against its equations of motion, integrated by SciPy."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from scm.geometry import Pose2
from scm.vehicles.body14 import GRAVITY
from scm.vehicles.car import load_car
from scm.vehicles.fleet import Fleet
from scm.vehicles.jit import plain
from scm.vehicles.layout import columns_of
from scm.vehicles.physics_variables import Per
from scm.vehicles.term import reads

THROTTLE, STEER, SPEED, SECONDS = 0.35, 0.12, 1.5, 0.4
# heavy wheels, heavy nose: the sprung mass balances 10 mm ahead of the whole car
CAR = load_car("f1tenth").with_terms([], {"body.cog_to_rear_axle_m": 0.2, "wheel.mass_kg": 0.2})


class Equations:
    """Newton and Euler for one car at constant throttle and steering, with the car's own laws."""

    def __init__(self, car):
        self.car = car
        self.n = {c.param.name: car.value(c.param.key) for c in columns_of(car.terms)}
        n = self.n
        front, back = n["wheelbase"] - n["cog_to_rear_axle"], n["cog_to_rear_axle"]
        self.x = np.array([front, front, -back, -back])
        self.y = 0.5 * n["track"] * np.array([1.0, -1.0, 1.0, -1.0])
        self.sprung = n["mass"] - 4 * n["wheel_mass"]
        own = -n["wheel_mass"] * self.x.sum() / self.sprung  # with four wheels it balances at 0
        self.seat_x = self.x - own
        self.rest_load = (
            0.5 * n["mass"] * GRAVITY / n["wheelbase"] * np.array([back, back, front, front])
        )
        self.steer = [
            math.atan(self.law("ackermann", w, {"road_slope": math.tan(STEER)})) for w in range(4)
        ]

    def law(self, name, w, signals):
        term = next(term for term in self.car.terms if term.name == name)
        numbers = {p.name: self.car.value(p.key) for p in term.params}
        wheel = {
            "front": float(w < 2),
            "side": (-1.0) ** w,
            "driven": self.n["front_driven"] if w < 2 else self.n["rear_driven"],
            "rest_spring_force": self.rest_load[w] - self.n["wheel_mass"] * GRAVITY,
            "rest_load": self.rest_load[w],
            "dt": 0.0,
            "supply_voltage": self.n["battery_nominal"],
            "motor_throttle": THROTTLE,
            "motor_strength": 1.0,
            "fade_strength": 1.0,
            "throttle": THROTTLE,
            "grip": 1.0,
            "slip_scale": 1.0,
            "rolling": 0.0,
            **dict.fromkeys(("side_lag", "side_lag_speed", "spin_lag", "spin_lag_speed"), 0.0),
        }
        known = {**self.n, **wheel, **signals, **numbers}
        return plain(term.function)(*(known[argument] for argument in reads(term.function)))

    def wheel(self, w, body, state):
        """Forces of one wheel: (along and across the body, up on the body, hop and spin rates)."""
        vx, vy, vz, p, q, r, z, roll, pitch = body
        hop, hop_rate, omega, other = state
        h, x, y, seat_x = self.n["cog_height"], self.x[w], self.y[w], self.seat_x[w]
        over_x, over_y = vx - y * r - h * q, vy + x * r + h * p
        c, s = math.cos(self.steer[w]), math.sin(self.steer[w])
        signals = {
            "omega": omega,
            "axle_omega": 0.5 * (omega + other),
            "v_long": c * over_x + s * over_y,
            "v_lat": c * over_y - s * over_x,
            "compression": hop - (z + y * roll - seat_x * pitch),
            "compression_rate": hop_rate - (vz + y * p - seat_x * q),
            "tyre_deflection": -hop,
            "tyre_deflection_rate": -hop_rate,
        }
        signals["load"] = signals["grip_load"] = self.law("tyre_contact", w, signals)
        sums = dict.fromkeys(
            ("suspension_force", "tyre_x", "tyre_y", "wheel_torque", "dry_torque"), 0.0
        )
        inertia = self.n["spin_inertia"] + self.law("reflected_inertia", w, signals)
        for term in self.car.terms:
            if term.per is Per.WHEEL and term.adds in sums:
                sums[term.adds] += self.law(term.name, w, signals)
        along, across, up = sums["tyre_x"], sums["tyre_y"], sums["suspension_force"]
        torque = sums["wheel_torque"] - math.copysign(sums["dry_torque"], omega)
        hop_rate_rate = (signals["load"] - up) / self.n["wheel_mass"] - GRAVITY
        spin_rate = (torque - self.n["wheel_radius"] * along) / inertia
        return c * along - s * across, s * along + c * across, up, hop_rate_rate, spin_rate

    def __call__(self, _, s):
        yaw = s[2]
        c, sn = math.cos(yaw), math.sin(yaw)
        r, z, roll, pitch, vz, p, q = s[5:12]
        hop, hop_rate, omega = s[12:16], s[16:20], s[20:24]
        body = (c * s[3] + sn * s[4], c * s[4] - sn * s[3], vz, p, q, r, z, roll, pitch)
        wheels = np.array(
            [self.wheel(w, body, (hop[w], hop_rate[w], omega[w], omega[w ^ 1])) for w in range(4)]
        )
        fx, fy, up = wheels[:, 0], wheels[:, 1], wheels[:, 2]
        n, h = self.n, self.n["cog_height"]
        ax, ay = fx.sum() / n["mass"], fy.sum() / n["mass"]
        return np.concatenate(
            [
                [s[3], s[4], r, c * ax - sn * ay, sn * ax + c * ay],
                [np.sum(self.x * fy - self.y * fx) / n["yaw_inertia"], vz, p, q],
                [up.sum() / self.sprung - GRAVITY],
                [np.sum(self.y * up + h * fy) / n["roll_inertia"]],
                [np.sum(-self.seat_x * up - h * fx) / n["pitch_inertia"]],
                hop_rate,
                wheels[:, 3],
                wheels[:, 4],
            ]
        )


@pytest.fixture(scope="module")
def reference():
    equations = Equations(CAR)
    start = np.zeros(24)
    start[0], start[3] = CAR.value("body.cog_to_rear_axle_m"), SPEED
    start[20:24] = SPEED / CAR.value("wheel.radius_m")
    end = solve_ivp(equations, (0.0, SECONDS), start, method="LSODA", rtol=1e-8, atol=1e-10)
    assert end.success
    return end.y[:, -1]


def error_of(substep, reference):
    """Largest difference of position, heading, velocity, roll, pitch after the same drive."""
    fleet = Fleet(CAR, 1)
    fleet.add(Pose2(0.0, 0.0, 0.0))
    fleet.place(0, Pose2(0.0, 0.0, 0.0), SPEED, steer_angle=STEER)
    fleet.throttle[0] = THROTTLE
    fleet.steering[0] = STEER / fleet.car.value("steering.limit_rad")
    fleet.advance(SECONDS, substep=substep)
    own = [*fleet.planar_cog(0), fleet.roll[0], fleet.pitch[0]]
    return np.abs(np.array(own) - reference[[0, 1, 2, 3, 4, 5, 7, 8]]).max()


def test_scipy_finds_the_same_motion(reference):
    assert reference[2] > 0.1  # the car does turn
    assert error_of(1e-3, reference) < 1e-2
    assert error_of(1e-5, reference) < 1e-4


def test_the_difference_to_scipy_shrinks_with_the_substep(reference):
    coarse, fine = error_of(1e-3, reference), error_of(1e-4, reference)
    assert coarse / fine == pytest.approx(10.0, rel=0.25)
