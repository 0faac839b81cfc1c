"""Speed scale: the recorded speed is so many times the true one.

    speed_measured = scale * speed    [m/s]

Holds: one odometer on all wheels, no slip.   Shows in: straight drives, pose against odometer.
Source: rolling without slip; an odometer knows its wheels' radius and gearing only by its settings.
"""

from scm.arrays import Floats
from scm.vehicles.identification import Identification, Line
from scm.vehicles.param import Normal, Param
from scm.vehicles.sensor_fault import SensorFault


def speed_scale(value: Floats, scale: float) -> Floats:
    """Speed that the recording carries [m/s]."""
    return scale * value


SENSOR_FAULT = SensorFault(
    functions={"speed": speed_scale},
    neutral={"scale": 1.0},
    shows_in=("straight",),
    params=(
        Param("scale", 1.0, "1", "measure.speed_scale", (0.2, 5.0),
              "measured over true speed", Normal(1.0, 0.03)),
    ),
    identification=Identification(
        equation="sensor", depends_on=("speed",), starts=((1.03,), (0.97,)), steps=(0.005,),
        needs_odometer=True,
        sentence="The speed sensor shows {scale} of the true speed.",
        advice="Roll the car along a tape measure and set the odometer's wheel radius and gearing.",
        line=Line("speed", "m/s", "odometer error", "m/s", lambda x, v: (v - 1.0) * x),
    ),
)  # fmt: skip
