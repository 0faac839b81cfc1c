"""Speed control: the throttle asks for a speed, and a controller pushes the car there.

    wheel_torque += share * mass * wheel_radius * clip(error / response_time, -limit, limit)  [N*m]
    error = motor_throttle * full_speed - wheel_radius * axle_omega,  limit = acceleration *
    motor_strength,  share = driven / driven wheels

Fast and strong, it is a given speed: the drive is then not judged, only how the car turns.
Holds: a controller that knows its wheels' speed, not the floor's; no offset left by drag.
Shows in: speed steps.   Source: VESC speed mode as the F1TENTH driver uses it; first order, ours.
"""

from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def speed_control(
    motor_throttle: float, motor_strength: float, axle_omega: float, driven: float,
    front_driven: float, rear_driven: float, mass: float, wheel_radius: float, full_speed: float,
    response_time: float, acceleration: float,
) -> float:  # fmt: skip
    """Torque on the wheel, + forward [N*m]."""
    share = driven / max(2.0 * (front_driven + rear_driven), 1.0)
    limit = acceleration * motor_strength
    wanted = (motor_throttle * full_speed - wheel_radius * axle_omega) / response_time
    return share * mass * wheel_radius * min(max(wanted, -limit), limit)


@kernel_function
def speed_control_damping(
    motor_throttle: float, motor_strength: float, axle_omega: float, driven: float,
    front_driven: float, rear_driven: float, mass: float, wheel_radius: float, full_speed: float,
    response_time: float, acceleration: float,
) -> float:  # fmt: skip
    """Torque lost per own wheel speed, none while the controller gives all it has [N*m*s]."""
    share = driven / max(2.0 * (front_driven + rear_driven), 1.0)
    wanted = (motor_throttle * full_speed - wheel_radius * axle_omega) / response_time
    stiff = 0.5 * share * mass * wheel_radius * wheel_radius / response_time
    return stiff if abs(wanted) < acceleration * motor_strength else 0.0


TERM = Term(
    speed_control,
    per=Per.WHEEL,
    adds="wheel_torque",
    damping=speed_control_damping,
    neutral={"acceleration": 0.0},
    shows_in=("throttle_step", "steady_speed"),
    params=(
        Param("full_speed", 10.0, "m/s", "drive.full_speed_m_s", (0.1, 100.0),
              "speed that a throttle of 1 commands", fit=False),
        Param("response_time", 0.05, "s", "drive.response_time_s", (0.005, 2.0),
              "63 % of a small change of speed", LogNormal(0.05, 0.7)),
        Param("acceleration", 0.0, "m/s^2", "drive.acceleration_m_s2", (0.0, 50.0),
              "most that the motor gives, either way", LogNormal(3.0, 0.7)),
    ),
)  # fmt: skip
