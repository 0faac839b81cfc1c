"""The first sieve: marks exactly those who overlap, whatever the lists remember."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from scm.records.city_map import Box, CityMap, MapTag, Wall
from scm.records.floor import Floor
from scm.world.broad_phase import TOUCH_M, BroadPhase, obstacles_of
from scm.world.solids import obstacle_boxes

RNG = np.random.default_rng(4)


def corners(x, y, yaw, half_length, half_width, ahead=0.0, left=0.0):
    c, s = np.cos(yaw), np.sin(yaw)
    points = [(ahead + i * half_length, left + j * half_width)
              for i, j in ((1, 1), (-1, 1), (-1, -1), (1, -1))]  # fmt: skip
    return np.array([(x + c * a - s * b, y + s * a + c * b) for a, b in points])


def gap(one, other):
    """Return the largest gap along any side's normal: below 0, they overlap."""
    gaps = []
    for box in (one, other):
        for k in range(2):
            side = box[k + 1] - box[k]
            normal = np.array([-side[1], side[0]]) / np.hypot(*side)
            a, b = one @ normal, other @ normal
            gaps.append(max(a.min() - b.max(), b.min() - a.max()))
    return max(gaps)


def crowd(n, spread):
    motion = RNG.uniform(-1, 1, (n, 6)) * [spread, spread, np.pi, 0.3, 0.3, 1.0]
    half = RNG.uniform(0.05, 0.2, (n, 2))
    middle = RNG.uniform(-0.03, 0.03, (n, 2))
    reach = np.hypot(np.abs(middle[:, 0]) + half[:, 0], np.abs(middle[:, 1]) + half[:, 1])
    return motion, np.column_stack((middle, half, reach))


def box_of(motion, outline):
    return corners(*motion[:3], *outline[2:4], *outline[:2])


def brute_force(motion, outlines, walls):
    boxes = [box_of(m, o) for m, o in zip(motion, outlines, strict=True)]
    still = [corners(x, y, np.arctan2(s, c), a, b) for x, y, c, s, a, b in walls]
    n = len(boxes)
    gaps = np.full(n, np.inf)
    for i in range(n):
        others = [boxes[j] for j in range(n) if j != i] + still
        gaps[i] = min(gap(boxes[i], other) for other in others)
    return gaps


@pytest.mark.parametrize("spread", [0.5, 1.5, 4.0])
def test_marks_are_those_of_every_pair_tried(spread):
    motion, outlines = crowd(40, spread)
    x, y, yaw = RNG.uniform(-1, 1, (3, 12)) * [[spread], [spread], [np.pi]]
    walls = np.column_stack(
        (x, y, np.cos(yaw), np.sin(yaw), RNG.uniform(0.1, 2.5, 12), np.full(12, 0.005))
    )
    marks = BroadPhase(obstacles_of(walls)).touching(np.arange(40), motion, outlines, 40)
    gaps = brute_force(motion, outlines, walls)
    clear = np.abs(gaps - TOUCH_M) > 1e-9
    assert_array_equal(marks[clear], (gaps < TOUCH_M)[clear])
    assert 0 < marks.sum() < 40 or spread == 0.5


def test_lists_that_are_kept_for_many_steps_miss_nobody():
    motion, outlines = crowd(60, 2.0)
    walls = np.array([[0.0, 0.0, 1.0, 0.0, 2.0, 0.01]])
    kept = BroadPhase(obstacles_of(walls))
    for step in range(200):
        motion[:, :3] += 0.005 * motion[:, 3:]
        if step == 100:
            motion[:, 3:5] *= -8.0  # all turn round and race
        marks = kept.touching(np.arange(60), motion, outlines, 60)
        fresh = BroadPhase(obstacles_of(walls)).touching(np.arange(60), motion, outlines, 60)
        assert_array_equal(marks, fresh)


def test_boxes_at_rest_against_each_other_wait_until_one_is_touched():
    near = BroadPhase(obstacles_of(np.array([[0.0, -0.11, 1.0, 0.0, 2.0, 0.01]])))
    outlines = np.tile([0.0, 0.0, 0.1, 0.1, 0.15], (3, 1))
    motion = np.zeros((3, 6))
    motion[:, 0] = [1.0, 0.2, 0.0]  # a car to the right, then two boxes side by side
    order = np.arange(3)
    assert not near.touching(order, motion, outlines, 1)[1:].any()
    motion[0, 0] = 0.395
    assert_array_equal(near.touching(order, motion, outlines, 1), [True, True, True])
    motion[0, 0], motion[2, 3] = 1.0, 0.1
    assert near.touching(order, motion, outlines, 1)[1:].all()


def test_walls_and_fixed_boxes_are_obstacles_and_movable_ones_are_not():
    city_map = CityMap(
        map=1, name="n", title="", source="", floor=Floor(x_m=(0, 1), y_m=(0, 1)),
        tag=MapTag(tag_id=0, size_m=0.1),
        walls=(Wall(points=((0.0, 0.0), (3.0, 4.0)), thickness_m=0.2),),
        boxes=(
            Box(name="a", x_m=1.0, y_m=2.0, length_m=0.2, width_m=0.4),
            Box(name="b", x_m=1.0, y_m=2.0, length_m=0.2, width_m=0.4, mass_kg=1.0),
        ),
    )  # fmt: skip
    boxes = obstacle_boxes(city_map)
    assert boxes == pytest.approx(
        np.array([[1.5, 2.0, 0.6, 0.8, 2.6, 0.1], [1.0, 2.0, 1.0, 0.0, 0.1, 0.2]])
    )
