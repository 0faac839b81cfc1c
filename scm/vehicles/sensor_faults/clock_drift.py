"""Clock drift: the clock of the poses runs faster or slower than the car's.

    t_measured = t + rate * (t - start)    [s]

Holds: clocks that agree at the recording's start.   Shows in: long drives with steps to the end.
Source: crystal tolerance is 1e-4; interpolating drivers and virtual machines reach 1e-2. + is fast.
"""

from scm.arrays import Floats
from scm.vehicles.identification import Identification, Line
from scm.vehicles.param import Normal, Param
from scm.vehicles.sensor_fault import SensorFault


def clock_drift(t: Floats, start: float, rate: float) -> Floats:
    """Stamp that the recording carries [s]."""
    return t + rate * (t - start)


SENSOR_FAULT = SensorFault(
    functions={"*": clock_drift},
    stamps=True,
    neutral={"rate": 0.0},
    shows_in=("long_drive",),
    acts_on=("pose.*",),
    params=(
        Param("rate", 0.0, "1", "measure.clock_rate", (-0.1, 0.1),
              "seconds gained a second", Normal(0.0, 0.003)),
    ),
    identification=Identification(
        equation="sensor", depends_on=("time",), starts=((0.003,), (-0.003,)), steps=(0.0005,),
        shared="camera",
        sentence="The camera's clock runs fast by {rate}.",
        advice="Let both computers take their time from one clock (NTP or PTP).",
        line=Line("time", "s", "clock ahead", "s", lambda x, v: v * (x - x[0])),
    ),
)  # fmt: skip
