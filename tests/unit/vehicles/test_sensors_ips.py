"""The IPS reads the tag's own place: turned with the car, and moved by its lean."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from scm.vehicles.car import load_car
from scm.vehicles.sensors.ips import SENSOR

NIGEL = load_car("nigel")
TAG = np.array(NIGEL.vector("ips.position_m"))


def read(x=0.0, y=0.0, yaw=0.0, roll=0.0, pitch=0.0):
    state = {"x": x, "y": y, "yaw": yaw, "roll": roll, "pitch": pitch}
    truth = SimpleNamespace(**{name: np.array([value]) for name, value in state.items()})
    return SENSOR.measure(NIGEL, truth, np.array([0]), None)[0]


def test_it_reads_the_tag_and_not_the_rear_axle():
    assert_allclose(read(x=1.0, y=2.0, yaw=np.pi / 2), [1.0, 2.0 + TAG[0], np.pi / 2])


@pytest.mark.parametrize("tilt", [(0.1, 0.0), (0.0, 0.1), (-0.2, 0.15)])
def test_a_leaning_body_carries_the_tag_with_it(tilt):
    roll, pitch = tilt
    x, y, _ = Rotation.from_euler("ZYX", [0.7, pitch, roll]).apply(TAG)
    assert_allclose(read(1.0, -1.0, 0.7, roll, pitch), [1.0 + x, -1.0 + y, 0.7])
