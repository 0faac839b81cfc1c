"""Com shift: the centre of gravity lies elsewhere along the car than its file says.

    added_cog_x += shift    [m]

Moves load between the axles and the lever arms of their side forces; yaw inertia stays.
Holds: while the centre of gravity stays between the axles.
Shows in: fast circles, steering steps at speed.
Source: Gillespie, Fundamentals of Vehicle Dynamics (1992), chapter 6.
"""

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.param import Normal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def com_shift(shift: float) -> float:
    """Centre of gravity ahead of where the car file puts it [m]."""
    return shift


TERM = Term(
    com_shift,
    per=Per.BODY,
    adds="added_cog_x",
    neutral={"shift": 0.0},
    shows_in=("fast_circle", "steering_step"),
    params=(
        Param("shift", 0.0, "m", "com_shift.shift_m", (-0.4, 0.4),
              "+ forward", Normal(0.0, 0.02), report="shift_m"),
    ),
    identification=Identification(
        equation="body", depends_on=("lateral acceleration",),
        starts=((0.015,), (-0.015,), (0.05,), (-0.05,)), steps=(0.005,), needs_m_s2=1.0,
        also_moves={"measure.pose_point_x_m": 1.0},
        sentence="The centre of gravity lies {shift_m} further forward than the file says.",
        advice="Weigh front and rear axle apart and correct the car file. Look for a battery that"
               " slid.",
        own="body.cog_to_rear_axle_m",
        turns=True,
    ),
)  # fmt: skip
