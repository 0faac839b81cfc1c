"""The front camera: small pictures that show what the city's own camera shows, a few a second."""

import warnings
from dataclasses import replace

import cv2
import gymnasium
import numpy as np
import pytest
from gymnasium.error import Error
from gymnasium.utils.env_checker import check_env

import scm.gym
from scm.camera.batch import BatchCamera
from scm.camera.daylight import Daylight
from scm.camera.optics import optics_of
from scm.camera.studio import Studio
from scm.errors import CarError
from scm.gym.observations import Observations
from scm.maps.load import load_map
from scm.scenery.bodies import car_body
from scm.v2x.messages.world_snapshot import SnapshotVehicle
from scm.vehicles.car import load_car

LAP, TRAFFIC = "driving_school/lap-v1", "driving_school/traffic-v1"
OPTICS = optics_of(load_car("nigel"), "front")
SIGHTS = "motion", "camera"


def begun(count, name=TRAFFIC, **options):
    worlds = scm.gym.make_vec(name, count, observations=SIGHTS, **options).worlds
    worlds.seed(np.arange(count), np.arange(count))
    worlds.begin(np.ones(count, bool))
    return worlds


def of_city(studio, poses, optics=OPTICS):
    """Return the picture that the city's camera takes from the first of some cars, 48 by 27."""
    cars = [
        SnapshotVehicle(
            vehicle=f"n{k}", kind="hosted", car="nigel", tag_id=0, x_m=x, y_m=y, yaw_rad=yaw,
            speed_mps=0.0, steering_rad=0.0,
        )
        for k, (x, y, yaw) in enumerate(poses.tolist())
    ]  # fmt: skip
    picture = studio.picture(optics, cars[0], cars, {}, "front", 0)
    small = cv2.resize(picture, (48, 27), interpolation=cv2.INTER_AREA)
    return cv2.cvtColor(small, cv2.COLOR_BGR2GRAY).astype(float) / 255.0


def compared(ours, theirs):
    """Return how far two pictures differ on average, and their correlation."""
    return np.abs(ours - theirs).mean(), np.corrcoef(ours.ravel(), theirs.ravel())[0, 1]


@pytest.mark.parametrize(
    "name", [TRAFFIC, "market_town/traffic-v1", "parking_school_obstacles/parking-v1"]
)
def test_pictures_show_what_the_city_s_camera_shows(name):
    worlds = begun(12, name)
    studio = Studio(worlds.city_map, Daylight())
    seen = Observations(worlds, ["camera"]).update().reshape(12, 27, 48)
    fleet = worlds.fleet
    poses = np.column_stack((fleet.x, fleet.y, fleet.yaw))
    for picture, rows in zip(seen, worlds.cars, strict=True):
        off, alike = compared(picture, of_city(studio, poses[rows]))
        assert off < 0.03
        assert alike > 0.85 if picture.std() < 0.1 else alike > 0.95


def test_pictures_of_a_lens_that_bends_lines_and_is_mounted_askew():
    optics = replace(
        OPTICS, distortion=(-0.3, 0.08, 0.002, -0.001, 0.0), roll=0.1, yaw=0.2, pitch_down=0.2
    )
    city_map = load_map("driving_school")
    camera = BatchCamera(city_map, optics, car_body("nigel"), 48)
    poses = np.array([[1.0, 0.55, 0.3], [1.6, 0.8, 1.0]])
    found, other = np.zeros((2, 2, 27 * 48), np.float32)
    camera.render(np.arange(1), np.array([[0, 1]]), poses, np.ones(2, bool), found)
    straight = BatchCamera(city_map, replace(optics, distortion=(0.0,) * 5), car_body("nigel"), 48)
    straight.render(np.zeros(1, int), np.array([[0, 1]]), poses, np.ones(2, bool), other)
    theirs = of_city(Studio(city_map, Daylight()), poses, optics)
    off, alike = compared(found[0].reshape(27, 48), theirs)
    assert off < 0.6 * compared(other[0].reshape(27, 48), theirs)[0]
    assert (off, alike) == (pytest.approx(0.0, abs=0.025), pytest.approx(1.0, abs=0.05))


def test_car_that_is_out_is_not_seen_nor_is_the_own():
    worlds = begun(1)
    ahead = worlds.cars[0, 1]
    with_it = Observations(worlds, ["camera"]).update().copy()
    worlds.fleet.alive[worlds.cars[0, 1:]] = False
    without = Observations(worlds, ["camera"]).update().copy()
    changed = (np.abs(with_it - without) > 0.05).reshape(27, 48)
    assert 10 < changed.sum() < 600
    alone = begun(1, LAP)
    fleet = worlds.fleet
    pose = np.array([[fleet.x[0], fleet.y[0], fleet.yaw[0]]])
    alone.fleet.place_rows(np.zeros(1, int), pose, np.zeros(1))
    assert Observations(alone, ["camera"]).update() == pytest.approx(without)
    assert ahead != 0


def test_picture_is_held_until_the_next_exposure():
    envs = scm.gym.make_vec(LAP, 2, observations=("camera",), autoreset_mode="Disabled")
    seen, _ = envs.reset(seed=1)
    changed = []
    for _ in range(12):
        now, *_ = envs.step(np.array([[1.0, 0.0]] * 2))
        changed.append(bool((now != seen).any()))
        seen = now
    assert changed == [False, False, False, True] * 3


def test_new_episode_begins_with_a_new_picture():
    envs = scm.gym.make_vec(LAP, 2, observations=("camera",))
    first, _ = envs.reset(seed=1)
    for _ in range(2):
        envs.step(np.array([[1.0, 0.3]] * 2))
    mask = np.array([True, False])
    again, _ = envs.reset(options={"reset_mask": mask})
    assert (again[0] != first[0]).any()
    assert (again[1] == first[1]).all()  # its next exposure is due in two steps


def test_world_is_the_same_bit_by_bit_whatever_their_number_and_threads():
    drawn = np.random.default_rng(1).uniform(-0.2, 1.0, (60, 7, 2))
    seen = []
    for first, count, threads in ((0, 7, 1), (0, 7, 3), (3, 2, 1)):
        envs = scm.gym.make_vec(TRAFFIC, count, observations=SIGHTS, threads=threads)
        rows = [envs.reset(seed=40 + first)[0]]
        rows += [envs.step(one[first : first + count])[0] for one in drawn]
        seen.append(np.array(rows))
    np.testing.assert_array_equal(seen[0], seen[1])
    np.testing.assert_array_equal(seen[0][:, 3:5], seen[2])


def test_gymnasium_finds_nothing_wrong_with_pictures():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gymnasium.make("scm/driving_school-lap-v1", observations=SIGHTS).unwrapped)


def test_columns_are_those_requested():
    env = scm.gym.parallel_env("market_town/crossing-v1", observations=("lane", "camera"))
    assert env.observation_names[7:9] == ("grey_0_0", "grey_0_1")
    assert env.observation_names[-1] == "grey_26_47"
    assert env.observation_space("car_0").shape == (7 + 27 * 48,)


@pytest.mark.parametrize(
    ("name", "parts", "error", "words"),
    [
        (LAP, ("motion", "camara"), Error, "no 'camara'.*camera"),
        (LAP, (), Error, "columns once each, got none"),
        (LAP, ("peers",), Error, "columns once each, got none"),
        (LAP, ("ranges", "ranges_36"), Error, "range_0_m more than once"),
        (LAP, ("pursued",), TypeError, "`pursued` needs cars that rules drive"),
        ("market_town/signal_control-v1", ("motion",), Error, "'motion' is a car's"),
    ],
)
def test_observations_that_agents_cannot_have(name, parts, error, words):
    with pytest.raises(error, match=words):
        scm.gym.make_vec(name, 4, observations=parts)


def test_car_without_a_camera_says_so():
    with pytest.raises(CarError, match="dart: expected a front camera"):
        scm.gym.make_vec(LAP, 1, car="dart", observations=("camera",))
