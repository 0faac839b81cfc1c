"""Rooms of the parking study: random lots, scans, and what a perturbation makes of their walls."""

import math

import cv2
import numpy as np
import pytest
from msgspec.structs import replace

from scm.errors import MapError
from scm.geometry import Pose2
from scm.maps.check import problems_of
from scm.records.city_map import Wall
from scm.vehicles.car import load_car
from studies.parking import perturbed
from studies.rooms import random_lot, room_named, seen_floor
from vehicle_agent.autonomy.grid_map import grid_of_city
from vehicle_agent.autonomy.outline import outline_clearance, scene_of
from vehicle_agent.autonomy.plan import limits_of

LIMITS = limits_of(load_car("nigel"))


def with_walls(*walls):
    return replace(random_lot(rng()), walls=walls)


def yaw(wall):
    (x0, y0), (x1, y1) = wall.points
    return math.atan2(y1 - y0, x1 - x0)


def rng(seed=1):
    return np.random.default_rng(seed)


def clearance(city_map, pose):
    return outline_clearance(scene_of(grid_of_city(city_map), LIMITS), Pose2(*pose))


@pytest.mark.parametrize("seed", range(6))
def test_random_lot_is_a_valid_map_with_a_free_goal_between_walls(seed):
    lot = random_lot(rng(seed))
    assert problems_of(lot) == []
    assert clearance(lot, lot.spawns[0].pose) > 0.0
    cars = [box for box in lot.boxes if box.name.startswith("car")]
    assert 0 < len(cars) < len(lot.bays)
    assert all(lot.bays[int(box.name.split("_")[1])].pose != lot.spawns[0].pose for box in cars)


def test_lots_differ_by_seed_and_only_by_seed():
    lots = [random_lot(rng(seed)) for seed in range(8)]
    assert random_lot(rng(3)) == lots[3]
    assert len({lot.floor.x_m for lot in lots}) == 8
    assert {len({bay.pose[1] for bay in lot.bays}) > 4 for lot in lots} == {True, False}
    ahead = {math.copysign(1.0, lot.spawns[0].pose[2]) for lot in lots}
    assert ahead == {1.0, -1.0}


@pytest.fixture(scope="module")
def scan(tmp_path_factory):
    """A scan of a room of 2 x 1.5 m whose eastern end the scanner did not see."""
    folder = tmp_path_factory.mktemp("scan")
    grey = np.full((60, 80), 205, np.uint8)
    grey[10:42, 10:52] = 0
    grey[11:41, 11:51] = 254
    grey[11:41, 51] = 205
    cv2.imwrite(str(folder / "room.pgm"), grey[::-1])
    (folder / "room.yaml").write_text(
        "image: room.pgm\nresolution: 0.05\norigin: [-1.0, -1.0, 0.0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    return str(folder / "room.yaml")


def test_goal_in_a_scan_stands_beside_a_wall_and_starts_are_on_seen_floor(scan):
    room, seen = room_named(scan, "goal", LIMITS, rng()), scene_of(seen_floor(scan), LIMITS)
    assert clearance(room.city_map, room.goal) > 0.03
    assert 0.05 < outline_clearance(seen, room.goal) < 0.15
    starts = [room.draw(rng(seed)) for seed in range(20)]
    assert all(outline_clearance(seen, start) > 0.0 for start in starts)
    assert max(start.x for start in starts) < 1.55 - LIMITS.left_m


def test_scan_that_is_not_there_is_named():
    with pytest.raises(MapError, match=r"nowhere/room.yaml: there is no such map file"):
        room_named("nowhere/room.yaml", "goal", LIMITS, rng())


def test_wall_of_a_scan_moves_in_pieces_of_half_a_metre_that_hold_together():
    line = Wall(points=((0.0, 0.0), (0.4, 0.0), (0.4, 0.05), (1.0, 0.05)), thickness_m=0.0)
    still, moved = (perturbed(with_walls(line), scale, rng()).walls for scale in (0.0, 1.0))
    lengths = [math.dist(*wall.points) for wall in still]
    assert lengths == pytest.approx([0.4, 0.05, 0.075, 0.525])
    assert [math.dist(*wall.points) for wall in moved] == pytest.approx(lengths)
    turns = [yaw(after) - yaw(before) for before, after in zip(still, moved, strict=True)]
    assert turns[0] == pytest.approx(turns[1]) == pytest.approx(turns[2])
    assert abs(turns[3] - turns[0]) > 0.01


def test_what_stands_behind_the_face_of_a_scan_is_on_its_right():
    line = Wall(points=((0.0, 0.0), (0.4, 0.0)), thickness_m=0.0)
    (wall,) = perturbed(with_walls(line), 0.0, rng()).walls
    assert wall.thickness_m == 0.02
    assert wall.points == ((0.0, -0.01), (0.4, -0.01))
