"""Networks that SUMO's own tools make become cities that cars can drive."""

import itertools
import math
import re
from collections import Counter

import msgspec
import numpy as np
import pytest

from scm.__main__ import main
from scm.errors import MapError
from scm.maps.check import problems_of
from scm.maps.conflicts import conflicting_groups
from scm.maps.load import load_map
from scm.maps.polyline import extent
from scm.maps.route import Roads
from scm.maps.sumo import LEAST_RADIUS_M, MAX_FIT_ERROR_M, import_sumo
from scm.maps.sumo_program import stages_of
from scm.maps.sumo_read import NetPhase
from scm.maps.sumo_toml import map_toml
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.traffic.signals.custom_plans import adopted
from scm.traffic.signals.part import TrafficPart
from scm.v2x.etsi.topology import mapem_of
from scm.v2x.messages.route_request import RouteRequest
from scm.v2x.messages.spat import Spat
from scm.world.driving import send
from scm.world.part import WorldPart
from tests.unit.maps.sumo_nets import OSM, grid, made, stadium, tee

CARS = 8
SPAN_S = 30.0
BESIDE_CAR_M = 0.0219  # a lane of 0.2186 m leaves that on each side of a Nigel of 0.175 m

NETS = {
    "grid": ("netgenerate", "--grid", "--grid.number", "3", "--grid.length", "56"),
    "lights": ("netgenerate", "--grid", "--grid.number", "3", "--grid.length", "56",
               "--default-junction-type", "traffic_light"),
    "spider": ("netgenerate", "--spider", "--spider.arm-number", "5", "--spider.circle-number",
               "2", "--spider.space-radius", "60", "--spider.omit-center"),
    "random": ("netgenerate", "--rand", "--rand.iterations", "15", "--seed", "3"),
}  # fmt: skip


@pytest.fixture(scope="module", params=[*NETS, "osm", "opendrive"])
def net(request, tmp_path_factory):
    """A network file, of each kind."""
    folder = tmp_path_factory.mktemp(request.param)
    out = folder / "town.net.xml"
    if request.param in NETS:
        return made(*NETS[request.param], out=out)
    if request.param == "osm":
        source = folder / "town.osm"
        source.write_text(OSM)
        return made("netconvert", "--osm-files", str(source), out=out)
    source = folder / "town.xodr"
    source.write_text(stadium())
    return made("netconvert", "--opendrive-files", str(source), out=out)


@pytest.fixture(scope="module")
def imported(net):
    return import_sumo(net)


def test_the_map_checks_find_nothing(imported):
    assert problems_of(imported.city_map) == []


def test_no_arc_is_tighter_than_a_nigel_steers(imported):
    radii = [
        segment.radius_m
        for lane in imported.city_map.lanes
        for segment in lane.segments
        if segment.radius_m is not None
    ]
    assert min(radii, default=math.inf) >= LEAST_RADIUS_M
    assert min(radii, default=math.inf) == pytest.approx(imported.tightest_m)


def test_its_map_file_reads_back_equal(imported, tmp_path):
    path = tmp_path / "town.toml"
    path.write_text(map_toml(imported.city_map), encoding="utf-8")
    assert load_map(path) == imported.city_map


def test_cars_go_round_in_their_lanes(imported):
    city_map, _ = adopted(imported.city_map)
    part = WorldPart(city_map, room=CARS)
    part.attach(lambda _kind, _where: False)
    world = part.world
    streets, spawns = world.drivers.lane_graph, city_map.spawns
    places = [s for s in spawns if streets.goes_round[streets.numbers[s.lane]]]
    count = min(CARS, len(places))
    for i in range(count):
        pose = world.roads.spawn_pose(places[i * len(places) // count].name)
        car = world.host(f"n{i}", "nigel", pose, 0)
        send(world, car, RouteRequest(vehicle=car.name), 0)
    worst, way = np.zeros(count), np.zeros(count)
    parts = [part, TrafficPart(city_map)] if city_map.junctions else [part]
    with Lockstep(parts) as city:
        for _ in range(round(SPAN_S / 0.2)):
            city.run_for(0.2)
            worst = np.maximum(worst, np.abs(world.drivers.cross_track[:count]))
            way += 0.2 * np.abs(world.cars.arrays.speed[:count])
    assert worst.max() < BESIDE_CAR_M
    assert way.min() > 0.3
    assert way.max() > 6.0


@pytest.fixture(scope="module")
def one_approach_at_a_time(tmp_path_factory):
    """A grid of SUMO whose lights serve single approaches."""
    out = tmp_path_factory.mktemp("incoming") / "g.net.xml"
    return import_sumo(grid(out, "traffic_light", "--tls.layout", "incoming"))


@pytest.fixture(scope="module")
def osm_city(tmp_path_factory):
    folder = tmp_path_factory.mktemp("osm")
    source = folder / "town.osm"
    source.write_text(OSM)
    net = made("netconvert", "--osm-files", str(source), out=folder / "o.net.xml")
    return import_sumo(net).city_map


def test_a_signal_program_of_the_network_runs_at_its_junction(one_approach_at_a_time, tmp_path):
    imported = one_approach_at_a_time
    city, why_not = adopted(imported.city_map)
    assert (imported.unread, why_not) == ({}, {})
    assert {junction.plan for junction in city.junctions} == {"own"}
    path = tmp_path / "town.toml"
    path.write_text(map_toml(city), encoding="utf-8")
    with Lockstep([TrafficPart(load_map(path))]) as lockstep:
        spats = lockstep.subscribe(Subscription(Spat, {"junction": "b1"}))
        lockstep.run_for(200.0)
        published = [item.message for item in spats.drain()]
    greens = [tuple(g.group for g in spat.groups if g.colour == "green") for spat in published]
    runs = [(groups, len(list(run))) for groups, run in itertools.groupby(greens) if groups]
    assert {spat.plan for spat in published} == {"own"}
    stages = next(j for j in city.junctions if j.name == "b1").stages
    assert [groups for groups, _ in runs[: len(stages)]] == [stage.groups for stage in stages]
    for (_, steps), stage in zip(runs, stages, strict=False):
        assert steps / 10.0 == pytest.approx(stage.green_s, abs=0.11)


def test_a_signal_program_that_lets_ways_cross_is_left_out_and_says_why(tmp_path):
    out = tmp_path / "g.net.xml"
    imported = import_sumo(grid(out, "traffic_light", "--tls.layout", "opposites"))
    city, why_not = adopted(imported.city_map)
    assert imported.unread.keys() | why_not.keys() == {j.name for j in city.junctions}
    assert "conflict but share a stage" in why_not["b1"]
    assert "for some ways of lane 'A0A1_0' alone" in imported.unread["a1"]
    assert {junction.plan for junction in city.junctions} == {"calm"}
    TrafficPart(city)


@pytest.mark.parametrize(
    ("phases", "expected"),
    [
        ([(9, "Gr"), (3, "yr"), (5, "rG"), (4, "rg"), (3, "ry")], [("a", 9), ("b", 9)]),
        ([(2, "Gr"), (3, "yr"), (5, "rG"), (3, "ry"), (4, "Gr")], [("a", 6), ("b", 5)]),
        ([(9, "GG"), (2, "rr")], [("ab", 9)]),
        ([(9, "GG"), (3, "yG"), (5, "rG"), (3, "ry")], [("ab", 9), ("b", 5)]),
        ([(9, "Gr"), (3, "yr"), (1, "ru"), (5, "rG"), (3, "ry"), (1, "ur")], [("a", 9), ("b", 5)]),
        ([(9, "Gs"), (3, "Yr"), (5, "sg"), (3, "rY")], [("a", 9), ("b", 5)]),
    ],
)
def test_phases_become_stages(phases, expected):
    stages = stages_of([NetPhase(s, lights) for s, lights in phases], {"a": [0], "b": [1]})
    assert [("".join(stage.groups), stage.green_s) for stage in stages] == expected


@pytest.mark.parametrize(
    ("lights", "words"), [("oo", "blinks for lane 'a'"), ("rr", "no phase"), ("", "no phase")]
)
def test_phases_that_cannot_be_shown_are_refused(lights, words):
    phases = [NetPhase(9.0, lights)] if lights else []
    with pytest.raises(MapError, match=words):
        stages_of(phases, {"a": [0], "b": [1]})


def test_a_green_of_the_network_too_short_for_our_cars_is_refused(one_approach_at_a_time):
    imported = one_approach_at_a_time
    first = imported.city_map.junctions[0]
    short = tuple(msgspec.structs.replace(stage, green_s=1.0) for stage in first.stages)
    junctions = (msgspec.structs.replace(first, stages=short), *imported.city_map.junctions[1:])
    city, why_not = adopted(msgspec.structs.replace(imported.city_map, junctions=junctions))
    assert list(why_not) == [first.name]
    assert "green 1.0 s, expected at least" in why_not[first.name]
    assert [j.plan for j in city.junctions] == ["calm", *["own"] * (len(city.junctions) - 1)]


@pytest.mark.parametrize(
    ("kind", "signs"),
    [
        ("traffic_light", {}),
        ("right_before_left", {}),
        ("priority", {"give_way": 5}),
        ("priority_stop", {"stop": 5}),
        ("allway_stop", {"stop": 16}),
    ],
)
def test_kinds_of_junctions_become_signals_or_signs(tmp_path, kind, signs):
    city = import_sumo(grid(tmp_path / "g.net.xml", kind)).city_map
    lit = kind == "traffic_light"
    assert len(city.junctions) == (5 if lit else 0)
    assert len(city.crossings) == (0 if lit else 5)
    found = Counter(sign.kind for sign in city.signs)
    assert set(found) == set(signs)
    for name, least in signs.items():
        assert found[name] >= least
    for group in (g for junction in city.junctions for g in junction.groups):
        assert len([line for line in city.stop_lines if line.group == group.name]) == 1


def test_signals_of_osm_are_imported(osm_city):
    assert [len(junction.groups) for junction in osm_city.junctions] == [4]


def test_lengths_follow_the_scale_and_speeds_the_car(tmp_path):
    net = grid(tmp_path / "g.net.xml", "priority", "--default.speed", "10")
    for scale in (10.0, 14.0):
        city = import_sumo(net, scale=scale).city_map
        lane = next(lane for lane in city.lanes if lane.name == "A1B1_0")
        way = next(lane for lane in city.lanes if lane.name == "A1B1_0..B1C1_0")
        after = next(lane for lane in city.lanes if lane.name == "B1C1_0")
        start_m, end_m = lane.start[0], after.start[0] + extent(after.segments[0])[0]
        assert end_m - start_m == pytest.approx((2 * 56 - 2 * 7.2) / scale, abs=0.5)
        assert lane.width_m == pytest.approx(3.2 / scale - 0.01, abs=1e-4)
        assert lane.speed_limit_mps == way.speed_limit_mps == 0.25


def test_a_slower_street_keeps_its_share_of_the_limit(osm_city):
    limits = {round(lane.speed_limit_mps, 3) for lane in osm_city.lanes}
    assert sorted(limits) == pytest.approx([0.15, 0.25], abs=2e-4)


def test_a_bent_street_stays_close_to_the_network(tmp_path):
    source = tmp_path / "ring.xodr"
    source.write_text(stadium())
    net = made("netconvert", "--opendrive-files", str(source), out=tmp_path / "r.net.xml")
    imported = import_sumo(net)
    assert imported.error_m < MAX_FIT_ERROR_M
    bend = max(imported.city_map.lanes, key=lambda lane: len(lane.segments))
    turned = sum(length * curvature for length, curvature in map(extent, bend.segments))
    assert abs(turned) > 2.5


def test_the_floor_decides_the_scale_or_refuses_it(tmp_path):
    net = grid(tmp_path / "g.net.xml", "priority")
    fitted = import_sumo(net, floor_m=(9.5, 10.5))
    low, high = fitted.city_map.floor.x_m
    assert high - low == pytest.approx(9.5)
    xs = [lane.start[0] for lane in fitted.city_map.lanes]
    assert low + 0.4 < min(xs)
    assert max(xs) < high - 0.4
    with pytest.raises(MapError, match=r"does not fit 6 x 4 m; expected a scale of 1:3"):
        import_sumo(net, scale=14.0, floor_m=(6.0, 4.0))


@pytest.mark.parametrize(
    ("scale", "words"),
    [(20.0, r"0\.160 m wide at 1:20; expected at least 0\.2 m .* 1:16\.0")],
)
def test_a_network_too_narrow_for_the_car_is_refused(tmp_path, scale, words):
    net = grid(tmp_path / "g.net.xml", "priority")
    with pytest.raises(MapError, match=words):
        import_sumo(net, scale=scale)


def test_a_network_too_tight_for_the_car_is_refused(tmp_path):
    net = made("netgenerate", "--grid", "--grid.number", "3", "--grid.length", "12",
               "--default.junctions.radius", "0.5", out=tmp_path / "t.net.xml")  # fmt: skip
    with pytest.raises(MapError, match=r"too tight at 1:14: at junction '.*' .* at least 0\.38 m"):
        import_sumo(net)


def test_other_files_are_refused_with_what_to_do(tmp_path):
    for name, words in (("a.osm", "netconvert --osm-files"), ("b.net.xml", "lanes for cars")):
        path = tmp_path / name
        path.write_text('<net version="1.0"/>' if name.endswith(".net.xml") else "<osm/>")
        with pytest.raises(MapError, match=words):
            import_sumo(path)
    with pytest.raises(MapError, match="no such file"):
        import_sumo(tmp_path / "c.net.xml")


def test_a_missing_library_is_named(tmp_path, monkeypatch):
    path = tmp_path / "b.net.xml"
    path.write_text("<net/>")
    monkeypatch.setitem(__import__("sys").modules, "sumolib", None)
    with pytest.raises(MapError, match=r"scm\[sumo\]"):
        import_sumo(path)


def town(tmp_path, *phases, scale=10.0, **network):
    """Import what `tee` describes; programs that the kernel accepts are adopted."""
    path = tmp_path / "t.net.xml"
    path.write_text(tee(phases, **network), encoding="utf-8")
    imported = import_sumo(path, scale=scale)
    city, why_not = adopted(imported.city_map)
    return city, imported, imported.unread | why_not


TWO_GREENS = (20, "Gr"), (3, "yr"), (20, "rG"), (3, "ry")


def test_a_turn_free_of_the_light_beside_it_gets_a_light_where_it_meets_others(tmp_path):
    city, _, why_not = town(tmp_path, *TWO_GREENS)
    (junction,) = city.junctions
    assert {group.name for group in junction.groups} == {"S2C_0", "S2C_1", "W2C_0"}
    assert frozenset({"S2C_0", "W2C_0"}) in conflicting_groups(junction, Roads(city))
    assert [set(stage.groups) for stage in junction.stages] == [{"S2C_0", "S2C_1"}, {"W2C_0"}]
    assert (junction.plan, why_not) == ("own", {})


def test_two_lights_at_one_junction_are_one_junction_without_a_program(tmp_path):
    city, _, why_not = town(tmp_path, *TWO_GREENS, lights=["C", "D"])
    assert [len(junction.groups) for junction in city.junctions] == [3]
    assert "several lights" in why_not[city.junctions[0].name]


def test_a_light_that_is_off_is_signs(tmp_path):
    city, _, _ = town(tmp_path, (90, "Oo"))
    assert city.junctions == ()
    assert [len(crossing.approaches) for crossing in city.crossings] == [3]
    assert [(sign.kind, sign.lane) for sign in city.signs] == [
        ("give_way", "W2C_0"), ("give_way", "S2C_0"),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("phases", "words"),
    [
        ([(20, "G"), (20, "r")], "light 'C': phase 1, state 'G': expected a letter for each link"),
        ([(20, "Gr"), (20, "xG")], "light 'C': phase 2, state 'xG': expected letters of .*'x'"),
        ([(-1, "Gr"), (20, "rG")], "light 'C': phase 1, .*duration: expected .* got -1"),
    ],
)
def test_a_program_that_says_nothing_of_a_link_is_refused_by_the_lights_name(
    tmp_path, phases, words
):
    with pytest.raises(MapError, match=words):
        town(tmp_path, *phases)


@pytest.mark.parametrize(
    ("phases", "words"),
    [
        ([(1e6, "Gr"), (20, "rG")], "got 1e.06, expected 0 to 300 s"),
        ([(200, "Gr"), (200, "rG")], "cycle: got .* expected 300 s at most"),
        ([(20, "Gr", "0"), (20, "rG", "0")], "not followed by the one after it"),
    ],
)
def test_a_program_beyond_the_limits_of_peoples_plans_is_left_out(tmp_path, phases, words):
    city, _, why_not = town(tmp_path, *phases)
    (junction,) = city.junctions
    assert junction.plan == "calm"
    assert re.search(words, why_not[junction.name])


def test_ids_of_any_script_are_names_each_of_its_own(tmp_path):
    city, imported, _ = town(tmp_path, *TWO_GREENS, edges="запад a/b a%2Fb दिल्ली")
    streets = [lane.name for lane in city.lanes if ".." not in lane.name]
    assert streets == ["запад_0", "a%2Fb_0", "a%2Fb_1", "a%252Fb_0", "दिल्ली_0"]
    assert imported.renamed == {"a/b": "a%2Fb", "a%2Fb": "a%252Fb"}
    path = tmp_path / "t.toml"
    path.write_text(map_toml(city), encoding="utf-8")
    assert load_map(path) == city
    lanes = mapem_of(Roads(city), city.junctions[0]).intersections[0].lane_set
    assert {lane.name for lane in lanes} == {None, "a%2Fb_0", "a%2Fb_1", "a%252Fb_0"}


def test_a_left_hand_network_has_its_signs_and_lights_on_the_left(tmp_path):
    kinds = {"lights": "traffic_light", "signs": "allway_stop"}
    for name, kind in kinds.items():
        out = tmp_path / f"{name}.net.xml"
        city = import_sumo(grid(out, kind, "--lefthand", "true")).city_map
        assert city.drives_on == "left"
        assert problems_of(city) == []
        assert not any(lane.name == "A1B1_0..B1A1_0" for lane in city.lanes)
        roads = Roads(city)
        lines = [(light, light.group) for light in city.lights]
        for post, lane in [*lines, *((sign, sign.lane) for sign in city.signs)]:
            assert roads.lane(lane).project(post.x_m, post.y_m)[1] > 0.1


def test_streets_that_cross_without_a_junction_are_refused(tmp_path):
    with pytest.raises(
        MapError, match=r"cars would touch at 1:10.*'W2C_0' and 'S2C_[01]' .* 0.0 mm"
    ):
        town(tmp_path, west="0,20 90,20 56,58.4")


def test_a_lane_without_a_speed_is_refused(tmp_path):
    path = tmp_path / "t.net.xml"
    path.write_text(tee().replace('speed="13.9"', 'speed="0"', 1))
    with pytest.raises(MapError, match="lane 'W2C_0': expected a speed and a width, got 0 m/s"):
        import_sumo(path)


def test_sizes_are_known_before_anything_is_computed(tmp_path):
    path, lines = tmp_path / "t.net.xml", []
    path.write_text(tee())
    with pytest.raises(MapError, match="wide at 1:20"):
        import_sumo(path, scale=20.0, report=lines.append)
    assert lines[0] == "120 x 120 m at full size; at 1:20 a floor of some 7 x 7 m"
    assert lines[1] == "5 lanes, 3 ways over junctions"


def test_what_cannot_be_imported_leaves_the_file_as_it_was(tmp_path, capsys):
    net, out = tmp_path / "t.net.xml", tmp_path / "city.toml"
    net.write_text(tee([(20, "G")]))
    out.write_text("before")
    assert main(["import", "sumo", str(net), "--out", str(out)]) == 2
    assert out.read_text() == "before"
    net.write_text(tee())
    assert main(["import", "sumo", str(net), "--scale", "10", "--out", str(tmp_path)]) == 2
    assert "cannot be written" in capsys.readouterr().err


def test_the_command_writes_a_map_that_can_be_shown(tmp_path, capsys):
    net = grid(tmp_path / "g.net.xml", "traffic_light")
    out, picture = tmp_path / "city.toml", tmp_path / "city.svg"
    assert main(["import", "sumo", str(net), "--out", str(out)]) == 0
    output = capsys.readouterr().out
    assert "5 junctions with signals" in output
    assert "signal programs kept at 0 of 5 junctions" in output
    assert "a1, b0, b2, c1 (4) run plan 'calm' instead; at 'a1': phase " in output
    assert "b1 runs plan 'calm' instead: plan 'own': " in output
    assert output.count("instead") == 2
    assert "--tls.layout incoming" in output
    assert "left out where no ways of cars meet: traffic lights A0, A2, C0, C2" in output
    assert "turns back left out" in output
    assert main(["show", "map", str(out), "--out", str(picture)]) == 0
    assert "<svg" in picture.read_text()
