"""Holding at zero throttle: idle torque equals the braking torque, a dry brake on driven wheels.

    dry_torque += driven * hold_torque    while |throttle| < hold_below    [N*m]

Holds: motor controllers that short or hold an idle motor.   Shows in: stop after throttle off.
Source: AutoDRIVE paper, actuators (idle torque).
"""

from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def motor_hold(throttle: float, driven: float, hold_torque: float, hold_below: float) -> float:
    """Torque that the idle motor can hold, never negative [N*m]."""
    return driven * hold_torque if abs(throttle) < hold_below else 0.0


TERM = Term(
    motor_hold,
    per=Per.WHEEL,
    adds="dry_torque",
    passive=True,
    neutral={"hold_torque": 0.0},
    shows_in=("throttle_off",),
    params=(
        Param("hold_torque", 0.3, "N*m", "drive.hold_torque_nm", (0.0, 20.0),
              "per driven wheel", LogNormal(0.3, 0.4)),
        Param("hold_below", 0.005, "1", "drive.hold_below_throttle", (1e-6, 0.2),
              "throttle under which the motor idles", fit=False),
    ),
)  # fmt: skip
