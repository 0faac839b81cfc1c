"""Quadratic losses of a motor and its gear: churning and wind that grow with speed squared.

    wheel_torque += -driven * damping_quadratic * omega * |omega|    [N*m]

Holds: fitted below no-load speed.   Shows in: top speed below the motor line.
Source: fitted to the AutoDRIVE simulator's throttle-speed table.
"""

from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def motor_damping(omega: float, driven: float, damping_quadratic: float) -> float:
    """Torque on the wheel, against its spin [N*m]."""
    return -driven * damping_quadratic * omega * abs(omega)


@kernel_function
def motor_damping_damping(omega: float, driven: float, damping_quadratic: float) -> float:
    """Torque lost per wheel speed, the secant [N*m*s]."""
    return driven * damping_quadratic * abs(omega)


TERM = Term(
    motor_damping,
    per=Per.WHEEL,
    adds="wheel_torque",
    damping=motor_damping_damping,
    passive=True,
    neutral={"damping_quadratic": 0.0},
    shows_in=("top_speed",),
    params=(
        Param("damping_quadratic", 0.0, "N*m*s^2", "drive.damping_quadratic_nms2", (0.0, 0.1),
              "per driven wheel", LogNormal(3e-4, 1.0)),
    ),
)  # fmt: skip
