"""Tags are foretold where cars will be, and put where they were when the middle row was exposed."""

import math

import msgspec
import numpy as np

from scm.eye.camera import camera_model
from scm.eye.render.car import tag_on_roof
from scm.eye.roofs import at_middle_row, expected_tags
from scm.eye.track.sighting import Track
from scm.maps.load import load_map
from scm.v2x.messages.world_snapshot import SnapshotVehicle

CAMERA = msgspec.structs.replace(load_map("driving_school").cameras[0], rolling_s=0.02)
MODEL = camera_model(CAMERA)


def car(x_m, y_m, yaw_rad):
    return SnapshotVehicle(
        vehicle="n7", kind="hosted", car="nigel", tag_id=7, x_m=x_m, y_m=y_m, yaw_rad=yaw_rad,
        speed_mps=0.2, steering_rad=0.0,
    )  # fmt: skip


def track(x_m, y_m, yaw_rad):
    return Track("n7", 7, 0, x_m, y_m, yaw_rad, 0.0, 0.0, 0.0, np.eye(6), 0.0, False, (), ())


def test_a_tag_is_expected_where_it_is_on_the_roof():
    found = expected_tags(MODEL, [track(1.3, 0.7, -0.8)], {})
    np.testing.assert_allclose(found[7], MODEL.project(tag_on_roof(car(1.3, 0.7, -0.8))), atol=1e-9)


def test_a_car_beyond_the_picture_is_not_expected():
    assert expected_tags(MODEL, [track(30.0, 0.7, -0.8)], {}) == {}


def test_rows_exposed_one_after_the_other_are_put_together():
    """Each corner is taken where the car was when its row was exposed."""
    speed, yaw = 2.0, 0.4

    def at(t_s):
        x, y = 1.0 + speed * t_s * math.cos(yaw), 0.9 + speed * t_s * math.sin(yaw)
        return MODEL.project(tag_on_roof(car(x, y, yaw)))

    middle, soon = at(0.0), at(0.005)
    late = CAMERA.rolling_s * ((middle[:, 1] + 0.5) / CAMERA.height_px - 0.5)
    found = np.array([at(t)[i] for i, t in enumerate(late)])
    assert np.abs(found - middle).max() > 1.0
    back = at_middle_row(found, (soon - middle) / 0.005, CAMERA)
    np.testing.assert_allclose(back, middle, atol=0.1)
