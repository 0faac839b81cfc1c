import math

import numpy as np
import pytest

from scm.camera.daylight import Daylight
from scm.camera.optics import optics_of
from scm.camera.studio import Studio
from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.maps.route import roads_of
from scm.v2x.messages.world_snapshot import SnapshotVehicle
from scm.vehicles.car import load_car
from vehicle_agent.autonomy.plan import limits_of
from vehicle_agent.cloning.augmentation import Augmentation, Augmenter

NIGEL = load_car("nigel")
OPTICS, LIMITS = optics_of(NIGEL, "front"), limits_of(NIGEL)
SIZE = OPTICS.width_px, OPTICS.height_px


STILL = {
    "offset_std_m": 0.0, "heading_std_rad": 0.0, "mirrored": 0.0, "light": (1.0, 1.0), "tint": 0.0,
    "shadow": 0.0,
}  # fmt: skip


def augmenter(**how):
    return Augmenter(OPTICS, LIMITS, SIZE, Augmentation(**how), np.random.default_rng(1))


@pytest.fixture(scope="module")
def picture():
    studio = Studio(load_map("driving_school"), Daylight())
    start = roads_of(load_map("driving_school")).lane("east_loop").at(1.0)

    def taken(offset_m, heading_rad):
        pose = start @ Pose2(0.0, offset_m, heading_rad)
        car = SnapshotVehicle(
            vehicle="n1", kind="hosted", car="nigel", tag_id=1, x_m=pose.x, y_m=pose.y,
            yaw_rad=pose.yaw, speed_mps=0.0, steering_rad=0.0,
        )  # fmt: skip
        return studio.picture(OPTICS, car, [car], {}, "front", 0).copy()

    return taken


@pytest.mark.parametrize(
    ("offset_m", "heading_rad"), [(0.05, 0.0), (-0.05, 0.0), (0.0, 0.12), (0.04, -0.1)]
)
def test_floor_looks_as_from_a_car_that_stands_there(picture, offset_m, heading_rad):
    frame, there = picture(0.0, 0.0), picture(offset_m, heading_rad)
    moved = augmenter().seen_from(frame, offset_m, heading_rad)
    floor = np.s_[450:, 250:-250]

    def apart(one):
        return np.median(np.abs(one[floor].astype(float) - there[floor]), axis=2).mean()

    assert apart(moved) < 0.35 * apart(frame)
    assert apart(moved) < 8.0


def test_command_leads_back_to_a_point_on_the_way():
    back = augmenter(way_m=0.5).steering_back(0.0, 0.04, -0.03)
    curvature = math.tan(back * LIMITS.steering_rad) / LIMITS.wheelbase_m
    ahead = Pose2(0.0, 0.04, -0.03).inverse() @ Pose2(0.5, 0.0, 0.0)
    pursued = 2.0 * ahead.y / (ahead.x**2 + ahead.y**2)
    assert curvature == pytest.approx(pursued, rel=0.02)
    assert augmenter().steering_back(0.3, 0.0, 0.0) == pytest.approx(0.3)


def test_mirrored_frame_steers_the_other_way():
    rng = np.random.default_rng(2)
    frame = rng.integers(0, 256, (SIZE[1], SIZE[0], 3)).astype(np.uint8)
    (changed,), steering = augmenter(**STILL | {"mirrored": 1.0})([frame], 0.4)
    assert steering == pytest.approx(-0.4)
    assert (changed[:, ::-1] == frame).all()
    (unchanged,), same = augmenter(**STILL)([frame], 0.4)
    assert same == pytest.approx(0.4)
    assert (unchanged == frame).all()


GREY = np.full((SIZE[1], SIZE[0], 3), 200, np.uint8)


def test_shadow_darkens_a_part():
    (changed, other), _ = augmenter(**STILL | {"shadow": 1.0})([GREY, GREY], 0.0)
    assert (other == changed).all()  # frames that are seen together are changed alike
    assert len(np.unique(changed)) == 2
    assert changed.min() < 185
    assert changed.max() >= 199


def test_light_and_tint_multiply_each_colour():
    augment = augmenter(**STILL | {"light": (0.5, 0.5), "tint": 0.1})
    (changed,), _ = augment([GREY], 0.0)
    (colour,) = np.unique(changed.reshape(-1, 3), axis=0)
    assert 80 < colour.min() < colour.max() < 120
