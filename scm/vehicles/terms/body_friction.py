"""Friction of the whole drive line, seen as a force on the body.

    force_x += -sign(vx) * max(0, a tanh(b |vx|) + c |vx| + d vx^2)    [N]

Holds: fitted up to 3 m/s; beyond, a negative d may bring it to zero but never to a push.
Shows in: coast-down.   Source: Lorenzo-Lyons/DART, vehicle model (rolling friction).
"""

import math

from scm.vehicles.jit import kernel_function
from scm.vehicles.lane_math import tanh
from scm.vehicles.param import LogNormal, Normal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def body_friction(
    vx: float, static: float, sharpness: float, linear: float, quadratic: float
) -> float:
    """Force against the motion [N]."""
    size = abs(vx)
    force = static * tanh(sharpness * size) + linear * size + quadratic * size * size
    return -math.copysign(max(0.0, force), vx)


@kernel_function
def body_friction_damping(
    vx: float, static: float, sharpness: float, linear: float, quadratic: float
) -> float:
    """Force lost per speed, the secant: it never pushes a car back [N*s/m]."""
    size = abs(vx)
    near_rest = sharpness if size < 1e-9 else tanh(sharpness * size) / max(size, 1e-9)
    return max(0.0, static * near_rest + linear + quadratic * size)


TERM = Term(
    body_friction,
    per=Per.BODY,
    adds="force_x",
    damping=body_friction_damping,
    passive=True,
    neutral={"static": 0.0, "linear": 0.0, "quadratic": 0.0},
    shows_in=("coast_down",),
    params=(
        Param("static", 1.266, "N", "body.friction_static_n", (0.0, 50.0),
              "a: force of slow rolling", LogNormal(1.2, 0.5)),
        Param("sharpness", 7.67, "s/m", "body.friction_sharpness_s_m", (0.5, 100.0),
              "b: how suddenly it sets in", LogNormal(7.0, 0.5)),
        Param("linear", 0.739, "N*s/m", "body.friction_linear_ns_m", (0.0, 20.0),
              "c: grows with speed", LogNormal(0.7, 0.5)),
        Param("quadratic", -0.112, "N*s^2/m^2", "body.friction_quadratic_ns2_m2", (-1.0, 5.0),
              "d: grows with speed squared", Normal(0.0, 0.2)),
    ),
)  # fmt: skip
