"""The vocabulary of the physics: every signal a law may name, its unit, frame and sign, once.

ISO 8855: x forward, y left, z up; angles counter-clockwise. The body frame is the yaw frame at the
centre of gravity: it turns with yaw, but stays level. SI throughout. Wheels: front-left,
front-right, rear-left, rear-right.
"""

from dataclasses import dataclass
from enum import Enum


class Per(Enum):
    """Whether a signal or an effect exists once a car or once a wheel."""

    BODY = "body"
    WHEEL = "wheel"


class Role(Enum):
    """Who gives a signal its value."""

    INPUT = "input"  # from outside, constant during a call
    GIVEN = "given"  # the 14-degree-of-freedom skeleton
    CHAIN = "chain"  # one term sets it; without one it passes on the signal `otherwise`
    SUM = "sum"  # starts at 0 each substep, any number of terms add to it


@dataclass(frozen=True, slots=True)
class Signal:
    """One name of the vocabulary; `span` is the physical range that tests draw from."""

    name: str
    unit: str
    per: Per
    role: Role
    about: str
    span: tuple[float, float] = (-10.0, 10.0)
    otherwise: str | None = None


def _body(name: str, unit: str, role: Role, about: str, **more: object) -> Signal:
    return Signal(name, unit, Per.BODY, role, about, **more)  # type: ignore[arg-type]


def _wheel(name: str, unit: str, role: Role, about: str, **more: object) -> Signal:
    return Signal(name, unit, Per.WHEEL, role, about, **more)  # type: ignore[arg-type]


_ALL = (
    _body("dt", "s", Role.INPUT, "length of a substep", span=(1e-4, 2e-3)),
    _body("throttle_command", "1", Role.INPUT, "asked for, + forward", span=(-1.0, 1.0)),
    _body("steering_command", "1", Role.INPUT, "asked for, + left", span=(-1.0, 1.0)),
    _body("battery", "V", Role.INPUT, "battery voltage", span=(6.0, 13.0)),
    _body("x_cog", "m", Role.GIVEN, "centre of gravity in the world"),
    _body("y_cog", "m", Role.GIVEN, "centre of gravity in the world"),
    _body("z_cog", "m", Role.GIVEN, "centre of gravity above the floor's zero", span=(0.0, 0.2)),
    _body("roll", "rad", Role.GIVEN, "+ left side up", span=(-0.3, 0.3)),
    _body("pitch", "rad", Role.GIVEN, "+ nose down", span=(-0.3, 0.3)),
    _body("yaw", "rad", Role.GIVEN, "counter-clockwise from world x", span=(-3.14, 3.14)),
    _body("vx", "m/s", Role.GIVEN, "velocity of the centre of gravity, body x", span=(-5.0, 5.0)),
    _body("vy", "m/s", Role.GIVEN, "velocity of the centre of gravity, body y", span=(-3.0, 3.0)),
    _body("vz", "m/s", Role.GIVEN, "velocity of the centre of gravity, up", span=(-1.0, 1.0)),
    _body("roll_rate", "rad/s", Role.GIVEN, "about body x"),
    _body("pitch_rate", "rad/s", Role.GIVEN, "about body y"),
    _body("yaw_rate", "rad/s", Role.GIVEN, "about z"),
    _body(
        "throttle_received",
        "1",
        Role.CHAIN,
        "command after its way to the car",
        span=(-1.0, 1.0),
        otherwise="throttle_command",
    ),
    _body(
        "throttle",
        "1",
        Role.CHAIN,
        "what the motor controller gives, + forward",
        span=(-1.0, 1.0),
        otherwise="throttle_received",
    ),
    _body(
        "steering",
        "1",
        Role.CHAIN,
        "command after its way to the car, + left",
        span=(-1.0, 1.0),
        otherwise="steering_command",
    ),
    _body(
        "steer_demand",
        "rad",
        Role.CHAIN,
        "mean road-wheel angle the command means, + left",
        span=(-0.6, 0.6),
        otherwise="steering",
    ),
    _body(
        "steer_target",
        "rad",
        Role.CHAIN,
        "angle the servo is asked for, + left",
        span=(-0.6, 0.6),
        otherwise="steer_demand",
    ),
    _body(
        "steer_angle",
        "rad",
        Role.CHAIN,
        "mean road-wheel angle, + left",
        span=(-0.6, 0.6),
        otherwise="steer_target",
    ),
    _body("force_x", "N", Role.SUM, "on the body at the centre of gravity, body x"),
    _body("force_y", "N", Role.SUM, "on the body at the centre of gravity, body y"),
    _body("moment_z", "N*m", Role.SUM, "on the body about z"),
    _wheel("front", "1", Role.GIVEN, "1 on the front axle, 0 on the rear", span=(0.0, 1.0)),
    _wheel("side", "1", Role.GIVEN, "+1 left, -1 right", span=(-1.0, 1.0)),
    _wheel("driven", "1", Role.GIVEN, "1 where a motor turns the wheel, else 0", span=(0.0, 1.0)),
    _wheel("omega", "rad/s", Role.GIVEN, "wheel spin, + rolling forward", span=(-90.0, 90.0)),
    _wheel("axle_omega", "rad/s", Role.GIVEN, "mean spin of this wheel's axle", span=(-90.0, 90.0)),
    _wheel(
        "v_long",
        "m/s",
        Role.GIVEN,
        "contact point over the floor, along the wheel",
        span=(-5.0, 5.0),
    ),
    _wheel(
        "v_lat",
        "m/s",
        Role.GIVEN,
        "contact point over the floor, + to the wheel's left",
        span=(-3.0, 3.0),
    ),
    _wheel(
        "compression",
        "m",
        Role.GIVEN,
        "spring, from rest, at the substep's end if the present rate holds",
        span=(-0.02, 0.02),
    ),
    _wheel("compression_rate", "m/s", Role.GIVEN, "of the spring", span=(-1.0, 1.0)),
    _wheel(
        "tyre_deflection",
        "m",
        Role.GIVEN,
        "tyre, from rest, at the substep's end if the present rate holds",
        span=(-0.005, 0.005),
    ),
    _wheel("tyre_deflection_rate", "m/s", Role.GIVEN, "of the tyre", span=(-1.0, 1.0)),
    _wheel(
        "rest_spring_force",
        "N",
        Role.GIVEN,
        "sprung weight on this corner at rest",
        span=(0.5, 20.0),
    ),
    _wheel("rest_load", "N", Role.GIVEN, "whole weight on this wheel at rest", span=(0.5, 20.0)),
    _wheel(
        "wheel_steer",
        "rad",
        Role.CHAIN,
        "angle of this wheel to the body, + left",
        span=(-0.8, 0.8),
        otherwise="steer_angle",
    ),
    _wheel("load", "N", Role.CHAIN, "floor on tyre, + up, never negative", span=(0.0, 40.0)),
    _wheel("suspension_force", "N", Role.SUM, "spring and damper on the body, + up"),
    _wheel("tyre_x", "N", Role.SUM, "floor on tyre, along the wheel"),
    _wheel("tyre_y", "N", Role.SUM, "floor on tyre, + to the wheel's left"),
    _wheel("wheel_torque", "N*m", Role.SUM, "about the wheel's axis, + forward"),
    _wheel(
        "dry_torque",
        "N*m",
        Role.SUM,
        "most that dry friction can hold; it stops a wheel and never turns one",
    ),
    _wheel("extra_inertia", "kg*m^2", Role.SUM, "turns with the wheel, beside the wheel itself"),
)

SIGNALS: dict[str, Signal] = {signal.name: signal for signal in _ALL}

# What a term that `damps` is implicit in: its target falls by the damping times this rate.
DAMPED_BY: dict[str, str] = {
    "force_x": "vx",
    "force_y": "vy",
    "moment_z": "yaw_rate",
    "suspension_force": "minus the compression rate",
    "load": "minus the tyre's deflection rate",
    "tyre_x": "minus the slip speed r * omega - v_long",
    "tyre_y": "v_lat",
    "wheel_torque": "omega",
}
