"""Which equations and sensors a case has: its family, one value of each aspect.

Each equation describes the nominal car of its file as well as it can: a tyre has the same slope at
no slip and the same peak, a motor the same stall torque and no-load speed.
"""

import math
from dataclasses import make_dataclass

import numpy as np

from tests.reality.concealed import EFFECTS
from tests.reality.numbers import EQUATIONS, GRAVITY
from tests.reality.routes import TEMPERS

# The first value of each aspect is the usual one. Sizes of floor and noise are relative to it.
ASPECTS = {
    "tyre": ("two_cubics", "pacejka", "fiala", "brush"),
    "combined_slip": ("none", "friction_ellipse", "slip_vector"),
    "suspension": ("sprung", "quasi_static", "static"),
    "motor": ("torque_line", "inductance", "current_limit"),
    "servo": ("rate_limit", "first_order", "second_order", "loaded"),
    "friction": ("coulomb", "smooth", "stribeck", "viscous"),
    "body": ("semi_implicit", "midpoint"),
    "step_hz": (4000, 2000, 8000),
    "driver": ("pure_pursuit", "stanley", "hand", "open_loop"),
    "routes": ("basic", "spline", "further"),
    "floor": (1.0, 1.4, 0.7, 2.0),
    "pose_hz": (30, 20, 10, 120, 60),
    "pose_noise": (1.0, 0.5, 3.0, 2.0),
    "noise_shape": ("white", "student_t", "correlated", "quantised"),
    "jitter_s": (0.002, 0.005, 0.0),
    "lost": (0.015, 0.05, 0.0),
    "encoder_hz": (50, 100, 20, 0),
    "imu_hz": (100, 50, 200, 0),
}
HALVES = {"develop": slice(0, None, 2), "judge": slice(1, None, 2)}
"""Of each aspect the first, third and fifth value; the second and fourth."""
NEEDS = {
    "encoder_hz": {"encoder_loss", "wheel_radius"},
    "imu_hz": {
        "gyro_bias", "gyro_scale", "accel_bias", "imu_misalignment", "unit_error",
        "gyro_feels_push",
    },
}  # fmt: skip
"""Effects that a drive without these sensors does not show."""
SERVO_LAG = 0.2  # of the smallest steer_lag that is concealed
SERVO_LOAD = 0.1  # of the rate, under the usual side force; 0.9 is the least that is left
STRIBECK = 0.25  # of the smallest stiction that is concealed
VISCOUS = 0.15  # of the dry friction at the usual speed

Family = make_dataclass(
    "Family",
    [(aspect, type(values[0]), values[0]) for aspect, values in ASPECTS.items()],
    frozen=True,
)
USUAL = Family()


def draw_family(which: str, names: tuple[str, ...], rng: np.random.Generator):
    """Draw each value evenly, with sensors that show what is concealed.

    Args:
        which: One of `HALVES`, or `drawn`: of all values.
        names: Of the effects concealed.
    """
    part = HALVES.get(which, slice(None))
    choices = {aspect: values[part] for aspect, values in ASPECTS.items()}
    for sensor, effects in NEEDS.items():
        if effects & set(names):
            choices[sensor] = tuple(hz for hz in choices[sensor] if hz > 0)
    return Family(**{
        aspect: values[rng.integers(len(values))] for aspect, values in choices.items()
    })  # fmt: skip


def equations(family, car: str, numbers: dict[str, float], rng: np.random.Generator):
    """Return the numbers with which a car of some numbers has its family's equations."""
    chosen = {
        aspect: float(ASPECTS[aspect].index(getattr(family, aspect)))
        for aspect in EQUATIONS
        if aspect in ASPECTS
    }
    chosen["step"] = 1.0 / family.step_hz
    for side in ("", "side_"):
        slide = numbers[f"{side}force_slide"] / numbers[f"{side}force_peak"]
        shape, bend = _tyre(family.tyre, slide)
        chosen |= {f"{side}tyre_shape": shape, f"{side}tyre_bend": bend}
    chosen["winding_lag"] = rng.uniform(0.001, 0.003)
    chosen["current_limit"] = rng.uniform(0.8, 1.2)
    chosen["servo_lag"] = SERVO_LAG * EFFECTS["steer_lag"].smallest[car]
    front = numbers["mass"] * numbers["cog"] / numbers["base"]
    chosen["servo_load"] = SERVO_LOAD / (front * float(np.mean(TEMPERS[car].side_push)))
    if family.friction == "stribeck":
        chosen["stribeck"] = STRIBECK * EFFECTS["stiction"].smallest[car] * rng.uniform(0.5, 1.0)
    if family.friction == "viscous":
        chosen |= _viscous(car, numbers)
    return chosen


def _tyre(name, slide):
    """Return shape and bend of a tyre's curve of slope 1.5 and peak 1; `slide` is its end."""
    if name == "pacejka":
        shape = 2.0 - 2.0 / math.pi * math.asin(slide)
        stiff = 1.5 / shape
        at_peak = math.tan(0.5 * math.pi / shape)
        return shape, (stiff - at_peak) / (stiff - math.atan(stiff))
    if name == "brush":
        return _sticking(slide), slide
    return 1.5, 0.0


def _sticking(slide):
    """Return the friction where a brush's bristles stick, at which its force has the peak 1."""
    q = np.linspace(0.01, 6.0, 2000)
    low, high = 1.0, 3.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        sticks = np.maximum(1.0 - 0.5 * q / middle, 0.0)
        force = 1.5 * q * sticks**2 + slide * (1.0 - sticks**2 * (3.0 - 2.0 * sticks))
        low, high = (middle, high) if force.max() < 1.0 else (low, middle)
    return middle


def _viscous(car, numbers):
    """Return numbers of a car of whose friction a share grows with the speed, the usual one."""
    spin = float(np.mean(TEMPERS[car].fastest)) * 0.65 / numbers["radius"]
    driven = 1.0 if numbers["front_driven"] > 0.0 else 0.5
    load = 0.25 * numbers["mass"] * GRAVITY
    dry = driven * numbers["coulomb"] + numbers["rolling"] * load * numbers["radius"]
    more = VISCOUS * (dry / spin + driven * numbers["churn"] * spin)
    rest = {name: (1.0 - VISCOUS) * numbers[name] for name in ("coulomb", "rolling", "churn")}
    return {**rest, "damping": numbers["damping"] + more}
