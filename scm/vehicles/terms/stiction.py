"""Stiction: dry friction of motor and gear that is there at rest and fades as the wheel turns.

    dry_torque += driven * torque * exp(-(omega / fade_speed)^2)    [N*m]

Holds: Stribeck's falling branch, beside `coulomb_friction` that stays.   Shows in: crawling,
throttle ramps from rest.   Source: Armstrong-Helouvry, Control of Machines with Friction (1991).
"""

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.lane_math import exp_neg
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def stiction(omega: float, driven: float, torque: float, fade_speed: float) -> float:
    """Torque that dry friction can hold, never negative [N*m]."""
    turn = omega * (1.0 / fade_speed)
    return driven * torque * exp_neg(turn * turn)


TERM = Term(
    stiction,
    per=Per.WHEEL,
    adds="dry_torque",
    passive=True,
    neutral={"torque": 0.0},
    shows_in=("throttle_ramp", "crawl"),
    params=(
        Param("torque", 0.0, "N*m", "drive.stiction_torque_nm", (0.0, 5.0),
              "at rest, per driven wheel", LogNormal(0.03, 0.8), report="torque_nm"),
        Param("fade_speed", 0.6, "rad/s", "drive.stiction_fade_rad_s", (0.01, 50.0),
              "wheel speed where a third is left", fit=False),
    ),
    identification=Identification(
        equation="drive", depends_on=("speed",), starts=((0.02,), (0.06,), (0.15,)), steps=(0.01,),
        sentence="Near standstill the driven wheels stick with {torque_nm} more than the model "
                 "knows.",
        advice="Push the car from rest by hand: look for a dry gear or a bearing that sticks.",
    ),
)  # fmt: skip
