"""What agents see: within its range, and by devices whose noise is another in each step."""

import numpy as np
import pytest

import scm.gym
from scm.geometry import Pose2
from scm.gym.observations import Observations
from scm.vehicles.sensors import lidar


@pytest.fixture
def worlds():
    envs = scm.gym.make_vec("driving_school/lap-v1", 3)
    envs.reset(seed=4)
    return envs.worlds


def test_what_lies_beyond_the_range_is_clipped(worlds):
    seen = Observations(worlds, ["motion"])
    worlds.fleet.place_rows(np.array([1]), np.array([[1.0, 0.5, 0.0]]), np.array([9.0]))
    values = seen.update()
    assert values[1, 0] == seen.high[0] == 5.0
    assert 0.0 <= values[0, 0] <= 0.3


def test_readings_are_noisy_and_belong_to_car_and_step(worlds):
    seen = Observations(worlds, ["inertial"])
    rows = np.arange(3)
    worlds.fleet.place_rows(rows, np.array([[1.0, 0.5, 0.0]] * 3), np.zeros(3))
    first, same = seen.update().copy(), seen.update().copy()
    worlds.steps += 1
    later = seen.update().copy()
    assert np.array_equal(first, same)
    assert (first[:, :6] != later[:, :6]).all()
    assert len({one.tobytes() for one in first}) == 3
    assert first[:, 2] == pytest.approx(9.81, abs=0.5)
    names = dict(zip(seen.names, first[0], strict=True))
    assert (names["wheel_left_mps"], names["wheel_right_mps"]) == pytest.approx((0.0, 0.0))


def test_ranges_are_those_that_the_city_s_scanner_has(worlds):
    fleet, car = worlds.fleet, worlds.car
    values = Observations(worlds, ["ranges_360"]).update()
    x, y, _ = car.vector("lidar.position_m")
    scanner = fleet.pose(2) @ Pose2(x, y, 0.0)
    from scm.maps.segments import wall_segments
    from scm.vehicles.rays.grid import WallGrid
    from scm.vehicles.rays.scene import Scene
    from scm.vehicles.sensor import Surroundings

    scene = Scene(WallGrid(wall_segments(worlds.city_map)), np.empty((0, 4)), np.empty(0, int))
    own = np.array([-1])
    (ranges,) = lidar.scan(car, np.array([[*scanner]]), Surroundings(scene, own))
    near, far = car.vector("lidar.range_m")
    assert values[2] == pytest.approx(np.clip(ranges, near, far), abs=1e-4)
    assert values.std() > 0.1


def test_nothing_has_moved_when_an_episode_begins(worlds):
    assert (worlds.lanes.moved_m == 0.0).all()
    worlds.step(np.full((3, 2), 0.5))
    worlds.begin(np.array([True, False, True]))
    assert (worlds.lanes.moved_m != 0.0).tolist() == [False, True, False]
