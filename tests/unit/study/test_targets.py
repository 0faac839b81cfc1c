"""A factor's path leads to one number of the map, a car, the network, or to an argument."""

import inspect
import math

import pytest

from scm.errors import StudyError
from scm.maps.load import load_map
from scm.maps.route import Roads
from scm.study.study_file import Factor
from scm.study.targets import Setting, axes_of, checked_map, targets_of
from scm.vehicles.car import load_car, varied_cars
from scm.world.part import WorldPart

BASE = Setting(load_map("parking_school_obstacles"))
TOWN = Setting(load_map("driving_school"))


def put(path, value, base=TOWN, **how):
    (axis,) = axes_of({path: Factor(values=(value,), **how)}, base, {})
    return axis, axis.put(base, value)


@pytest.mark.parametrize(
    ("path", "complete", "value", "found"),
    [
        ("radio.loss", "radio.loss", 0.3, lambda m: m.radio.loss),
        ("radio.delay", "radio.delay_ms", 20.0, lambda m: m.radio.delay_ms),
        ("wind.x", "wind.x_mps", 0.5, lambda m: m.wind.x_mps),
        ("floor.grip", "floor.grip", 0.8, lambda m: m.floor.grip),
        ("junctions.crossing.plan", None, "brisk", lambda m: m.junctions[0].plan),
        ("junctions.0.plan", "junctions.crossing.plan", "brisk", lambda m: m.junctions[0].plan),
        ("cameras.0.tilt_x", "cameras.overhead.tilt_x_rad", 0.1, lambda m: m.cameras[0].tilt_x_rad),
        ("lights.1.yaw", None, 1.0, lambda m: m.lights[1].yaw_rad),
        ("lanes.east_loop.speed_limit", None, 0.2, lambda m: m.lanes[0].speed_limit_mps),
    ],
)
def test_a_path_sets_a_field_of_the_map(path, complete, value, found):
    if path.startswith("lanes"):
        index = [lane.name for lane in TOWN.city_map.lanes].index("east_loop")
        axis, changed = put(path, value)
        assert changed.city_map.lanes[index].speed_limit_mps == value
        return
    axis, changed = put(path, value)
    assert found(changed.city_map) == value
    assert found(TOWN.city_map) != value
    if complete:
        assert axis.path == complete


def test_added_and_scaled_values_start_from_the_file_s():
    mass = load_car("nigel").value("body.mass_kg")
    for apply, value in (("set", 3.0), ("add", 3.0 - mass), ("scale", 3.0 / mass)):
        _, changed = put("cars.nigel.body.mass", value, apply=apply)
        assert changed.car("nigel").value("body.mass_kg") == pytest.approx(3.0)


def test_a_star_sets_all_to_one_value_and_each_makes_a_factor_of_each():
    factor = Factor(values=(0.1,), apply="add")
    (axis,) = axes_of({"boxes.*.x": factor}, BASE, {})
    assert axis.path == "boxes.*.x_m"
    moved = axis.put(BASE, 0.1).city_map.boxes
    for before, after in zip(BASE.city_map.boxes, moved, strict=True):
        assert after.x_m == pytest.approx(before.x_m + 0.1)
    each = axes_of({"boxes.*.x": Factor(values=(0.1,), each=True)}, BASE, {})
    assert [axis.path for axis in each] == [f"boxes.{box.name}.x_m" for box in BASE.city_map.boxes]


def test_a_wall_is_turned_about_its_middle_and_shifted():
    _, turned = put("walls.0.yaw", math.pi / 2.0, BASE)
    before, after = BASE.city_map.walls[0].points, turned.city_map.walls[0].points
    for (x, y), (u, v) in zip(before, after, strict=True):
        middle = [sum(p[i] for p in before) / len(before) for i in (0, 1)]
        assert u - middle[0] == pytest.approx(-(y - middle[1]))
        assert v - middle[1] == pytest.approx(x - middle[0])
    _, shifted = put("walls.0.y_m", 0.02, BASE)
    assert shifted.city_map.walls[0].points[0][1] == pytest.approx(before[0][1] + 0.02)


def test_a_start_on_a_lane_becomes_a_pose():
    pose = Roads(TOWN.city_map).spawn_pose("a")
    _, changed = put("spawns.a.x", 0.01, apply="add")
    moved = Roads(changed.city_map).spawn_pose("a")
    assert moved.x == pytest.approx(pose.x + 0.01)
    assert (moved.y, moved.yaw) == pytest.approx((pose.y, pose.yaw))


def test_an_effect_that_a_car_lacks_is_added_with_its_number():
    assert "steer_trim" not in [term.name for term in load_car("nigel").terms]
    for path in ("cars.nigel.steering.trim_rad", "cars.nigel.steer_trim.trim"):
        axis, changed = put(path, 0.03)
        assert axis.path == "cars.nigel.steering.trim_rad"
        car = changed.car("nigel")
        assert "steer_trim" in [term.name for term in car.terms]
        assert car.value("steering.trim_rad") == 0.03


def test_sensors_numbers_vectors_and_words_of_a_car_are_factors():
    for key, value in (("lidar.noise_m", 0.02), ("lidar.rate_hz", 5.0), ("imu.latency_s", 0.1)):
        _, changed = put(f"cars.nigel.{key}", value)
        assert changed.car("nigel").value(key) == value
    axis, changed = put("cars.nigel.lidar.range_m.1", 6.0)
    assert axis.path == "cars.nigel.lidar.range_m.1"
    assert changed.car("nigel").vector("lidar.range_m")[1] == 6.0
    _, changed = put("cars.nigel.steering.geometry", "parallel")
    assert changed.car("nigel").text("steering.geometry") == "parallel"


def test_a_varied_car_is_what_the_world_and_its_sensors_load():
    _, changed = put("cars.nigel.body.mass_kg", 2.9)
    with varied_cars(changed.cars):
        world = WorldPart(TOWN.city_map, 0, (("n1", "nigel"),)).world
    assert world.cars.garage.car("nigel").value("body.mass_kg") == 2.9
    assert load_car("nigel").value("body.mass_kg") != 2.9


def test_the_network_s_faults_are_factors():
    axis, changed = put("network.late", 0.2)
    assert axis.path == "network.late"
    assert changed.network.late == 0.2


def test_the_light_and_plain_values_of_the_map_are_factors():
    _, changed = put("daylight.azimuth", 1.0)
    assert changed.daylight.azimuth == 1.0
    axis, changed = put("speed_advice", True)
    assert axis.path == "speed_advice"
    assert changed.city_map.speed_advice


def test_the_boundaries_of_a_car_s_numbers_and_their_stated_scatter_are_known():
    (mass,) = targets_of("cars.nigel.body.mass_kg", TOWN, {})
    car = load_car("nigel")
    assert mass.std == car.quantity("body.mass_kg").std
    assert mass.bounds == car.bounds("body.mass_kg")
    assert mass.nominal == car.value("body.mass_kg")


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        ("radoi.loss", 0.1, "did you mean 'radio'?"),
        ("radio.los", 0.1, "did you mean 'loss'?"),
        ("radio.loss", "much", "radio.loss: Expected float, got str"),
        ("walls.*.colour", 1.0, "no 'colour' there"),
        ("boxes.*.x", 1.0, "the map has none of these"),
        ("junctions.crosing.plan", "calm", "did you mean 'crossing'?"),
        ("junctions.crossing", 1.0, "expected one value there, got several"),
        ("lights.99.yaw", 1.0, "no '99'"),
        ("cars.nigle.body.mass", 1.0, "did you mean 'nigel'?"),
        ("cars.nigel.body", 1.0, "expected cars.CAR.SECTION.KEY"),
        ("cars.nigel.bodi.mass", 1.0, "did you mean 'body'?"),
        ("cars.nigel.body.mas_kg", 1.0, "did you mean 'mass_kg'?"),
        ("cars.nigel.body.mass_kg", -1.0, "got -1"),
        ("cars.nigel.lidar.range_m", 1.0, "cars.nigel.lidar.range_m.0 to"),
        ("cars.nigel.lidar.range_m.7", 1.0, "expected a number below 2"),
        ("network.drop", 1.5, "drop: expected 0 to 1, got 1.5"),
        ("daylight.elevation", 3.0, "expected 0.05 to 1.57 rad"),
        ("daylight.colour", 3.0, "no 'colour' there"),
        ("network.dorp", 0.5, "did you mean 'drop'?"),
        ("polcy", 1.0, "no such argument (did you mean 'policy'?)"),
    ],
)
def test_a_path_or_value_that_does_not_fit_is_refused_in_words(path, value, words):
    policy = inspect.Parameter("policy", inspect.Parameter.KEYWORD_ONLY, default="fixed")
    with pytest.raises(StudyError) as refused:
        axes_of({path: Factor(values=(value,))}, TOWN, {"policy": policy})
    assert words in str(refused.value)
    assert path in str(refused.value)


def test_a_map_that_factors_made_impossible_is_refused_with_the_reason():
    _, changed = put("lanes.east_loop.width", -0.1)
    with pytest.raises(StudyError, match=r"impossible map: .*width_m"):
        checked_map(changed)
