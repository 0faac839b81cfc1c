"""Where a law outside the library may act: forces, the wheels' angle, the throttle, a moment."""

import math

from scm.mismatch.discovery.dictionary_effect import Channel, ToNumbers, Values, Written
from scm.mismatch.effect_catalogue import Parameter
from scm.mismatch.findings import Equation
from scm.vehicles.physics_variables import Per

_FORCE = (-200.0, 200.0)


def _amount(name: str, unit: str, step: float, bounds: tuple[float, float]) -> Parameter:
    return Parameter(name, "", unit, bounds, 0.0, step)


def _only(number: str) -> ToNumbers:
    return lambda values: {number: values[0]}


def _over_floor(values: Values) -> dict[str, float]:
    force, toward = values
    return {"world_x_n": force * math.cos(toward), "world_y_n": force * math.sin(toward)}


DRAG = Channel(
    "drive force", "along_n", Equation.BODY, (_amount("force_n", "N", 0.05, _FORCE),),
    _only("drag_n"), "Something brakes the car by {force_n},", "-{force_n} * {g}",
    (Written("adds force_x", ("vx",), "-force_n * g * soft_sign(vx / 0.02)",
             "Force along the body, + forward [N]."),),
)  # fmt: skip
ALONG = Channel(
    "drive force", "along_n", Equation.DRIVE, (_amount("force_n", "N", 0.05, _FORCE),),
    _only("along_n"), "Something pushes the car forward by {force_n},", "{force_n} * {g}",
    (Written("adds force_x", (), "force_n * g", "Force along the body, + forward [N]."),),
)  # fmt: skip
FLOOR = Channel(
    "floor force", "along_n", Equation.BODY,
    (_amount("force_n", "N", 0.05, _FORCE),
     Parameter("toward_rad", "", "rad", (-30.0, 30.0), 0.0, 0.1)),
    _over_floor, "Something pushes the car over the floor by {force_n} towards {toward_rad},",
    "{force_n} towards {toward_rad} * {g}",
    (Written("adds force_x", ("yaw",), "force_n * g * cosine_of(yaw - toward_rad)",
             "Force along the body, + forward [N]."),
     Written("adds force_y", ("yaw",), "force_n * g * sine_of(toward_rad - yaw)",
             "Force across the body, + to its left [N].", "_across")),
)  # fmt: skip
ANGLE = Channel(
    "wheel angle", "turn_rad", Equation.STEERING,
    (_amount("angle_rad", "rad", 0.005, (-1.0, 1.0)),), _only("turn_rad"),
    "The front wheels turn by {angle_rad} that nobody asked for,", "{angle_rad} * {g}",
    (Written("sets steer_trimmed", ("linkage_angle",), "linkage_angle + offset + angle_rad * g",
             "Mean road-wheel angle, + left [rad]."),),
)  # fmt: skip
DEMAND = Channel(
    "wheel angle", "turn_rad", Equation.STEERING,
    (_amount("angle_rad", "rad", 0.005, (-1.0, 1.0)),), _only("demand_rad"),
    "The servo is asked for {angle_rad} that nobody meant,", "{angle_rad} * {g}",
    (Written("sets steer_scaled", ("steer_demand",), "gain * steer_demand + angle_rad * g",
             "Mean road-wheel angle meant, + left [rad]."),),
)  # fmt: skip
STEER_GAIN = Channel(
    "steering gain", "turn_rad", Equation.STEERING, (_amount("gain", "1", 0.02, (-3.0, 3.0)),),
    _only("turn_gain"), "The steering's gain changes by {gain},", "{gain} * wheel angle * {g}",
    (Written("sets steer_trimmed", ("linkage_angle",),
             "linkage_angle * (1.0 + gain * g) + offset", "Mean road-wheel angle, + left [rad]."),),
)  # fmt: skip
THROTTLE = Channel(
    "throttle", "throttle_add", Equation.DRIVE, (_amount("gain", "1", 0.02, (-1.0, 1.0)),),
    _only("throttle_gain"), "The drive changes by a share of {gain},", "{gain} * throttle * {g}",
    (Written("sets throttle_received", ("throttle_command",), "throttle_command * (1.0 + gain * g)",
             "Throttle as it reaches the car, + forward."),),
)  # fmt: skip
TWIST = Channel(
    "yaw moment", "moment_nm", Equation.BODY, (_amount("moment_nm", "N*m", 0.02, (-50.0, 50.0)),),
    _only("moment_nm"), "Something turns the car with {moment_nm},", "{moment_nm} * {g}",
    (Written("adds moment_z", (), "moment_nm * g", "Moment about z [N*m]."),),
)  # fmt: skip
RIPPLE = Channel(
    "drive torque", "ripple_nm", Equation.DRIVE,
    (_amount("torque_nm", "N*m", 0.002, (-10.0, 10.0)),), _only("ripple_nm"),
    "The torque on each driven wheel swings by {torque_nm} as it turns,",
    "{torque_nm} * {g}",
    (Written("adds wheel_torque", ("driven",), "driven * torque_nm * g",
             "Torque on a driven wheel as it turns, + forward [N*m].", per=Per.WHEEL),),
)  # fmt: skip
