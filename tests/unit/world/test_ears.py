"""Heard cars are carried straight on from their CAM, and forgotten when they fall silent."""

import pytest

from scm.clock import NS_PER_MS
from scm.v2x.etsi_convert import CamView
from scm.world.ears import FORGOTTEN_NS, Ears, heard

NORTH = CamView(
    station_id=1, x_m=1.0, y_m=2.0, yaw_rad=1.5707963267948966, speed_mps=0.2,
    yaw_rate_radps=0.0, length_m=0.3, width_m=0.175,
)  # fmt: skip


def test_an_other_stands_half_a_length_behind_its_front_bumper():
    ears = Ears()
    ears.hear("n2", heard(NORTH, 0))
    (other,) = ears.others(0)
    assert (other.x, other.y) == pytest.approx((1.0, 1.85))


def test_an_other_goes_on_at_its_speed_since_its_cam():
    ears = Ears()
    ears.hear("n2", heard(NORTH, 0))
    (other,) = ears.others(500 * NS_PER_MS)
    assert (other.x, other.y) == pytest.approx((1.0, 1.95))


def test_the_newest_cam_of_a_station_counts():
    ears = Ears()
    ears.hear("n2", heard(NORTH, 0))
    ears.hear("n2", heard(NORTH._replace(x_m=5.0), 1))
    assert [other.x for other in ears.others(1)] == pytest.approx([5.0])


def test_a_silent_car_is_forgotten():
    ears = Ears()
    ears.hear("n2", heard(NORTH, 0))
    assert ears.others(FORGOTTEN_NS + 1) == ()


def test_a_cam_without_heading_tells_nothing():
    assert heard(NORTH._replace(yaw_rad=None), 0) is None
