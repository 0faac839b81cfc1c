"""Payload: load at the centre of gravity that the car file does not know of.

    added_mass += mass    [kg]

The car stands as high as before, its springs carry the load; moments of inertia stay.
Holds: load near the centre of gravity. On a level floor it is the twin of a weak motor: only a
ramp, or a known load added, tells them apart.
Shows in: throttle steps, ramps.   Source: Newton's second law.
"""

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.param import Normal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def payload(mass: float) -> float:
    """Mass beyond the car file's [kg]."""
    return mass


TERM = Term(
    payload,
    per=Per.BODY,
    adds="added_mass",
    neutral={"mass": 0.0},
    shows_in=("throttle_step", "ramp"),
    params=(
        Param("mass", 0.0, "kg", "payload.mass_kg", (-0.1, 20.0),
              "carried beside the car file's mass", Normal(0.0, 1.0), report="mass_kg"),
    ),
    identification=Identification(
        equation="body", depends_on=("acceleration",), starts=((0.3,), (1.0,), (2.5,)),
        steps=(0.1,), bounds={"mass_kg": (0.0, 20.0)}, like="motor_gain",
        sentence="The car carries {mass_kg} more than its file says.",
        advice="Weigh the car as it was driven and correct the car file.",
        own="body.mass_kg",
        why_alike="On a level floor these do the same to the car: no drive there tells them apart.",
    ),
)  # fmt: skip
