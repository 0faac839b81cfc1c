"""Unit error: a channel is in another unit than its label says.

    measured = factor * true

Degrees for radians is 57.296, g for m/s^2 0.10197, km/h for m/s 3.6, millimetres 1000.
Holds: the channels that are named.   Shows in: any drive.
Source: definition; the factor of a mere scale fault lies near 1, that of a unit never.
"""

from scm.arrays import Floats
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.sensor_fault import SensorFault


def unit_error(value: Floats, factor: float) -> Floats:
    """Value that the recording carries."""
    return factor * value


SENSOR_FAULT = SensorFault(
    functions={"*": unit_error},
    neutral={"factor": 1.0},
    shows_in=("any",),
    acts_on=(),
    params=(
        Param("factor", 1.0, "1", "measure.unit_factor", (-1e4, 1e4),
              "recorded over true", LogNormal(1.0, 3.0)),
    ),
)  # fmt: skip
