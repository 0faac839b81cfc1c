"""The floor under wheels, against closed forms: discs over edges, planes, hills, patches."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from scm.clock import NS_PER_S
from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.records.city_map import CityMap, MapTag
from scm.records.floor import Floor, Patch, Plate, Ramp, Wind
from scm.vehicles.car import load_car
from scm.vehicles.fleet import Fleet
from scm.vehicles.ground import Ground

NIGEL = load_car("nigel")
RADIUS, BASE = NIGEL.value("wheel.radius_m"), NIGEL.value("body.wheelbase_m")
HEIGHT = 0.005
STEP = Plate(name="step", x_m=1.5, y_m=0.0, length_m=1.0, width_m=4.0, height_m=HEIGHT)
FLEET = Fleet(NIGEL, 4)


def city(wind=None, **floor):
    whole = Floor(x_m=(-5.0, 5.0), y_m=(-5.0, 5.0), **floor)
    return CityMap(map=1, name="n", title="", source="", floor=whole, wind=wind or Wind(),
                   tag=MapTag(tag_id=0, size_m=0.1))  # fmt: skip


def felt(ground, x, y=0.0, yaw=0.0, stood_on=0.0):
    """Return (height, slope x, slope y, grip, rolling) of the rear left wheel of a car there."""
    for row in np.flatnonzero(FLEET.alive):
        FLEET.remove(int(row))
    half = 0.5 * NIGEL.value("body.track_m")
    pose = Pose2(x + half * math.sin(yaw), y - half * math.cos(yaw), yaw)
    row = FLEET.add(pose)
    FLEET.floor_height[row] = stood_on
    ground.feel(FLEET, 0)
    arrays = (FLEET.floor_height, FLEET.floor_slope_x, FLEET.floor_slope_y, FLEET.floor_grip,
              FLEET.floor_rolling)  # fmt: skip
    return [float(array[row, 2]) for array in arrays]


@pytest.mark.parametrize("before", [0.001, 0.005, 0.01, 0.015])
def test_a_wheel_before_an_edge_is_lifted_along_a_circle(before):
    height, slope, aside, *_ = felt(Ground(city(plates=(STEP,))), 1.0 - before)
    assert height == pytest.approx(HEIGHT - RADIUS + math.sqrt(RADIUS**2 - before**2), abs=1e-12)
    assert slope == pytest.approx(before / math.sqrt(RADIUS**2 - before**2), rel=1e-9)
    assert aside == pytest.approx(0.0, abs=1e-12)


def test_an_edge_out_of_the_wheels_reach_is_not_felt():
    begins = math.sqrt(2.0 * RADIUS * HEIGHT - HEIGHT**2)
    assert felt(Ground(city(plates=(STEP,))), 1.0 - begins - 1e-4)[0] == 0.0
    assert felt(Ground(city(plates=(STEP,))), 1.0 - begins + 1e-4)[0] > 0.0


def test_the_slope_is_the_gradient_of_the_height_also_aslant():
    ground = Ground(city(plates=(STEP,)))
    h, e = [], 1e-6
    for dx, dy in ((e, 0), (-e, 0), (0, e), (0, -e)):
        h.append(felt(ground, 0.99 + dx, 0.2 + dy, yaw=0.5)[0])
    _, slope_x, slope_y, *_ = felt(ground, 0.99, 0.2, yaw=0.5)
    assert slope_x == pytest.approx((h[0] - h[1]) / (2 * e), rel=1e-5)
    assert slope_y == pytest.approx((h[2] - h[3]) / (2 * e), abs=1e-6)


def test_on_a_ramp_the_slope_is_the_ramps_own():
    ramp = Ramp(name="r", x_m=1.0, y_m=0.0, length_m=2.0, width_m=2.0, to_m=0.2)
    height, slope, *_ = felt(Ground(city(ramps=(ramp,))), 1.0, stood_on=0.1)
    # A disc on a plane touches it uphill of its middle: it stands r (sqrt(1 + s^2) - 1) higher.
    assert height == pytest.approx(0.1 + RADIUS * (math.sqrt(1.01) - 1.0), abs=1e-12)
    assert slope == pytest.approx(0.1)


def test_ground_far_above_the_wheel_is_a_bridge_over_it():
    deck = Plate(name="deck", x_m=1.0, y_m=0.0, length_m=2.0, width_m=2.0, height_m=0.3)
    ground = Ground(city(plates=(deck,)))
    assert felt(ground, 1.0, stood_on=0.0)[0] == 0.0
    assert felt(ground, 1.0, stood_on=0.3)[0] == pytest.approx(0.3)


def test_patches_say_how_the_floor_holds_and_the_later_one_lies_on_top():
    ground = Ground(
        city(
            grip=0.9,
            patches=(
                Patch(name="a", x_m=0.0, y_m=0.0, length_m=1.0, width_m=1.0, grip=0.5, rolling=0.1),
                Patch(name="b", x_m=0.0, y_m=0.0, radius_m=0.2, grip=0.1),
                Patch(name="c", points=((2, 2), (3, 2), (2.2, 2.2), (2, 3)), grip=0.3),
            ),
        )
    )
    assert felt(ground, 0.3)[3:] == [0.5, 0.1]
    assert felt(ground, 0.1)[3:] == [0.1, 0.0]
    assert felt(ground, 0.6)[3:] == [0.9, 0.0]
    assert felt(ground, 2.1, 2.1)[3] == 0.3
    assert felt(ground, 2.5, 2.5)[3] == 0.9  # within its corners, but outside
    assert felt(ground, 4.9)[3] == 0.9


def test_a_friction_map_is_read_with_north_up_and_between_pixels():
    city_map = load_map("proving_ground")
    ground = Ground(city_map)
    picture = city_map.floor.friction_map
    assert felt(ground, 4.5, 2.0)[3] == 1.0
    grips = [felt(ground, 0.1, y)[3] for y in np.linspace(0.0, 2.6, 27)]
    assert picture.grip[0] <= min(grips) < 0.5 < max(grips) <= 1.0


def test_a_hill_of_a_height_map_is_climbed_and_left_level():
    ground = Ground(load_map("proving_ground"))
    top = felt(ground, 1.75, 1.47, stood_on=0.03)
    assert top[0] == pytest.approx(0.035, abs=5e-4)
    assert felt(ground, 1.35, 0.8)[:3] == [0.0, 0.0, 0.0]
    assert felt(ground, 1.6, 1.47)[1] > 0.05


def test_a_plain_map_leaves_the_floor_alone():
    ground = Ground(city())
    assert ground.is_flat
    assert ground.has_no_wind
    assert felt(ground, 0.0, stood_on=0.123)[0] == 0.123


def test_gusts_have_the_strength_and_the_length_they_are_said_to_have():
    wind = Wind(x_mps=1.0, y_mps=-2.0, gust_mps=0.5, gust_s=2.0)
    times = np.arange(0, 4000, 0.5)
    ground = Ground(city(wind=wind), seed=3)
    row = FLEET.add(Pose2(0, 0, 0))
    speeds = []
    for t in times:
        ground.feel(FLEET, int(t * NS_PER_S))
        speeds.append((FLEET.air_x[row], FLEET.air_y[row]))
    x, y = np.array(speeds).T
    FLEET.remove(row)
    assert_allclose([x.mean(), y.mean()], [1.0, -2.0], atol=0.1)
    assert_allclose([x.std(), y.std()], [0.5, 0.5], rtol=0.1)
    later = np.corrcoef(x[:-4], x[4:])[0, 1]  # two seconds
    assert later == pytest.approx(math.exp(-1.0), abs=0.12)


def test_everybody_with_the_same_seed_feels_the_same_gust():
    wind = Wind(gust_mps=0.5)
    felt_by = []
    for seed in (1, 1, 2):
        Ground(city(wind=wind), seed).feel(FLEET, 123_456_789)
        felt_by.append(float(FLEET.air_x[0]))
    assert felt_by[0] == felt_by[1] != felt_by[2]
