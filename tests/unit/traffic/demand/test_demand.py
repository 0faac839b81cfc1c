"""Cars come when a table wants them, wait where there is no room, drive and leave."""

import itertools
import math
from pathlib import Path

import msgspec
import pytest

from scm.maps.grid_city import grid_city
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.traffic.demand.part import DemandPart, Ways
from scm.traffic.demand.table import DemandError, Flow, departures, load_demand, seconds_of_day
from scm.v2x.messages.world_snapshot import WorldSnapshot
from scm.world.part import WorldPart

CITY = grid_city(2, 2)


def table(folder: Path, text: str, name: str = "d.csv") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_csv_and_toml_say_the_same(tmp_path):
    rows = table(
        tmp_path, "from,to,vehicles_per_hour,begin,end,car,seed\na,b,120,07:30,8:00:30,dart,4\n"
    )
    flow = '[[flow]]\nfrom="a"\nto="b"\nvehicles_per_hour=120\nbegin="7:30"\nend=28830\n'
    same = table(tmp_path, flow + 'car="dart"\nseed=4\n', "d.toml")
    expected = (Flow("a", "b", 120.0, 27000.0, 28830.0, "dart", 4),)
    assert load_demand(rows) == load_demand(same) == expected


def sumo(folder, text):
    """Return flows of SUMO's, what was said, and all departures of each."""
    said = []
    flows = load_demand(table(folder, f"<routes>{text}</routes>", "x.rou.xml"), said.append)
    return flows, said, [departures(flow, n, 0.0) for n, flow in enumerate(flows)]


A_B = 'from="a" to="b"'


@pytest.mark.parametrize(
    ("text", "times"),
    [
        (f'<flow id="f" {A_B} period="10" number="5"/>', (0, 10, 20, 30, 40)),
        (f'<flow id="f" {A_B} begin="5" vehsPerHour="360" number="3"/>', (5, 15, 25)),
        (f'<flow id="f" {A_B} begin="10" end="70" perHour="120"/>', (10, 40)),
        (f'<flow id="f" {A_B} begin="0" end="100" number="5"/>', (0, 20, 40, 60, 80)),
        (f'<flow id="f" {A_B} begin="0:0:10" end="0:1:40" period="0:00:30"/>', (10, 40, 70)),
        (f'<interval begin="10" end="60"><flow id="f" {A_B} number="2"/></interval>', (10, 35)),
        (f'<interval begin="10" end="60"><flow id="f" {A_B} begin="20" period="20"/></interval>',
         (20, 40)),
        (f'<trip id="t" {A_B} depart="1:00:00:30"/>', (86430,)),
        ('<route id="r" edges="a x b"/><vehicle id="v" route="r" depart="6"/>', (6,)),
        (f'<flow id="f" {A_B} end="50" probability="1"/>', tuple(range(50))),
    ],
)  # fmt: skip
def test_sumos_cars_set_out_when_sumo_lets_them(tmp_path, text, times):
    _, said, all_times = sumo(tmp_path, text)
    assert all_times == [pytest.approx(times)]
    assert said == []


def test_random_flows_of_sumo_have_their_rates(tmp_path):
    _, _, (poisson, each_second) = sumo(
        tmp_path,
        f'<flow id="p" {A_B} end="20000" period="exp(0.1)"/>'
        f'<flow id="q" {A_B} end="20000" probability="0.1"/>',
    )
    assert len(poisson) == pytest.approx(2000, abs=4 * math.sqrt(2000))
    assert len(each_second) == pytest.approx(2000, abs=4 * math.sqrt(1800))
    assert all(at_s.is_integer() for at_s in each_second)
    assert len(set(each_second)) == len(each_second)
    _, _, (rare,) = sumo(tmp_path, f'<flow id="f" {A_B} probability="1e-9" number="5"/>')
    assert len(rare) == 5
    assert rare[-1] > 1e9


def test_ways_and_cars_of_sumo_are_drawn_from_distributions(tmp_path):
    flows, _, times = sumo(
        tmp_path,
        '<vType id="f1tenth"/><vTypeDistribution id="any" vTypes="f1tenth"/>'
        '<routeDistribution id="d"><route edges="a b" probability="3"/>'
        '<route id="r" edges="a/1 x c" probability="1"/></routeDistribution>'
        '<flow id="f" route="d" type="any" end="40000" period="10"/>'
        '<vehicle id="v" route="r" depart="1" departLane="2"/>',
    )
    assert [(f.start, f.via, f.end, f.car) for f in flows] == [
        ("a", (), "b", "f1tenth"), ("a%2F1", ("x",), "c", "f1tenth"),
        ("a%2F1_2", ("x",), "c", "nigel"),
    ]  # fmt: skip
    assert [len(row) for row in times] == [
        pytest.approx(3000, abs=110), pytest.approx(1000, abs=110), 1
    ]  # fmt: skip
    assert sum(map(len, times)) == 4001


def test_what_has_no_effect_in_a_sumo_file_is_said(tmp_path):
    _, said, _ = sumo(
        tmp_path,
        f'<vType id="t" sigma="0.2"/><flow id="f" {A_B} number="2" color="red" departSpeed="max"/>'
        f'<trip id="g" {A_B} depart="0" color="blue"/>',
    )
    (words,) = said
    assert "color (2), departSpeed (1), vType sigma (1)" in words


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (f'<flow id="f" {A_B} period="10" end="9" number="5"/>', "flow 'f': .* got period and end"),
        (f'<flow id="f" {A_B} period="10" vehsPerHour="9"/>', "got vehsPerHour and period"),
        (f'<flow id="f" {A_B} end="9"/>', "flow 'f': expected number or one of vehsPerHour"),
        (f'<flow id="f" {A_B} period="binomial(1,2)"/>', "period: expected seconds, h:m:s"),
        (f'<flow id="f" {A_B} period="0"/>', "period: expected at most 3600 cars an hour"),
        (f'<flow id="f" {A_B} number="1.5"/>', "number: expected a whole number, got '1.5'"),
        (f'<flow id="f" {A_B} period="1" number="1e9"/>', "expected at most 100000 cars in a flow"),
        (f'<flow id="f" {A_B} number="1" perHr="9"/>', "flow 'f': perHr is not read.*perHour"),
        (f'<flow id="f" {A_B} number="1"><stop lane="a_0"/></flow>', "stop: not read in <flow>"),
        ('<flow id="f" fromTaz="1" toTaz="2" number="1"/>', "Taz is not read"),
        ('<flow id="f" from="a" number="1"/>', "expected from and to, or one route; got from"),
        ('<flow id="f" route="r" number="1"/>', "route: the file defines no 'r'"),
        (f'<flow id="f" {A_B} type="bus" number="1"/>', "type: the file defines no 'bus'"),
        ('<vType id="b" vClass="bus"/>', "vType 'b': vClass: only cars drive here"),
        (f'<trip id="t" {A_B} depart="triggered"/>', "depart: expected seconds, .*'triggered'"),
        (f'<trip id="t" {A_B} depart="1"/><trip id="t" {A_B} depart="2"/>', "2 cars have the id"),
        ('<person id="p" depart="0"><walk edges="a"/></person>', "person 'p': not read"),
        ("<flow", "cannot be read|can be read"),
    ],
)
def test_what_cannot_be_followed_of_a_sumo_file_is_refused(tmp_path, text, words):
    with pytest.raises(DemandError, match=words):
        sumo(tmp_path, text)


def test_random_departures_have_the_rate_and_are_the_same_for_a_seed():
    flow = Flow("a", "b", 600.0, 0.0, 36_000.0, seed=1)
    times = departures(flow, 0, 0.0)
    assert len(times) == pytest.approx(6000, abs=4 * math.sqrt(6000))
    assert times == departures(flow, 0, 0.0)
    assert times != departures(flow, 1, 0.0)
    later = departures(flow, 0, 100.0)
    assert later == tuple(t for t in times if t >= 100.0)
    gaps = [b - a for a, b in itertools.pairwise(times)]
    spread = sum((gap - 6.0) ** 2 for gap in gaps) / len(gaps)
    assert math.sqrt(spread) == pytest.approx(6.0, rel=0.1)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("from,to\na,b\n", "line 2: key 'vehicles_per_hour' is missing"),
        ("from,to,vehicles_per_hour\na,b,many\n", "vehicles_per_hour: expected a number"),
        ("from,to,vehicles_per_hour,beginn\na,b,1,2\n", "no key 'beginn'.*begin"),
        ("from,to,vehicles_per_hour,begin,end\na,b,1,9:00,8:00\n", "end: expected after begin"),
        ("from,to,vehicles_per_hour,begin\na,b,1,9:x\n", "begin: expected 07:30"),
        ("from,to,vehicles_per_hour,begin\na,b,1,7 am\n", "begin: expected 07:30.*got '7 am'"),
        ("from,to,vehicles_per_hour,end\na,b,1,1e12\n", "end: expected at most 604800 s, a week"),
        ("from,to,vehicles_per_hour,end\na,b,1,25:10\n", "end: expected 07:30.*got '25:10'"),
        ("from,to,vehicles_per_hour,end\na,b,1,7:60\n", "end: expected 07:30"),
        ("from,to,vph\na,b,1\n", "no key 'vph', only from, to, vehicles_per_hour"),
        ("from,to,vehicles_per_hour\na,b,9999\n", "at most 3600"),
        ("from,to,vehicles_per_hour\n", "at least one row"),
    ],
)
def test_wrong_tables_are_refused_with_row_and_key(tmp_path, text, words):
    with pytest.raises(DemandError, match=words):
        load_demand(table(tmp_path, text))


def test_times_of_day_are_read():
    assert seconds_of_day("07:30", "") == 27000.0
    assert seconds_of_day(12.5, "") == 12.5


def test_the_quickest_way_is_taken_and_edges_mean_their_lanes():
    ways = Ways(CITY)
    entry, route = ways.of(Flow("j0_0_e", "j1_0_n", 1.0), "row 1")
    assert entry == "j0_0_e_0"
    assert route == ("j0_0_e", "j1_0_en", "j1_0_n")
    assert ways.of(Flow("j0_0_e_2", "j1_0_n", 1.0), "row 1")[0] == "j0_0_e_2"
    for flow, words in (
        (Flow("j0_0_x", "j1_0_n", 1.0), "from: map .* has no lane or edge 'j0_0_x'"),
        (Flow("j0_0_en", "j1_0_n", 1.0), "has no lane or edge|no spawn place"),
        (Flow("j0_0_e", "nowhere", 1.0), "to: map .* 'nowhere'"),
    ):
        with pytest.raises(DemandError, match=words):
            ways.of(flow, "row 1")


def test_a_name_of_both_a_lane_and_an_edge_is_refused():
    more = msgspec.structs.replace(CITY.lanes[0], name="j0_0_e_1", next=())
    ways = Ways(msgspec.structs.replace(CITY, lanes=(*CITY.lanes, more)))
    with pytest.raises(DemandError, match=r"'j0_0_e' is a lane and an edge .*'j0_0_e_1'"):
        ways.of(Flow("j0_0_e", "j1_0_n", 1.0), "f")


def test_a_way_passes_the_edges_that_it_names():
    ways = Ways(CITY)
    plain = ways.of(Flow("j0_0_e", "j1_0_n", 1.0), "f")[1]
    by = ways.of(Flow("j0_0_e", "j1_0_n", 1.0, via=("j1_1_w", "j0_1_s")), "f")[1]
    assert by[0] == plain[0]
    assert by[-1] == plain[-1]
    assert by.index("j1_1_w") < by.index("j0_1_s")
    with pytest.raises(DemandError, match=r"f: via: map .* no lane or edge 'x'"):
        ways.of(Flow("j0_0_e", "j1_0_n", 1.0, via=("x",)), "f")


def run(flows, span_s):
    part = DemandPart(CITY, flows)
    with Lockstep([WorldPart(CITY), part]) as city:
        seen = city.subscribe(Subscription(WorldSnapshot))
        city.run_for(span_s)
        cars = [len(item.message.vehicles) for item in seen.drain()]
    return part.status, cars


def test_cars_enter_arrive_and_are_taken_away():
    flow = Flow("j0_0_e", "j1_0_n", 0.0, departures_s=(1.0, 15.0))
    status, cars = run([flow], 60.0)
    assert (status.wanted, status.entered, status.arrived, status.queued) == (2, 2, 2, 0)
    assert max(cars) == 2
    assert cars[-1] == 0
    assert 18.0 < status.travel_s < 45.0


def test_who_finds_no_room_waits_and_is_counted():
    flow = Flow("j0_0_e", "j1_0_n", 0.0, departures_s=(0.0,) * 5)
    status, _ = run([flow], 4.0)
    assert status.wanted == 5
    assert 1 <= status.entered < 5
    assert status.entered + status.queued == 5
    assert status.longest_queue >= 4
    later, _ = run([flow], 40.0)
    assert later.entered == 5
    assert later.queued == 0
    assert later.waited_s > 2.0


def test_a_car_that_cannot_be_is_refused_once_and_the_next_one_comes():
    flows = [
        Flow("j0_0_e", "j1_0_n", 0.0, car="tractor", departures_s=(0.0,)),
        Flow("j0_0_e", "j1_0_n", 0.0, departures_s=(0.5,)),
    ]
    status, _ = run(flows, 4.0)
    assert (status.refused, status.entered, status.queued) == (1, 1, 0)


def test_a_demand_starts_at_a_time_of_day():
    flow = Flow("j0_0_e", "j1_0_n", 0.0, 25200.0, 25300.0, departures_s=(25201.0, 25260.0))
    part = DemandPart(CITY, [flow], 25250.0)
    with Lockstep([WorldPart(CITY), part]) as city:
        city.run_for(9.0)
        assert part.status.wanted == 0
        city.run_for(3.0)
    assert part.status.wanted == 1
    assert part.status.time_of_day_s == pytest.approx(25262.0, abs=0.2)
