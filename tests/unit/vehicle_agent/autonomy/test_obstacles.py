import math

import numpy as np
import pytest
from msgspec.structs import replace

from scm.geometry import TAU, Pose2
from scm.maps.load import load_map
from scm.records.city_map import Wall
from tests.unit.vehicle_agent.autonomy.rooms import outline, ranges_from
from vehicle_agent.autonomy.grid_map import FREE, OCCUPIED, grid_of_city
from vehicle_agent.autonomy.obstacles import ObstacleLayer

BOX = outline((0.3, -0.1), (0.5, -0.1), (0.5, 0.1), (0.3, 0.1))
SCANNER = Pose2(-0.4, 0.0, 0.3)
NOISE_M = 0.025


def room(front=0.9):
    """Return the walls of a room whose wall ahead stands there."""
    return outline((-0.9, -0.7), (front, -0.7), (front, 0.7), (-0.9, 0.7))


@pytest.fixture
def layer():
    corners = ((-0.9, -0.7), (0.9, -0.7), (0.9, 0.7), (-0.9, 0.7))
    walls = (Wall(points=corners, closed=True, thickness_m=0.0),)
    city_map = replace(load_map("parking_school"), walls=walls, boxes=())
    return ObstacleLayer(grid_of_city(city_map), NOISE_M)


def sweep(layer, *faces, noise_m=0.0, random=None):
    """Let the layer see what stands there."""
    look = np.arange(360) * TAU / 360
    far = np.min([ranges_from(face, SCANNER, look) for face in faces], axis=0)
    if noise_m:
        far = far + noise_m * random.standard_normal(360)
    yaw = SCANNER.yaw + look
    echoes = np.column_stack((SCANNER.x + far * np.cos(yaw), SCANNER.y + far * np.sin(yaw)))
    layer.update(SCANNER, echoes)


def clearance_at(layer, x, y):
    grid = layer.grid
    column, row = (math.floor((v - c) / grid.cell_m) for v, c in ((x, grid.x_m), (y, grid.y_m)))
    return grid.clearance_m[row, column]


def test_obstacle_appears_within_three_sweeps(layer):
    assert len(layer.points()) == 0
    for _ in range(3):
        sweep(layer, room(), BOX)
    points = layer.points()
    assert len(layer.points()) > 0
    assert abs(points[:, 0].min() - 0.3) < 0.04
    assert points[:, 1].min() < -0.07
    assert points[:, 1].max() > 0.07
    assert clearance_at(layer, 0.2, 0.0) == pytest.approx(0.1, abs=0.03)


@pytest.mark.parametrize("seed", range(3))
def test_car_that_drives_up_is_followed(layer, seed):
    random = np.random.default_rng(seed)
    for _ in range(8):
        sweep(layer, room(), noise_m=NOISE_M, random=random)
    for x in np.arange(0.8, 0.49, -0.2 / 7):  # 0.2 m/s, seven sweeps a second
        car = outline((x, -0.1), (x + 0.4, -0.1), (x + 0.4, 0.1), (x, 0.1))
        sweep(layer, room(), car, noise_m=NOISE_M, random=random)
    before = [clearance_at(layer, x - 0.1, y) for y in (-0.05, 0.0, 0.05)]
    assert np.array(before) == pytest.approx(0.1, abs=0.045)


def test_obstacle_vanishes_when_it_is_seen_through(layer):
    for _ in range(20):
        sweep(layer, room(), BOX)
    for _ in range(3):
        sweep(layer, room())
    assert len(layer.points()) == 0


def test_wall_moves_to_where_it_is_seen(layer):
    for _ in range(20):
        sweep(layer, room(front=0.84))
    assert clearance_at(layer, 0.74, 0.0) == pytest.approx(0.1, abs=0.02)
    assert layer.grid.cells[layer.grid.cells.shape[0] // 2].tolist().count(FREE) > 0


def test_noise_of_echoes_averages_out(layer):
    random = np.random.default_rng(5)
    for _ in range(20):
        sweep(layer, room(), noise_m=NOISE_M, random=random)
    assert len(layer.points()) == 0
    ahead = [clearance_at(layer, 0.8, y) for y in np.arange(-0.3, 0.31, 0.05)]
    assert np.abs(np.array(ahead) - 0.1).max() < 0.03


def test_what_is_hidden_stays_as_on_the_map(layer):
    for _ in range(5):
        sweep(layer, room(), BOX)
    assert clearance_at(layer, 0.8, 0.0) == pytest.approx(0.1, abs=0.02)
    assert (layer.grid.cells == OCCUPIED).any()
