"""Battery sag: the supply falls steadily while the car drives.

    supply_voltage = terminal_voltage * max(0, 1 - fraction_per_min * time / 60)    [V]

Rest does not bring it back, unlike `motor_fade`. Torque at stall and no-load speed shrink alike.
Holds: minutes, on the flat part of the discharge curve.   Shows in: the same lap early and late.
Source: first order of a discharge at constant current; definition ours.
"""

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def battery_sag(terminal_voltage: float, time: float, fraction_per_min: float) -> float:
    """Voltage that the motors get [V]."""
    return terminal_voltage * max(0.0, 1.0 - fraction_per_min * time * (1.0 / 60.0))


TERM = Term(
    battery_sag,
    per=Per.BODY,
    sets="supply_voltage",
    neutral={"fraction_per_min": 0.0},
    shows_in=("long_drive",),
    params=(
        Param("fraction_per_min", 0.0, "1/min", "drive.sag_per_min", (0.0, 0.6),
              "share of the voltage lost a minute", LogNormal(0.03, 1.0)),
    ),
    identification=Identification(
        equation="drive", depends_on=("time",), starts=((0.03,), (0.12,)), steps=(0.01,),
        sentence="The drive weakens by {fraction_per_min} a minute, as a battery that runs down.",
        experiments=("cooled",),
        advice="Charge or replace the battery. If it is as it should be, keep the sag in the "
               "simulator.",
    ),
)  # fmt: skip
