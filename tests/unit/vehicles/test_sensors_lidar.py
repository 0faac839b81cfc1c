"""LIDAR ranges are exact where geometry says so, and equal brute force everywhere."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from scm.clock import NS_PER_S
from scm.vehicles.bank import Bank
from scm.vehicles.car import load_car
from scm.vehicles.external_vehicles import ExternalVehicles
from scm.vehicles.rays.grid import WallGrid
from scm.vehicles.rays.scene import Scene
from scm.vehicles.sensor import Surroundings
from scm.vehicles.sensors.lidar import SENSOR, bearings_of, scan, sweep_s

NIGEL = load_car("nigel")
NEAREST, FARTHEST = NIGEL.vector("lidar.range_m")


def around(edges, own=(0,), outlines=(), owners=()):
    edges, outlines = (np.array(faces, float).reshape(-1, 4) for faces in (edges, outlines))
    return Surroundings(Scene(WallGrid(edges), outlines, np.array(owners, np.int64)), np.array(own))


def room(half):
    corners = np.array([(half, -half), (half, half), (-half, half), (-half, -half)])
    return np.column_stack((corners, np.roll(corners, -1, axis=0)))


def brute_force(scanners, edges, beams=360):
    """Every ray against every face, by solving the two-by-two system."""
    angles = scanners[:, 2:] + np.arange(beams) * 2 * np.pi / beams
    matrices = np.empty((*angles.shape, len(edges), 2, 2))
    matrices[..., 0] = np.stack((np.cos(angles), np.sin(angles)), axis=-1)[:, :, None]
    matrices[..., 1] = edges[:, :2] - edges[:, 2:]
    ends = np.broadcast_to((edges[:, :2] - scanners[:, None, :2])[:, None], matrices.shape[:-1])
    solvable = np.abs(np.linalg.det(matrices)) >= 1e-12
    distance, share = np.linalg.solve(matrices[solvable], ends[solvable][..., None])[..., 0].T
    hits = (distance > 0) & (share >= -1e-12) & (share <= 1 + 1e-12)
    distances = np.full(solvable.shape, np.inf)
    distances[solvable] = np.where(hits, distance, np.inf)
    out = distances.min(axis=-1)
    out[(out < NEAREST) | (out > FARTHEST)] = np.inf
    return out


def test_a_square_room_gives_its_exact_ranges():
    angle = np.arange(360) * np.pi / 180
    expected = 2.0 / np.maximum(np.abs(np.cos(angle)), np.abs(np.sin(angle)))
    ranges = scan(NIGEL, np.array([[0.0, 0.0, 0.0]]), around(room(2.0)))
    assert_allclose(ranges[0], expected, rtol=1e-12)


def test_beams_count_counter_clockwise_from_straight_ahead():
    left_wall = [[-1.0, 1.0, 3.0, 1.0]]
    ranges = scan(NIGEL, np.array([[0.0, 0.0, 0.0]]), around(left_wall))
    assert ranges[0, 90] == pytest.approx(1.0)
    assert np.isinf(ranges[0, [0, 270]]).all()


def test_turning_the_car_left_turns_the_world_right():
    pose = np.array([[0.3, -0.2, 0.0]])
    turned = pose + np.radians([0.0, 0.0, 30.0])
    before, after = (scan(NIGEL, p, around(room(2.0))) for p in (pose, turned))
    assert_allclose(after, np.roll(before, -30, axis=1), rtol=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_ranges_equal_brute_force(seed):
    rng = np.random.default_rng(seed)
    starts = rng.uniform(-4, 4, (30, 2))
    edges = np.column_stack((starts, starts + rng.normal(0, 1.0, (30, 2))))
    scanners = np.column_stack((rng.uniform(-3, 3, (3, 2)), rng.uniform(-4, 4, 3)))
    ranges = scan(NIGEL, scanners, around(edges, own=(0, 1, 2)))
    assert_allclose(ranges, brute_force(scanners, edges), rtol=1e-9)


def test_a_scanner_does_not_see_its_own_car_but_others_do():
    box = np.add(room(0.1), (1.1, 0.0, 1.1, 0.0))
    pose = np.zeros((2, 3))
    ranges = scan(NIGEL, pose, around([], own=(5, 6), outlines=box, owners=[5]))
    assert np.isinf(ranges[0]).all()
    assert ranges[1, 0] == pytest.approx(1.0)


@pytest.mark.parametrize("distance", [NEAREST - 0.01, FARTHEST + 0.01])
def test_too_near_and_too_far_are_misses(distance):
    edges = [[distance, -20.0, distance, 20.0]]
    assert np.isinf(scan(NIGEL, np.zeros((1, 3)), around(edges))[0, 0])


def test_no_beam_slips_through_where_two_walls_meet():
    rng = np.random.default_rng(5)
    angles = np.sort(rng.uniform(0, 2 * np.pi, 500))
    points = 3.0 * np.column_stack((np.cos(angles), np.sin(angles)))
    edges = np.column_stack((points, np.roll(points, -1, axis=0)))
    scanners = np.column_stack((rng.uniform(-1, 1, (50, 2)), rng.uniform(-4, 4, 50)))
    assert np.isfinite(scan(NIGEL, scanners, around(edges, own=np.arange(50)))).all()


def test_an_empty_city_is_all_misses():
    assert_array_equal(scan(NIGEL, np.zeros((1, 3)), around([])), np.full((1, 360), np.inf))


def test_a_narrow_field_of_view_begins_at_its_right_hand_end():
    racer = load_car("f1tenth")
    first, step, beams = bearings_of(racer)
    assert (np.degrees(first), np.degrees(step), beams) == pytest.approx((-135.0, 0.25, 1080))
    right_wall = [[-1.0, -1.0, 3.0, -1.0]]
    ranges = scan(racer, np.zeros((1, 3)), around(right_wall))[0]
    assert ranges[(135 - 90) * 4] == pytest.approx(1.0)
    assert np.isinf(ranges[135 * 4 :]).all()


def test_a_hit_beyond_the_range_after_noise_is_a_miss():
    still = ExternalVehicles(1)
    x, _, _ = NIGEL.vector("lidar.position_m")
    bank = Bank(SENSOR, 0)
    bank.fit(0, "ann", NIGEL, still, 0, 0)
    wall = x + FARTHEST + 0.01
    scene = around([[wall, -9.0, wall, 9.0]]).scene
    steps = range(0, 200 * NS_PER_S, NS_PER_S // 7 + 1)
    ahead = np.array([bank.step(now, lambda: scene)[0].values[0, 0] for now in steps])
    assert 0.2 < np.isfinite(ahead).mean() < 0.5
    assert ahead[np.isfinite(ahead)].max() <= FARTHEST


@pytest.mark.parametrize(("view_rad", "share"), [(2.0 * np.pi, 1.0), (np.pi, 0.5)])
def test_a_moving_sweep_lasts_its_share_of_a_turn_and_a_frozen_one_no_time(
    tmp_path, view_rad, share
):
    text = NIGEL.path.read_text(encoding="utf-8")
    moving = f"""[lidar]
sweep = {{ value = "moving", source = "test" }}
field_of_view_rad = {{ value = {view_rad}, unit = "rad", source = "test" }}"""
    path = tmp_path / "sweeping.toml"
    path.write_text(text.replace("[lidar]", moving), encoding="utf-8")
    assert sweep_s(load_car(path)) == pytest.approx(share / 7.0)
    assert sweep_s(NIGEL) == 0.0


def test_a_moving_sweep_smears_what_a_frozen_one_does_not(tmp_path):
    text = NIGEL.path.read_text(encoding="utf-8")
    path = tmp_path / "sweeping.toml"
    path.write_text(
        text.replace("[lidar]", '[lidar]\nsweep = { value = "moving", source = "test" }')
    )
    truth = ExternalVehicles(1)
    truth.speed[0] = 0.25
    sight = around([[3.0, -20.0, 3.0, 20.0]])
    frozen, moving = (
        SENSOR.measure(car, truth, np.array([0]), sight)[0] for car in (NIGEL, load_car(path))
    )
    assert moving[0] - frozen[0] == pytest.approx(0.25 / 7.0 * 359.0 / 360.0)
    assert moving[359] == pytest.approx(frozen[359])
