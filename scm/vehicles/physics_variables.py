"""The variables of the physics: every name that an effect may use, with unit, frame and sign.

ISO 8855: x forward, y left, z up; angles counter-clockwise. The body frame is the yaw frame at the
centre of gravity: it turns with yaw, but stays level. SI throughout. Wheels: front-left,
front-right, rear-left, rear-right.
"""

from dataclasses import dataclass
from enum import Enum


class Per(Enum):
    """Whether a variable or an effect exists per car or per wheel."""

    BODY = "body"
    WHEEL = "wheel"


class Role(Enum):
    """Where a variable gets its value."""

    INPUT = "input"  # from outside, constant during a call
    GIVEN = "given"  # the 14-degree-of-freedom skeleton
    CHAIN = "chain"  # one term sets it; without one it equals `otherwise`
    SUM = "sum"  # starts at 0 each substep, any number of terms add to it
    SHAPE = "shape"  # a sum over numbers of the car alone, computed once per call


@dataclass(frozen=True, slots=True)
class Variable:
    """One variable.

    Attributes:
        span: Physical range for tests.
        otherwise: Value of a chain variable that no term sets: another variable, or a number.
        starts_at: Initial value of a state when a car is placed: its "steer" angle or "throttle".
    """

    name: str
    unit: str
    per: Per
    role: Role
    about: str
    span: tuple[float, float] = (-10.0, 10.0)
    otherwise: str | None = None
    starts_at: str = ""


def _body(name: str, unit: str, role: Role, about: str, **more: object) -> Variable:
    return Variable(name, unit, Per.BODY, role, about, **more)  # type: ignore[arg-type]


def _command(name: str, about: str, otherwise: str, starts_at: str = "") -> Variable:
    """Return a command on its way to a motor or the servo, -1 to 1."""
    return Variable(
        name, "1", Per.BODY, Role.CHAIN, about, (-1.0, 1.0), otherwise, starts_at=starts_at
    )


def _wheel(name: str, unit: str, role: Role, about: str, **more: object) -> Variable:
    return Variable(name, unit, Per.WHEEL, role, about, **more)  # type: ignore[arg-type]


_ALL = (
    _body("dt", "s", Role.INPUT, "length of a substep", span=(1e-4, 2e-3)),
    _body("throttle_command", "1", Role.INPUT, "asked for, + forward", span=(-1.0, 1.0)),
    _body("steering_command", "1", Role.INPUT, "asked for, + left", span=(-1.0, 1.0)),
    _body("battery", "V", Role.INPUT, "battery voltage", span=(6.0, 13.0)),
    _body("throttle_past", "1", Role.INPUT, "asked for `drive.delay_s` ago", span=(-1.0, 1.0)),
    _body("steering_past", "1", Role.INPUT, "asked for `steering.delay_s` ago", span=(-1.0, 1.0)),
    _body("air_x", "m/s", Role.INPUT, "wind velocity, world x", span=(-8.0, 8.0)),
    _body("air_y", "m/s", Role.INPUT, "wind velocity, world y", span=(-8.0, 8.0)),
    _body("x_cog", "m", Role.GIVEN, "centre of gravity in the world"),
    _body("y_cog", "m", Role.GIVEN, "centre of gravity in the world"),
    _body("z_cog", "m", Role.GIVEN, "body above floor zero, cog_height at rest", span=(0.0, 0.2)),
    _body("roll", "rad", Role.GIVEN, "+ left side up", span=(-0.3, 0.3)),
    _body("pitch", "rad", Role.GIVEN, "+ nose down", span=(-0.3, 0.3)),
    _body("yaw", "rad", Role.GIVEN, "counter-clockwise from world x", span=(-3.14, 3.14)),
    _body("cos_yaw", "1", Role.GIVEN, "of the heading", span=(-1.0, 1.0)),
    _body("sin_yaw", "1", Role.GIVEN, "of the heading", span=(-1.0, 1.0)),
    _body("time", "s", Role.GIVEN, "since the car was placed", span=(0.0, 1e4)),
    _body("accel_x", "m/s^2", Role.GIVEN, "of the last substep, body x", span=(-20.0, 20.0)),
    _body("accel_y", "m/s^2", Role.GIVEN, "of the last substep, body y", span=(-20.0, 20.0)),
    _body("vx", "m/s", Role.GIVEN, "velocity of the centre of gravity, body x", span=(-5.0, 5.0)),
    _body("vy", "m/s", Role.GIVEN, "velocity of the centre of gravity, body y", span=(-3.0, 3.0)),
    _body("vz", "m/s", Role.GIVEN, "velocity of the sprung mass, up", span=(-1.0, 1.0)),
    _body("roll_rate", "rad/s", Role.GIVEN, "about body x"),
    _body("pitch_rate", "rad/s", Role.GIVEN, "about body y"),
    _body("yaw_rate", "rad/s", Role.GIVEN, "about z"),
    _body("yaw_accel", "rad/s^2", Role.GIVEN, "about z, last substep", span=(-50.0, 50.0)),
    _body("drive_omega", "rad/s", Role.GIVEN, "mean spin of the driven wheels", span=(-90.0, 90.0)),
    # the throttle's way: command, radio, dead-band, gain, lag
    _command("throttle_received", "command after its way to the car", "throttle_command"),
    _command("throttle_limited", "command within the drive's limits", "throttle_received"),
    _command("throttle_live", "command beyond the dead-band", "throttle_limited"),
    _command("throttle_eased", "command after a soft start", "throttle_live", starts_at="throttle"),
    _command("throttle_curved", "command after the controller's curve", "throttle_eased"),
    _command("throttle_scaled", "command as strong as the controller takes it", "throttle_curved"),
    _command(
        "throttle",
        "what the motor controller gives, + forward",
        "throttle_scaled",
        starts_at="throttle",
    ),
    _command("throttle_memory", "mean command of late, which fades", "0.0"),
    _body(
        "learned_shape",
        "1",
        Role.CHAIN,
        "a learned law's shape over what it depends on",
        otherwise="0.0",
    ),
    # the battery: charge drawn, voltage without and with load, ageing within a drive
    _body(
        "charge_drawn",
        "A*s",
        Role.CHAIN,
        "taken from the battery since the car was placed",
        span=(0.0, 2e4),
        otherwise="0.0",
    ),
    _body(
        "open_circuit_voltage",
        "V",
        Role.CHAIN,
        "of the battery without load",
        span=(6.0, 13.0),
        otherwise="battery",
    ),
    _body(
        "terminal_voltage",
        "V",
        Role.CHAIN,
        "of the battery under load",
        span=(6.0, 13.0),
        otherwise="open_circuit_voltage",
    ),
    _body(
        "supply_voltage",
        "V",
        Role.CHAIN,
        "what the motors get",
        span=(6.0, 13.0),
        otherwise="terminal_voltage",
    ),
    # the steering's way: command, radio, end stops, angle, gain, lag, servo, play, trim, give
    _command("steering_received", "command after its way to the car, + left", "steering_command"),
    _command("steering", "command within the steering's end stops, + left", "steering_received"),
    _body(
        "steer_demand",
        "rad",
        Role.CHAIN,
        "mean road-wheel angle the command means, + left",
        span=(-0.6, 0.6),
        otherwise="steering",
    ),
    _body(
        "steer_scaled",
        "rad",
        Role.CHAIN,
        "angle meant, as the linkage scales it, + left",
        span=(-0.6, 0.6),
        otherwise="steer_demand",
    ),
    _body(
        "steer_target",
        "rad",
        Role.CHAIN,
        "angle the servo is asked for, + left",
        span=(-0.6, 0.6),
        otherwise="steer_scaled",
        starts_at="steer",
    ),
    _body(
        "servo_load_pace",
        "1",
        Role.CHAIN,
        "servo speed that the load on the wheels leaves, over its free speed",
        span=(0.05, 1.0),
        otherwise="1.0",
    ),
    _body(
        "servo_pace",
        "1",
        Role.CHAIN,
        "servo speed over the nominal one",
        span=(0.05, 2.0),
        otherwise="servo_load_pace",
    ),
    _body(
        "servo_angle",
        "rad",
        Role.CHAIN,
        "road-wheel angle that the servo holds, + left",
        span=(-0.6, 0.6),
        otherwise="steer_target",
        starts_at="steer",
    ),
    _body(
        "linkage_angle",
        "rad",
        Role.CHAIN,
        "road-wheel angle behind the linkage's play, + left",
        span=(-0.6, 0.6),
        otherwise="servo_angle",
        starts_at="steer",
    ),
    _body(
        "steer_trimmed",
        "rad",
        Role.CHAIN,
        "road-wheel angle with the linkage's misalignment, + left",
        span=(-0.6, 0.6),
        otherwise="linkage_angle",
    ),
    _body(
        "steer_yielded",
        "rad",
        Role.CHAIN,
        "angle that the front wheels have given way, + right",
        span=(-0.6, 0.6),
        otherwise="0.0",
    ),
    _body(
        "steer_angle",
        "rad",
        Role.CHAIN,
        "mean road-wheel angle, + left",
        span=(-0.6, 0.6),
        otherwise="steer_trimmed",
        starts_at="steer",
    ),
    _body(
        "road_angle",
        "rad",
        Role.CHAIN,
        "mean angle at which the front wheels meet the floor, + left",
        span=(-0.6, 0.6),
        otherwise="steer_angle",
    ),
    _body("road_slope", "1", Role.GIVEN, "tangent of road_angle, to 1.2 rad", span=(-1.0, 1.0)),
    _body("steer_before", "rad", Role.GIVEN, "steer_angle of the last substep", span=(-0.6, 0.6)),
    _body("added_mass", "kg", Role.SHAPE, "beyond the car file's mass", span=(-1.0, 5.0)),
    _body("added_cog_x", "m", Role.SHAPE, "centre of gravity, + forward", span=(-0.05, 0.05)),
    _body("added_cog_z", "m", Role.SHAPE, "centre of gravity, + up", span=(-0.05, 0.05)),
    _body("force_x", "N", Role.SUM, "on the body at the centre of gravity, body x"),
    _body("force_y", "N", Role.SUM, "on the body at the centre of gravity, body y"),
    _body("moment_z", "N*m", Role.SUM, "on the body about z"),
    _wheel("floor_height", "m", Role.INPUT, "under the wheel", span=(-0.5, 0.5)),
    _wheel("floor_slope_x", "1", Role.INPUT, "rise of the floor along world x", span=(-0.5, 0.5)),
    _wheel("floor_slope_y", "1", Role.INPUT, "rise of the floor along world y", span=(-0.5, 0.5)),
    _wheel("floor_grip", "1", Role.INPUT, "factor on tyre friction, 1 neutral", span=(0.05, 1.5)),
    _wheel("floor_rolling", "1", Role.INPUT, "added to the rolling coefficient", span=(0.0, 0.2)),
    _wheel("x_wheel", "m", Role.GIVEN, "contact point in the world"),
    _wheel("y_wheel", "m", Role.GIVEN, "contact point in the world"),
    _wheel("front", "1", Role.GIVEN, "1 on the front axle, 0 on the rear", span=(0.0, 1.0)),
    _wheel("side", "1", Role.GIVEN, "+1 left, -1 right", span=(-1.0, 1.0)),
    _wheel("driven", "1", Role.GIVEN, "1 where a motor turns the wheel, else 0", span=(0.0, 1.0)),
    _wheel("omega", "rad/s", Role.GIVEN, "wheel spin, + rolling forward", span=(-90.0, 90.0)),
    _wheel("wheel_angle", "rad", Role.GIVEN, "turned since the car was placed", span=(-1e4, 1e4)),
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
        "motor_throttle",
        "1",
        Role.CHAIN,
        "what this wheel's motor is given, + forward",
        span=(-1.0, 1.0),
        otherwise="throttle",
    ),
    _wheel(
        "motor_heat",
        "K",
        Role.CHAIN,
        "this wheel's motor above the air around it",
        span=(0.0, 150.0),
        otherwise="0.0",
    ),
    _wheel(
        "fade_strength",
        "1",
        Role.CHAIN,
        "drive that is left of a motor that fades",
        span=(0.3, 1.0),
        otherwise="1.0",
    ),
    _wheel(
        "warm_strength",
        "1",
        Role.CHAIN,
        "torque that a warm winding leaves, over a cold one's",
        span=(0.3, 1.0),
        otherwise="1.0",
    ),
    _wheel(
        "motor_strength",
        "1",
        Role.CHAIN,
        "torque of this wheel's motor over its nominal one",
        span=(0.3, 2.0),
        otherwise="warm_strength",
    ),
    _wheel(
        "wheel_slope",
        "1",
        Role.CHAIN,
        "tangent of this wheel's angle to the body, + left",
        span=(-1.0, 1.0),
        otherwise="road_slope",
    ),
    _wheel("slope_before", "1", Role.GIVEN, "wheel_slope of the last substep", span=(-1.0, 1.0)),
    _wheel("load", "N", Role.CHAIN, "floor on tyre, + up, never negative", span=(0.0, 40.0)),
    _wheel(
        "grip_load",
        "N",
        Role.CHAIN,
        "load that the tyre's friction works with",
        span=(0.0, 40.0),
        otherwise="load",
    ),
    _wheel(
        "grip_here",
        "1",
        Role.CHAIN,
        "factor of this spot of floor on the tyre's friction",
        span=(0.05, 2.0),
        otherwise="floor_grip",
    ),
    _wheel(
        "grip",
        "1",
        Role.CHAIN,
        "factor of floor and tyre on the tyre's friction",
        span=(0.05, 2.0),
        otherwise="grip_here",
    ),
    _wheel(
        "rolling",
        "1",
        Role.CHAIN,
        "what this spot of floor adds to the coefficient of rolling resistance",
        span=(0.0, 0.2),
        otherwise="floor_rolling",
    ),
    _wheel(
        "slip_scale",
        "1",
        Role.CHAIN,
        "factor on side slip before the tyre's curve",
        span=(0.2, 3.0),
        otherwise="1.0",
    ),
    # what a tyre remembers: the slip its contact patch still carries, and how fast it forgets
    _wheel(
        "side_lag",
        "1",
        Role.CHAIN,
        "side slip that the contact patch carries, + sliding left",
        span=(-1.0, 1.0),
        otherwise="0.0",
    ),
    _wheel(
        "side_lag_speed",
        "m/s",
        Role.CHAIN,
        "relaxation length over the substep: how much of that slip stays",
        span=(0.0, 1e3),
        otherwise="0.0",
    ),
    _wheel(
        "spin_lag",
        "1",
        Role.CHAIN,
        "spin slip that the contact patch carries, + driving",
        span=(-1.0, 1.0),
        otherwise="0.0",
    ),
    _wheel(
        "spin_lag_speed",
        "m/s",
        Role.CHAIN,
        "relaxation length over the substep: how much of that slip stays",
        span=(0.0, 1e3),
        otherwise="0.0",
    ),
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

VARIABLES: dict[str, Variable] = {variable.name: variable for variable in _ALL}

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
