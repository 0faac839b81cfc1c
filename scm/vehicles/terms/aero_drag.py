"""Air drag on the body, against its forward motion.

    force_x += -coefficient * vx * |vx|    [N]

Holds: above walking pace.   Shows in: fast coast-down.
Source: Gillespie, Fundamentals of Vehicle Dynamics (1992), chapter 4; coefficient is rho c_d A / 2.
"""

from scm.vehicles.jit import law
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@law
def aero_drag(vx: float, coefficient: float) -> float:
    """Force against the motion [N]."""
    return -coefficient * vx * abs(vx)


@law
def aero_drag_damping(vx: float, coefficient: float) -> float:
    """Force lost per speed, the secant [N*s/m]."""
    return coefficient * abs(vx)


TERM = Term(
    aero_drag,
    per=Per.BODY,
    adds="force_x",
    damping=aero_drag_damping,
    passive=True,
    neutral={"coefficient": 0.0},
    shows_in=("coast_down",),
    params=(
        Param("coefficient", 0.0, "N*s^2/m^2", "body.drag_quadratic_ns2_m2", (0.0, 5.0),
              "force over speed squared", LogNormal(0.01, 1.0)),
    ),
)  # fmt: skip
