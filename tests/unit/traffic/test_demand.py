"""Cars come when a table wants them, wait where there is no room, drive and leave."""

import itertools
import math
from pathlib import Path

import pytest

from scm.lockstep import Lockstep
from scm.maps.grid_city import grid_city
from scm.part import Hears
from scm.traffic.demand import DemandPart, Ways
from scm.traffic.demand_table import DemandError, Flow, departures, load_demand, seconds_of_day
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


SUMO = """<routes>
  <route id="r" edges="a x b"/>
  <flow id="f" from="a" to="b" begin="10" end="70" vehsPerHour="120"/>
  <flow id="g" route="r" begin="0" end="100" number="5"/>
  <flow id="h" from="a" to="b" begin="0" end="100" probability="0.1"/>
  <trip id="t" from="a" to="b" depart="5"/>
  <vehicle id="v" depart="6"><route edges="c d"/></vehicle>
</routes>"""


def test_flows_trips_and_vehicles_of_sumo_are_read(tmp_path):
    flows = load_demand(table(tmp_path, SUMO, "x.rou.xml"))
    assert [(f.start, f.end, f.per_hour) for f in flows] == [
        ("a", "b", 120.0), ("a", "b", 180.0), ("a", "b", 360.0), ("a", "b", 0.0), ("c", "d", 0.0),
    ]  # fmt: skip
    assert [f.even for f in flows[:3]] == [True, True, False]
    assert departures(flows[0], 0, 0.0) == pytest.approx((10.0, 40.0))
    assert departures(flows[3], 0, 0.0) == (5.0,)


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


def run(flows, span_s):
    part = DemandPart(CITY, flows)
    with Lockstep([WorldPart(CITY), part]) as city:
        seen = city.hear(Hears(WorldSnapshot))
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
