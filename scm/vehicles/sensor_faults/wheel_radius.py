"""Wheel radius: wheels larger than believed turn less for the same way.

    measured = true / scale    (wheel angles, speeds and counts at nominal radius)

`scale` is the true rolling radius over the nominal one. Where the car itself is simulated, its
number `wheel.radius_m` times `scale` shows the same and the drive's change besides.
Holds: all wheels alike, no slip.   Shows in: straight drives, pose against encoders.
Source: rolling without slip; worn, soft or wrong tyres.
"""

from scm.arrays import Floats
from scm.vehicles.identification import Identification, Line
from scm.vehicles.param import Normal, Param
from scm.vehicles.sensor_fault import SensorFault


def wheel_radius(value: Floats, scale: float) -> Floats:
    """Counts, or wheel speed, that the recording carries."""
    return value / scale


SENSOR_FAULT = SensorFault(
    functions={"encoder.*": wheel_radius, "wheel_speed.*": wheel_radius},
    neutral={"scale": 1.0},
    shows_in=("straight",),
    stands_for="wheel.radius_m",
    params=(
        Param("scale", 1.0, "1", "measure.wheel_radius_scale", (0.5, 2.0),
              "true rolling radius over nominal", Normal(1.0, 0.02)),
    ),
    identification=Identification(
        equation="sensor", depends_on=("wheel",), starts=((1.03,), (0.97,)), steps=(0.005,),
        sentence="The wheels roll as if their radius were {scale} of the nominal one.",
        experiments=("other_wheels",),
        advice="Measure how far the car rolls in ten turns of a wheel, and correct the car file.",
        line=Line("speed", "m/s", "wheel speed error", "m/s", lambda x, v: (1.0 / v - 1.0) * x),
    ),
)  # fmt: skip
