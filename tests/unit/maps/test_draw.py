import re
import xml.etree.ElementTree as ET

import msgspec
import numpy as np
import pytest

from scm.maps.draw import bounds, draw_svg
from scm.maps.load import load_map
from scm.maps.svg import lane_data, number
from scm.records.city_map import Lane, Segment

SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def city_map():
    return load_map("driving_school")


@pytest.fixture(scope="module")
def picture(city_map):
    return ET.fromstring(draw_svg(city_map))


def ids(picture):
    return [node.get("id") for node in picture.iter() if node.get("id")]


def test_the_view_holds_everything_in_metres_with_y_negated(city_map, picture):
    x, y, width, height = (float(part) for part in picture.get("viewBox").split())
    x_low, y_low, x_high, y_high = bounds(city_map)
    assert x <= x_low
    assert y <= -y_high
    assert x + width >= x_high
    assert y + height >= -y_low


def test_every_lamp_can_be_found_by_its_id(city_map, picture):
    found = set(ids(picture))
    for light in city_map.lights:
        for colour in ("red", "yellow", "green"):
            assert f"light-{light.light_id}-{colour}" in found


def test_no_id_is_given_twice(picture):
    assert len(ids(picture)) == len(set(ids(picture)))


def test_a_head_tells_its_junction_and_group_and_stands_in_its_place(picture):
    head = next(node for node in picture.iter() if node.get("id") == "light-1")
    assert (head.get("data-junction"), head.get("data-group")) == ("crossing", "south_east")
    assert head.get("transform").startswith("translate(1.204 -1.13)")


def test_spawns_are_drawn_on_request_only(city_map):
    assert 'id="spawn-a"' not in draw_svg(city_map)
    assert 'id="spawn-a"' in draw_svg(city_map, spawns=True)


def texts(picture, layer):
    """Return the texts of a layer, and the turn of each [deg], + = against the clock."""
    (group,) = (node for node in picture.iter(f"{SVG}g") if node.get("class") == layer)
    turns = [re.search(r"rotate\((\S+)\)", node.get("transform")) for node in group]
    return {
        node.text: -float(turn[1]) if turn else 0.0 for node, turn in zip(group, turns, strict=True)
    }


def test_names_of_lanes_and_junctions_are_written_on_request_along_their_lanes(city_map):
    named = ET.fromstring(draw_svg(city_map, names=True))
    lanes = texts(named, "lane-names")
    assert list(lanes) == [lane.name for lane in city_map.lanes]
    # One straight runs south east and the other south west: both are read from the left.
    assert lanes["crossing_south_east"] == pytest.approx(-45.0, abs=10.0)
    assert lanes["crossing_south_west"] == pytest.approx(45.0, abs=10.0)
    assert texts(named, "junction-names") == {"crossing": 0.0}
    assert "lane-names" not in draw_svg(city_map)


def test_names_keep_clear_of_each_other_and_of_spawn_places():
    named = ET.fromstring(draw_svg(load_map("market_town"), names=True, spawns=True))
    centres = []
    for node in named.iter(f"{SVG}text"):
        if node.get("paint-order") or node.get("fill") == "#d8eeff":
            found = re.match(r"translate\((\S+) (\S+)\)", node.get("transform"))
            centres.append([float(found[1]), float(found[2])])
    away = np.hypot(*(np.array(centres)[:, None] - np.array(centres)).transpose(2, 0, 1))
    assert len(centres) == 18 + 2 + 12
    assert away[np.triu_indices(len(away), 1)].min() > 0.07


def test_a_strict_content_policy_may_show_it(picture):
    for node in picture.iter():
        assert node.tag not in {f"{SVG}script", f"{SVG}style"}
        assert "style" not in node.attrib
        assert not any(key.endswith("href") for key in node.attrib)


def test_text_from_the_map_is_escaped(city_map):
    drawn = draw_svg(msgspec.structs.replace(city_map, title="a <b> & c"))
    assert "a &lt;b&gt; &amp; c" in drawn


def test_a_left_arc_runs_against_the_clock():
    left = Segment(radius_m=1.0, angle_rad=1.5707963)
    lane = Lane(name="l", width_m=0.2, start=(0.0, 0.0, 0.0), segments=(left,), speed_limit_mps=1.0)
    assert lane_data(lane) == "M0 0A1 1 0 0 0 1 -1"


def test_numbers_are_short_and_never_minus_zero():
    assert [number(v) for v in (1.0, -0.00001, 0.12345, 100.0)] == ["1", "0", "0.1235", "100"]
