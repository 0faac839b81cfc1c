import math

import numpy as np
import pytest

from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.v2x.messages.lidar_scan import LidarScan
from scm.vehicles.car import load_car
from tests.unit.vehicle_agent.autonomy.drives import driven
from tests.unit.vehicle_agent.autonomy.rooms import BEAMS, outline, ranges_from
from vehicle_agent.autonomy.grid_map import grid_of_city
from vehicle_agent.autonomy.odometry import OdometryFilter, mount_of
from vehicle_agent.autonomy.particle_filter import MOST, ParticleFilter
from vehicle_agent.autonomy.sweep import deskewed, sweep_of

NIGEL = load_car("nigel")
NOISE_M = NIGEL.value("lidar.noise_m")
SCHOOL = grid_of_city(load_map("parking_school"))
OBSTACLES = grid_of_city(load_map("parking_school_obstacles"))
MIDDLE = Pose2(0.0, -0.35, 0.0)
STOOD = ((4.0, 0.0, 0.0),)
NONE = Pose2(0.0, 0.0, 0.0)
SECOND = 7  # sweeps


def steps(drive):
    """Yield time, motion since the last sweep, and echoes, by odometry."""
    odometry, last = OdometryFilter(NIGEL), None
    for message in drive.messages:
        if not isinstance(message, LidarScan):
            odometry.sensors(message)
            continue
        odometry.scan(message)
        now = odometry.at_sweep
        moved = NONE if last is None else last.inverse() @ now.pose
        last = now.pose
        yield message.t_ns, moved, deskewed(sweep_of(message), mount_of(NIGEL), now.twist)


def off(found, true):
    error = true.inverse() @ found
    return math.hypot(error.x, error.y), abs(error.yaw)


def started(grid, pose, seed=0):
    particles = ParticleFilter(grid, NOISE_M, seed)
    if pose is None:
        particles.begin_anywhere()
    else:
        particles.begin(pose)
    return particles


def errors(grid, drive, particles):
    found = [(t, particles.update(moved, echoes)) for t, moved, echoes in steps(drive)]
    return np.array([off(one.pose, drive.truth(t)) for t, one in found]), [one for _, one in found]


def test_pose_is_known_within_10_mm_over_a_drive():
    drive = driven("parking_school", MIDDLE)
    begun = MIDDLE @ Pose2(0.04, -0.04, 0.08)
    wrong, found = errors(SCHOOL, drive, started(SCHOOL, begun))
    way, turn = np.sqrt((wrong[3:] ** 2).mean(axis=0))
    assert way < 0.010
    assert turn < 0.010
    assert not any(one.is_lost for one in found)


def test_error_is_as_small_as_the_covariance_says():
    drive = driven("parking_school", MIDDLE)
    wrong, found = errors(SCHOOL, drive, started(SCHOOL, MIDDLE))
    said = np.sqrt([np.trace(one.covariance[:2, :2]) for one in found])
    assert 0.2 < (wrong[3:, 0] / said[3:]).mean() < 1.5


@pytest.mark.parametrize(
    "pose", [Pose2(-0.7, 0.3, 0.0), Pose2(-0.3, -0.2, 1.0), Pose2(0.2, 0.3, -2.0)]
)
def test_car_is_found_anywhere_in_a_room_without_symmetry(pose):
    drive = driven("parking_school_obstacles", pose, STOOD)
    wrong, found = errors(OBSTACLES, drive, started(OBSTACLES, None))
    assert wrong[SECOND:, 0].max() < 0.02
    assert wrong[SECOND:, 1].max() < 0.02
    assert not any(one.is_lost or one.alternative for one in found[1:])


def test_room_that_looks_the_same_from_two_places_has_an_alternative():
    pose = Pose2(-0.7, 0.3, 0.0)
    drive = driven("parking_school", pose, STOOD)
    _, found = errors(SCHOOL, drive, started(SCHOOL, None))
    for one in found[3 * SECOND :]:
        assert one.alternative is not None
        places = sorted([one.pose, one.alternative])
        assert off(places[0], pose)[0] < 0.03
        assert off(places[1], Pose2(0.2, 0.0, math.pi) @ pose)[0] < 0.03


def test_chance_does_not_decide_between_two_places():
    room = outline((-0.975, -0.625), (1.175, -0.625), (1.175, 0.625), (-0.975, 0.625))
    bearings, rng = np.arange(BEAMS) * math.tau / BEAMS, np.random.default_rng(1)
    ranges = ranges_from(room, Pose2(-0.7, 0.3, 0.4), bearings)
    particles = started(SCHOOL, None, seed=21)  # one place begins with a sixth of the particles
    for _ in range(8 * SECOND):
        seen = ranges + NOISE_M * rng.standard_normal(BEAMS)
        echoes = np.column_stack((seen * np.cos(bearings), seen * np.sin(bearings)))
        assert particles.update(NONE, echoes).alternative is not None


def test_car_that_was_put_elsewhere_is_found_again_within_5_s():
    here, there = Pose2(-0.7, 0.3, 0.0), Pose2(0.0, -0.35, 2.0)
    particles = started(OBSTACLES, here)
    errors(OBSTACLES, driven("parking_school_obstacles", here, STOOD), particles)
    wrong, found = errors(
        OBSTACLES, driven("parking_school_obstacles", there, ((5.0, 0.0, 0.0),)), particles
    )
    assert found[0].is_lost
    assert not found[-1].is_lost
    assert len(found) >= 28
    assert wrong[27:, 0].max() < 0.02


def test_map_of_another_room_is_not_believed():
    drive = driven("parking_school", Pose2(-0.7, 0.3, 0.0), STOOD)
    for name, begun in (("driving_school", None), ("driving_school", Pose2(-0.7, 0.3, 0.0))):
        grid = grid_of_city(load_map(name))
        _, found = errors(grid, drive, started(grid, begun))
        assert all(one.is_lost for one in found)


def test_start_that_was_given_is_believed_though_things_hide_a_third_of_the_walls():
    rng, bearings = np.random.default_rng(1), np.arange(BEAMS) * math.tau / BEAMS
    room = outline((-0.975, -0.625), (1.175, -0.625), (1.175, 0.625), (-0.975, 0.625))
    start = Pose2(-0.7, 0.3, 0.4)
    ranges = ranges_from(room, start, bearings)
    ranges[:108] *= 0.5  # 30 % of them
    for begun, is_believed in ((start, True), (None, False)):
        particles = started(SCHOOL, begun)
        for _ in range(2 * SECOND):
            seen = ranges + NOISE_M * rng.standard_normal(BEAMS)
            echoes = np.column_stack((seen * np.cos(bearings), seen * np.sin(bearings)))
            found = particles.update(NONE, echoes)
            assert found.is_lost != is_believed


def test_things_that_the_map_has_not_do_not_pull_the_car():
    drive, rng = driven("parking_school", Pose2(-0.7, 0.3, 0.0), STOOD), np.random.default_rng(1)
    particles, wrong = started(SCHOOL, Pose2(-0.7, 0.3, 0.0)), []
    post = np.array([[-0.3, -0.1, -0.3, 0.5]])  # beside no wall, across a third of the sweep
    for t, moved, echoes in steps(drive):
        bearings = np.arctan2(echoes[:, 1], echoes[:, 0])
        to_post = ranges_from(post, drive.truth(t), bearings) + rng.normal(0.0, 0.01, len(echoes))
        far = np.hypot(*echoes.T)
        hides = to_post < far
        nearest = echoes * (np.where(hides, to_post, far) / far)[:, None]
        found = particles.update(moved, nearest)
        wrong.append(off(found.pose, drive.truth(t)))
        assert hides.mean() > 0.15
        assert found.explained[hides].mean() < 0.1
        assert found.explained[~hides].mean() > 0.95
    assert np.array(wrong)[:, 0].max() < 0.015


def test_fewer_particles_where_the_pose_is_known():
    drive = driven("parking_school", MIDDLE)
    _, found = errors(SCHOOL, drive, started(SCHOOL, MIDDLE))
    assert len(found[0].weights) == MOST
    assert len(found[-1].weights) < MOST / 5
    assert all(one.weights.sum() == pytest.approx(1.0) for one in found)


def test_particles_move_and_spread_where_odometry_is_all_there_is():
    start, step = Pose2(0.1, 0.2, 1.0), Pose2(0.02, -0.01, 0.03)
    particles, expected = started(SCHOOL, start), start
    before = particles.update(NONE, np.empty((0, 2)))
    for _ in range(10):
        moved, expected = particles.update(step, np.empty((0, 2))), expected @ step
    assert moved.is_lost
    way, turn = off(moved.pose, expected)
    assert way < 0.01
    assert turn < 0.01
    assert np.trace(moved.covariance[:2, :2]) > np.trace(before.covariance[:2, :2])


def test_same_seed_gives_equal_bits():
    drive = driven("parking_school_obstacles", Pose2(-0.3, -0.2, 1.0), STOOD)
    runs = [
        errors(OBSTACLES, drive, started(OBSTACLES, None, seed))[1][-1].particles
        for seed in (5, 5, 6)
    ]
    np.testing.assert_array_equal(runs[0], runs[1])
    assert runs[0].shape != runs[2].shape or (runs[0] != runs[2]).any()
