"""Bearings: every wheel is slowed in proportion to its spin.

    wheel_torque += -damping_linear * omega    [N*m]

Holds: greased bearings.   Shows in: coast-down, top speed.
Source: AutoDRIVE paper, wheels (wheel rotations are damped).
"""

from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def wheel_damping(omega: float, damping_linear: float) -> float:
    """Torque on the wheel, against its spin [N*m]."""
    return -damping_linear * omega


@kernel_function
def wheel_damping_damping(damping_linear: float) -> float:
    """Torque lost per wheel speed [N*m*s]."""
    return damping_linear


TERM = Term(
    wheel_damping,
    per=Per.WHEEL,
    adds="wheel_torque",
    damping=wheel_damping_damping,
    passive=True,
    neutral={"damping_linear": 0.0},
    shows_in=("coast_down",),
    params=(
        Param("damping_linear", 5e-4, "N*m*s", "wheel.damping_linear_nms", (0.0, 0.2),
              "each wheel", LogNormal(5e-4, 0.7)),
    ),
)  # fmt: skip
