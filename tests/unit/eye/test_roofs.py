"""Tags are foretold where cars will be, and put where they were when the middle row was exposed."""

import math

import msgspec
import numpy as np

from scm.eye.camera import camera_model
from scm.eye.part import EyePart
from scm.eye.render.car import tag_on_roof
from scm.eye.render.scene import camera_over
from scm.eye.render.shots import Look, Studio
from scm.eye.render.traffic import tours
from scm.eye.roofs import at_middle_row, expected_tags
from scm.eye.source import Frame
from scm.eye.track.sighting import Track
from scm.maps.load import load_map
from scm.v2x.exchange import Incoming
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.messages.world_snapshot import SnapshotVehicle, WorldSnapshot

CITY = msgspec.structs.replace(load_map("driving_school"), walls=(), boxes=(), lights=())
CAMERA = msgspec.structs.replace(CITY.cameras[0], rolling_s=0.02)
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


def test_an_eye_that_knows_its_shutter_sees_moving_cars_where_they_are():
    look = Look(rolling_s=0.03, defocus_px=0.7, colour=False)
    model = camera_over(CITY, (1280, 720), 2.5)
    cars = tours(CITY, 4, 0.8, 1.0, np.random.default_rng(3), on_lanes=False)
    studio = Studio(CITY, model, look, 1)
    shots = [
        studio.shoot([one.at(k / 30.0) for one in cars], round(k * 1e9 / 30)) for k in range(8)
    ]
    known, unknown = (off_m(shots, model.camera, rolling_s) for rolling_s in (0.03, 0.0))
    assert unknown > 0.002
    assert known < 0.4 * unknown


def off_m(shots, camera, rolling_s):
    """How far the poses of the last frames are from the truth, root mean square."""
    camera = msgspec.structs.replace(camera, rate_hz=30.0, noise_sigma=2.0, rolling_s=rolling_s)
    left = list(shots)

    class Film:
        problem = None

        def read(self, now_ns, light):
            return Frame(left[0].t_ns, left.pop(0).image)

    eye, off = EyePart(msgspec.structs.replace(CITY, cameras=(camera,)), source=Film()), []
    for k, shot in enumerate(shots):
        truth = {one.car.vehicle: one.car for one in shot.cars}
        light = WorldSnapshot(t_ns=shot.t_ns, tick=k, vehicles=tuple(truth.values()))
        for one in eye.step(shot.t_ns, [Incoming(light, shot.t_ns)]):
            if isinstance(one, EyePose) and k >= 4:
                there = truth[one.vehicle]
                off.append(math.hypot(one.x_m - there.x_m, one.y_m - there.y_m))
    return math.sqrt(np.mean(np.square(off)))
