"""Signs and crossings: what a map may say of them, and what it means for routes and speeds."""

import msgspec
import pytest

from scm.errors import MapError
from scm.maps.check import problems_of
from scm.maps.draw import draw_svg
from scm.maps.grid_city import grid_city
from scm.maps.load import load_map
from scm.maps.route import Path, Roads
from scm.records.city_map import Sign
from scm.vehicles.drivers.lane_graph import LIMIT, LaneGraph
from scm.vehicles.drivers.rules import PLAIN, STOP_SIGN

STREET = "j0_1_e"
LINE_M = 4.0 - 2 * 0.54 - 0.14


@pytest.fixture(scope="module")
def signed():
    return grid_city(3, 3, signs=True)


def with_signs(city, *signs):
    posts = []
    for number, sign in enumerate(signs, start=901):
        place = {"lane": STREET, "at_m": 1.0, "x_m": 0.0, "y_m": 0.0, "yaw_rad": 0.0, **sign}
        posts.append(Sign(sign_id=number, **place))
    return msgspec.structs.replace(city, signs=(*city.signs, *posts))


def problems(city):
    return "\n".join(problems_of(city))


@pytest.mark.parametrize("size", [(2, 2), (2, 4), (4, 3)])
def test_nothing_is_wrong_with_a_city_of_signs(size):
    city = grid_city(*size, signs=True)
    assert problems_of(city) == []
    assert not city.junctions
    assert len(city.crossings) == size[0] * size[1] - 4


def test_a_city_of_signs_is_loaded_by_name():
    assert load_map("grid:3x4:5:signs") == grid_city(3, 4, block_m=5.0, signs=True)
    assert load_map("grid:3x2:signs") == grid_city(3, 2, signs=True)


def test_maps_without_lanes_for_their_signs_load_as_before():
    school = load_map("driving_school")
    assert {sign.lane for sign in school.signs} == {None}
    assert Roads(school).signs == {}


@pytest.mark.parametrize(
    ("sign", "words"),
    [
        ({"kind": "stopp"}, "did you mean 'stop'?"),
        ({"kind": "speed_limit"}, "value_mps: expected a speed, got None"),
        ({"kind": "stop", "value_mps": 0.2, "at_m": LINE_M}, "expected none for stop, got 0.2"),
        ({"kind": "speed_limit", "value_mps": -1.0}, "value_mps: expected more than 0, got -1.0"),
        ({"kind": "no_left", "at_m": None}, "expected lane and at_m together or neither"),
        ({"kind": "no_left", "lane": "j0_1_f"}, "no lane 'j0_1_f' (did you mean"),
        ({"kind": "no_left", "at_m": 9.0}, "at_m: expected 0 to 2.9200"),
        ({"kind": "give_way", "at_m": 0.5}, "expected a line within 0.5 m of at_m = 0.5"),
    ],
)
def test_a_wrong_sign_is_refused_with_its_key(signed, sign, words):
    assert words in problems(with_signs(signed, sign))


def test_turn_signs_that_leave_no_way_are_refused(signed):
    message = problems(with_signs(signed, {"kind": "only_left"}, {"kind": "no_left"}))
    assert "signs (901, 902): only_left and no_left leave no way from lane 'j0_1_e'" in message


def change(city, number, **changes):
    first, *others = city.crossings[number].approaches
    approach = msgspec.structs.replace(first, **changes)
    crossing = msgspec.structs.replace(city.crossings[number], approaches=(approach, *others))
    crossings = [*city.crossings]
    crossings[number] = crossing
    return msgspec.structs.replace(city, crossings=tuple(crossings))


def test_a_wrong_crossing_is_refused_with_its_key(signed):
    ways = signed.crossings[1].approaches[0].ways
    assert "crossings[0] (j1_0).approaches[0]" in problems(change(signed, 0, lane="j0_1_x"))
    assert "at_m: expected 0 to 2.9200" in problems(change(signed, 0, at_m=4.0))
    assert "does not follow lane" in problems(change(signed, 0, ways=ways))
    assert "ways: expected at least one" in problems(change(signed, 0, ways=()))
    alone = msgspec.structs.replace(
        signed.crossings[0], approaches=signed.crossings[0].approaches[:1]
    )
    lonely = msgspec.structs.replace(signed, crossings=(alone, *signed.crossings[1:]))
    assert "approaches: expected at least 2, got 1" in problems(lonely)


@pytest.mark.parametrize(
    ("kind", "left"),
    [
        ("no_left", {"ee", "es"}),
        ("no_right", {"ee", "en"}),
        ("no_straight", {"en", "es"}),
        ("only_left", {"en"}),
        ("only_straight", {"ee"}),
        ("only_right", {"es"}),
    ],
)
def test_turn_signs_take_lanes_out_of_routes_and_circulation(signed, kind, left):
    roads = Roads(with_signs(signed, {"kind": kind}))
    names = {f"j1_1_{way}" for way in left}
    assert set(roads.successors(STREET)) == names
    lane_graph = LaneGraph(roads)
    first, last = lane_graph.arrays.next_first[lane_graph.numbers[STREET] :][:2]
    assert {lane_graph.names[n] for n in lane_graph.arrays.following[first:last]} == names
    forbidden = ({"j1_1_ee", "j1_1_en", "j1_1_es"} - names).pop()
    assert forbidden not in roads.route(STREET, ("j1_1_n",))
    with pytest.raises(MapError, match="does not follow"):
        Path(roads, (STREET, forbidden))


def test_a_speed_limit_holds_from_its_sign_to_the_end_of_the_lane(signed):
    roads = Roads(with_signs(signed, {"kind": "speed_limit", "value_mps": 0.1}))
    path = Path(roads, (STREET, "j1_1_ee"))
    assert [path.speed_limit_mps(s) for s in (0.9, 1.1, 2.9, 3.0)] == [0.25, 0.1, 0.1, 0.25]
    lane_graph = LaneGraph(roads)
    ways, lane = lane_graph.arrays, lane_graph.numbers[STREET]
    rows = ways.segments[ways.segment_first[lane] : ways.segment_first[lane + 1]]
    assert rows[:, LIMIT].tolist() == [0.25, 0.1]
    assert rows[:, 1].tolist() == pytest.approx([1.0, 1.92])


def test_a_sign_without_a_lane_holds_for_the_cars_it_looks_at(signed):
    place = Roads(signed).lane(STREET).at(2.5)
    post = {"x_m": place.x, "y_m": place.y - 0.2, "yaw_rad": 3.14159, "lane": None, "at_m": None}
    roads = Roads(with_signs(signed, {"kind": "no_left", **post}))
    assert [held.lane for held in roads.signs[STREET]] == [STREET]
    assert "j1_1_en" not in roads.successors(STREET)


def test_a_line_asks_for_what_its_sign_says(signed):
    kinds = {}
    lane_graph = LaneGraph(Roads(signed))
    rules, ways = lane_graph.arrays.rules, lane_graph.arrays
    for lane, first, last in zip(
        lane_graph.names, ways.line_first, ways.line_first[1:], strict=False
    ):
        if last > first:
            kinds[lane] = rules.kind[first], bool(rules.all_stop[first])
    assert kinds["j0_0_e"][0] == PLAIN  # a through road: who comes from the side gives way
    assert kinds["j1_1_e"][0] == STOP_SIGN
    assert kinds["j1_1_e"][1]
    assert kinds["j0_1_e"] == (PLAIN, False)


def test_lines_and_signs_are_in_the_picture(signed):
    city = with_signs(signed, {"kind": "speed_limit", "value_mps": 0.15}, {"kind": "only_left"})
    picture = draw_svg(city)
    assert picture.count('class="stop-line"') == sum(sign.kind == "stop" for sign in signed.signs)
    assert picture.count('class="give-way-line"') > 0
    assert ">.15<" in picture
    assert 'class="sign only_left"' in picture
