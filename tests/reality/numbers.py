"""The numbers of a car: read from its nominal file, then scattered as real cars are."""

import re
import tomllib
from pathlib import Path

import numpy as np

TYPES = Path(__file__).parents[2] / "scm" / "vehicles" / "types"
GRAVITY = 9.80665

# What the file says, by the name that the motion knows it by.
KEYS = {
    "mass": "body.mass_kg",
    "inertia": "body.yaw_inertia_kgm2",
    "roll_inertia": "body.roll_inertia_kgm2",
    "pitch_inertia": "body.pitch_inertia_kgm2",
    "base": "body.wheelbase_m",
    "track": "body.track_m",
    "cog": "body.cog_to_rear_axle_m",
    "height": "body.cog_height_m",
    "drag_linear": "body.drag_linear_ns_m",
    "drag_square": "body.drag_quadratic_ns2_m2",
    "drag_turn": "body.drag_angular_nms",
    "spring": "suspension.spring_n_m",
    "damper": "suspension.damper_ns_m",
    "hub": "wheel.mass_kg",
    "radius": "wheel.radius_m",
    "spin_inertia": "wheel.spin_inertia_kgm2",
    "damping": "wheel.damping_linear_nms",
    "rolling": "wheel.rolling_resistance",
    "slip_peak": "tyre.slip_extremum",
    "force_peak": "tyre.force_extremum",
    "slip_slide": "tyre.slip_asymptote",
    "force_slide": "tyre.force_asymptote",
    "side_slip_peak": "tyre.lateral_slip_extremum",
    "side_force_peak": "tyre.lateral_force_extremum",
    "side_slip_slide": "tyre.lateral_slip_asymptote",
    "side_force_slide": "tyre.lateral_force_asymptote",
    "slow": "tyre.low_speed_m_s",
    "front_driven": "drive.front_driven",
    "stall": "drive.stall_torque_nm",
    "no_load": "drive.no_load_speed_rad_s",
    "coulomb": "drive.coulomb_torque_nm",
    "churn": "drive.damping_quadratic_nms2",
    "rotor": "drive.reflected_inertia_kgm2",
    "hold": "drive.hold_torque_nm",
    "limit": "steering.limit_rad",
    "rate": "steering.rate_rad_s",
}
SENSED = {
    "counts": "encoder.counts_per_revolution",
    "accel_noise": "imu.accel_noise_m_s2",
    "gyro_noise": "imu.gyro_noise_rad_s",
}

# What an effect may add, with the value at which it does nothing.
NEUTRAL = {
    "drive_delay": 0.0, "drive_lag": 0.0, "drive_deadband": 0.0, "drive_gain": 1.0,
    "motor_gain": 1.0, "asymmetry": 0.0, "sag": 0.0, "fade": 0.0, "stiction": 0.0,
    "slope": 0.0, "uphill": 0.0, "wind_x": 0.0, "wind_y": 0.0, "corner_drag": 0.0,
    "patch_x": 0.0, "patch_y": 0.0, "patch_radius": 0.01, "patch_grip": 1.0, "patch_rolling": 0.0,
    "trim": 0.0, "steer_gain": 1.0, "stop_left": 1.0, "stop_right": 1.0, "backlash": 0.0,
    "steer_delay": 0.0, "steer_lag": 0.0, "pace": 1.0, "give": 0.0, "understeer": 0.0,
    "stiffness": 1.0, "grip": 1.0, "relaxation": 0.0,
    "gust": 0.0, "gust_period": 5.0, "gust_way": 0.0, "gust_phase": 0.0,
    "side_gain": 0.0, "nap": 0.0, "nap_way": 0.0,
    "tiles": 0.0, "tile_length": 0.5, "tile_way": 0.0, "tile_phase": 0.0,
    "bend_drag": 0.0, "bend_power": 2.0, "ripple": 0.0, "ripple_turns": 2.0, "ripple_phase": 0.0,
    "steer_per_speed": 0.0, "brake_weak": 0.0, "twist_per_speed": 0.0,
    "weave": 0.0, "weave_period": 3.0, "surge": 0.0, "surge_period": 6.0, "cliff_drag": 0.0,
    "cliff_way": 0.0, "cliff_at": 0.0, "shake": 0.0,
    "pace_per_throttle": 0.0, "rising_lag": 0.0, "left_lag": 0.0, "warm_grip": 0.0, "warm_s": 40.0,
    "pull": 0.0, "pull_x": 0.0, "pull_y": 0.0, "half_slope": 0.0, "half_uphill": 0.0,
    "half_way": 0.0, "half_at": 0.0, "swirl": 0.0, "swirl_x": 0.0, "swirl_y": 0.0,
    "swirl_radius": 0.1,
}  # fmt: skip

# Which equations a car has, as places in `family.ASPECTS`, and their own numbers; here the usual.
# `command`: for how long each command is in force [s].
EQUATIONS = {
    "tyre": 0.0, "combined_slip": 0.0, "suspension": 0.0, "motor": 0.0, "servo": 0.0,
    "friction": 0.0, "body": 0.0, "step": 0.00025, "tyre_shape": 1.5, "tyre_bend": 0.0,
    "side_tyre_shape": 1.5, "side_tyre_bend": 0.0, "winding_lag": 0.002, "current_limit": 1.0,
    "servo_lag": 0.01, "servo_load": 0.0, "stribeck": 0.0, "command": 0.05,
}  # fmt: skip

# How far ordinary cars of one type differ, relative standard deviations.
SCATTER = {
    "mass": 0.05, "no_load": 0.004, "cog": 0.02, "slip_peak": 0.08, "slip_slide": 0.08,
    "side_slip_peak": 0.08, "side_slip_slide": 0.08, "stall": 0.04, "damping": 0.08,
}  # fmt: skip
TOGETHER = {"slip_slide": "slip_peak", "side_slip_slide": "side_slip_peak"}


def nominal(car: str) -> dict[str, float]:
    """Return every number of a nominal car, effects at rest, sensors included."""
    data = tomllib.loads((TYPES / f"{car}.toml").read_text(encoding="utf-8"))
    values = {}
    for name, key in {**KEYS, **SENSED}.items():
        section, _, entry = key.partition(".")
        values[name] = float(data[section][entry]["value"])
    return {**values, **NEUTRAL, **EQUATIONS}


def scattered(numbers: dict[str, float], rng: np.random.Generator) -> dict[str, float]:
    """Return the numbers of one of many cars; both ends of a tyre's curve move alike."""
    factors = {name: 1.0 + spread * rng.standard_normal() for name, spread in SCATTER.items()}
    factors |= {name: factors[leader] for name, leader in TOGETHER.items()}
    return {name: value * factors.get(name, 1.0) for name, value in numbers.items()}


def file_of(car: str, stated: dict[str, float | str], terms: dict[str, str]) -> str:
    """Return the text of a nominal car's file that states other values, and terms in place of some.

    Raises:
        ValueError: when the file has no such value.
    """
    text = (TYPES / f"{car}.toml").read_text(encoding="utf-8")
    for term, other in terms.items():
        text = text.replace(f'"{term}"', f'"{other}"', 1)
    for key, value in stated.items():
        section, _, entry = key.partition(".")
        head, name, tail = text.partition(f"[{section}]")
        written = f'"{value}"' if isinstance(value, str) else f"{value:.6g}"
        place = re.compile(rf"^({entry}\s*= {{ value = )[^,]*", re.MULTILINE)
        tail, count = place.subn(rf"\g<1>{written}", tail, count=1)
        if not count:
            msg = f"{car}.toml: no {key}"
            raise ValueError(msg)
        text = head + name + tail
    return text
