"""The emulated camera: what moves, hides and shimmers in its pictures."""

import msgspec
import numpy as np
import pytest

from scm.eye.camera import camera_model
from scm.eye.detect import detect_tags
from scm.eye.render.car import tag_on_roof
from scm.eye.source import Frame
from scm.eye.sources.synthetic import SyntheticSource
from scm.maps.load import load_map
from scm.records.city_map import Box
from scm.scenery.bodies import NIGEL, car_body, car_rotation
from scm.v2x.messages.world_snapshot import SnapshotVehicle, WorldSnapshot

CITY = load_map("driving_school")
CAMERA = camera_model(CITY.cameras[0])
CAR = SnapshotVehicle(
    vehicle="n1", kind="hosted", car="nigel", tag_id=1, x_m=2.2, y_m=0.65, yaw_rad=1.57,
    speed_mps=0.0, steering_rad=0.0,
)  # fmt: skip


def light(*cars, t_ns=0):
    return WorldSnapshot(t_ns=t_ns, tick=0, vehicles=cars)


def source_of(city=CITY, seed=0, **camera):
    model = camera_model(msgspec.structs.replace(city.cameras[0], **camera))
    return SyntheticSource(city, model, np.random.default_rng(seed))


@pytest.fixture(scope="module")
def still():
    return source_of(noise_sigma=0.0)


def ids(image):
    return [tag.tag_id for tag in detect_tags(Frame(0, image).grey())]


def test_without_cars_and_noise_every_picture_is_the_same(still):
    assert np.array_equal(still.render(light()).copy(), still.render(light()))


def test_a_car_changes_only_the_pixels_around_it(still):
    empty = still.render(light()).copy()
    with_car = still.render(light(CAR)).astype(int)
    rows, columns = np.nonzero(np.abs(with_car - empty).max(axis=2))
    x, y = CAMERA.project(tag_on_roof(CAR)).mean(axis=0)
    # The nose is 0.2 m from the tag's middle, the shadow reaches a little further: 110 px.
    assert np.hypot(rows - y, columns - x).max() < 130.0
    assert len(rows) > 5000


@pytest.mark.parametrize("tag_id", [-1, 587, 10**9])
def test_a_car_with_a_number_that_no_tag_has_drives_without_one(still, tag_id):
    seen = ids(still.render(light(msgspec.structs.replace(CAR, tag_id=tag_id))))
    assert seen == [0]


def test_the_sensors_noise_has_the_cameras_sigma():
    noisy = source_of(noise_sigma=3.0)
    difference = noisy.render(light()).astype(float) - noisy.render(light()).copy()
    first, second = noisy.render(light()).astype(float), noisy.render(light()).astype(float)
    assert difference.shape == first.shape
    # Rounding to whole grey levels adds 1/12 to the variance: 3.014.
    assert np.std(first - second) / np.sqrt(2.0) == pytest.approx(3.014, rel=0.02)


def test_a_box_between_camera_and_car_hides_its_tag():
    box = Box(name="b", x_m=1.95, y_m=0.68, length_m=0.2, width_m=0.3, height_m=1.5)
    city = msgspec.structs.replace(CITY, boxes=(box,))
    assert ids(source_of().render(light(CAR))) == [0, 1]
    assert ids(source_of(city).render(light(CAR))) == [0]


def test_a_wall_behind_a_car_hides_nothing_of_it(still):
    by_the_wall = msgspec.structs.replace(CAR, x_m=2.5, y_m=0.02, yaw_rad=0.1)
    assert ids(still.render(light(by_the_wall))) == [0, 1]


def test_a_low_foot_of_a_light_hides_nothing(still):
    post = CITY.lights[0]
    over = msgspec.structs.replace(CAR, x_m=post.x_m, y_m=post.y_m, yaw_rad=0.0)
    assert ids(still.render(light(over))) == [0, 1]


def test_a_car_outside_the_frame_is_no_error(still):
    far = msgspec.structs.replace(CAR, x_m=9.0)
    assert np.array_equal(still.render(light()).copy(), still.render(light(far)))


def test_a_car_half_outside_the_frame_is_drawn(still):
    empty = still.render(light()).copy()
    edge = msgspec.structs.replace(CAR, x_m=2.95, y_m=0.65, yaw_rad=0.0)
    assert not np.array_equal(empty, still.render(light(edge)))


def test_a_snapshot_is_taken_once(still):
    assert still.read(0, light(t_ns=5)).t_ns == 5
    assert still.read(0, light(t_ns=5)) is None
    assert still.read(0, None) is None


def test_front_wheels_turn_with_the_steering(still):
    straight = still.render(light(CAR)).copy()
    turned = still.render(light(msgspec.structs.replace(CAR, steering_rad=0.5)))
    assert not np.array_equal(straight, turned)


def test_a_roof_that_rolls_to_the_right_carries_its_tag_to_the_right():
    ahead = msgspec.structs.replace(CAR, yaw_rad=0.0)
    leaning = msgspec.structs.replace(ahead, roll_rad=0.1)
    shift = tag_on_roof(leaning).mean(axis=0) - tag_on_roof(ahead).mean(axis=0)
    assert shift[1] == pytest.approx(-NIGEL.tag_position[2] * np.sin(0.1))


def test_a_nose_that_pitches_down_carries_the_tag_forward():
    ahead = msgspec.structs.replace(CAR, yaw_rad=0.0)
    diving = msgspec.structs.replace(ahead, pitch_rad=0.1)
    shift = tag_on_roof(diving).mean(axis=0) - tag_on_roof(ahead).mean(axis=0)
    assert shift[0] > 0.01


def test_a_rotation_keeps_lengths():
    tilted = msgspec.structs.replace(CAR, roll_rad=0.1, pitch_rad=-0.05)
    rotation = car_rotation(tilted)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)


def test_a_nigels_measures_are_those_of_its_car_file():
    assert car_body("nigel") == NIGEL


def test_other_car_files_have_their_own_roof():
    assert car_body("f1tenth").tag_position[2] == 0.18


def test_a_car_file_without_a_tag_makes_a_car_with_a_bare_roof(still):
    assert not car_body("dart").has_tag
    assert ids(still.render(light(msgspec.structs.replace(CAR, car="dart")))) == [0]


@pytest.mark.parametrize("name", ["home-made", "../types/f1tenth", "", "a/b"])
def test_a_car_without_a_file_of_ours_is_taken_for_a_nigel(name):
    assert car_body(name) == NIGEL
