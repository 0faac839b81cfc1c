"""Vertical tyre contact: a stiff spring with a little damping that can push but never pull.

    load = max(0, rest_load + stiffness * tyre_deflection + contact_damping * its rate)    [N]

A spring rather than a constraint: the wheel may leave the floor and land, and the skeleton is
implicit in it, so even 45 g on 20 kN/m is calm at 1 ms.
Holds: small deflections.   Shows in: bumps, wheel lift.
Source: quarter-car model, any textbook (Jazar, Vehicle Dynamics); stiffness ours.
"""

from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def tyre_contact(
    tyre_deflection: float, tyre_deflection_rate: float, rest_load: float,
    stiffness: float, contact_damping: float,
) -> float:  # fmt: skip
    """Floor on tyre, + up [N]."""
    force = stiffness * tyre_deflection + contact_damping * tyre_deflection_rate
    return max(0.0, rest_load + force)


@kernel_function
def tyre_contact_damping(
    tyre_deflection: float, tyre_deflection_rate: float, rest_load: float,
    stiffness: float, contact_damping: float, dt: float,
) -> float:  # fmt: skip
    """Load lost per speed of the hub upward within a substep; none in the air [N*s/m]."""
    force = stiffness * tyre_deflection + contact_damping * tyre_deflection_rate
    return contact_damping + stiffness * dt if rest_load + force > 0.0 else 0.0


TERM = Term(
    tyre_contact,
    per=Per.WHEEL,
    sets="load",
    damping=tyre_contact_damping,
    shows_in=("bump", "wheel_lift"),
    params=(
        Param("stiffness", 2.0e4, "N/m", "tyre.vertical_stiffness_n_m", (500.0, 5e5),
              "vertical", LogNormal(2e4, 0.7)),
        Param("contact_damping", 10.0, "N*s/m", "tyre.vertical_damping_ns_m", (0.0, 500.0),
              "vertical", LogNormal(10.0, 0.7)),
    ),
)  # fmt: skip
