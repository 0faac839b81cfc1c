"""Motor warmth: copper conducts worse when it is warm, so torque falls with temperature.

    warm_strength = 1 / (1 + weakening * motor_heat)

Holds: brushed motor at given voltage; magnets' own loss adds 0.001 to 0.002 to copper's 0.0039.
Shows in: long drives, with `motor_heating`.   Source: copper, IEC 60028.
"""

from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def motor_warmth(motor_heat: float, weakening: float) -> float:
    """Torque of the warm motor over its nominal one."""
    return 1.0 / (1.0 + weakening * max(motor_heat, 0.0))


TERM = Term(
    motor_warmth,
    per=Per.WHEEL,
    sets="warm_strength",
    neutral={"weakening": 0.0},
    shows_in=("long_drive", "rest_and_repeat"),
    params=(
        Param("weakening", 0.0039, "1/K", "motor.weakening_per_k", (0.0, 0.05),
              "torque lost per kelvin", LogNormal(0.0045, 0.3)),
    ),
)  # fmt: skip
