"""A frame reaches who is in range, loses its share, and every fate is counted."""

import math

import numpy as np
import pytest

from scm.records.city_map import CityMap, Group, Junction, Light, MapTag, RadioChannel
from scm.records.city_map import Conflict as Stretch
from scm.records.floor import Floor
from scm.v2x.messages.part_status import PartStatus
from scm.vehicles.drivers.channel import channel_of
from scm.world.radio import Burst, DelayQueue, Radio, Receivers, roadside_places

PLACES = {"n1": (0.0, 0.0), "n2": (3.0, 4.0), "n3": (0.0, 5.1), "rsu-x": (1.0, 0.0)}
STATIONS = Receivers(PLACES)
WALLS = [[2.0, -1.0, 2.0, 9.0]]


def radio(range_m=5.0, loss=0.0, seed=0, **more):
    settings = RadioChannel(loss=loss, **more)
    channel = channel_of(settings, range_m, 0, np.array(WALLS))
    return Radio(channel, seed)


def heard(air, *senders):
    """Return who receives a frame of each sender, one after the other, from where it is."""
    found = []
    for t_ns, sender in enumerate(senders):
        x, y = (np.array([number]) for number in PLACES.get(sender, (0.0, 0.0)))
        (row,) = air.reach(Burst("cam", [sender], x, y, t_ns), STATIONS)
        found.append([STATIONS.names[i] for i in np.flatnonzero(row)])
    return found


def test_everybody_in_range_hears_it_but_the_sender():
    assert heard(radio(), "n1", "n3") == [["n2", "rsu-x"], ["n2"]]


def test_a_sender_that_is_no_receiver_itself_is_heard_by_all_in_range():
    assert heard(radio(), "hosted") == [["n1", "n2", "rsu-x"]]


def test_nobody_hears_where_there_is_nobody():
    x = np.zeros(2)
    assert radio().reach(Burst("cam", ["a", "b"], x, x, 0), Receivers({})).shape == (2, 0)


def test_loss_takes_its_share_of_the_frames():
    air = radio(loss=0.3)
    heard(air, *["n1"] * 2000)
    assert air.counts.delivered / 4000 == pytest.approx(0.7, abs=0.03)


def test_equal_seeds_lose_the_same_frames():
    first, second = (heard(radio(loss=0.5), *["n1"] * 50) for _ in range(2))
    assert first == second


def test_who_is_lost_does_not_depend_on_what_else_is_sent():
    alone, among = radio(loss=0.5), radio(loss=0.5)
    x = np.zeros(2)
    for t_ns in range(50):
        first = alone.reach(Burst("cam", ["a"], x[:1], x[:1], t_ns), STATIONS)
        among.reach(Burst("denm", ["c"], x[:1], x[:1], t_ns), STATIONS)
        both = among.reach(Burst("cam", ["b", "a"], x, x, t_ns), STATIONS)
        assert (both[1] == first[0]).all()


def test_every_station_but_the_sender_is_counted_once_a_frame():
    air = radio(loss=0.5)
    heard(air, *["n2"] * 10)
    counts = air.counts
    assert counts.sent == 10
    assert counts.delivered + counts.lost + counts.out_of_range == 30


def test_a_roadside_unit_stands_amid_the_lights_of_its_junction():
    group = Group(name="g", number=1, movement=Stretch(lane="a", from_m=0.0, to_m=1.0))
    lights = tuple(
        Light(light_id=i, x_m=x, y_m=2.0, yaw_rad=0.0, junction="main", group="g")
        for i, x in enumerate((1.0, 3.0))
    )
    city_map = CityMap(
        map=1,
        name="m",
        title="",
        source="",
        floor=Floor(x_m=(-1.0, 1.0), y_m=(-1.0, 1.0)),
        tag=MapTag(tag_id=0, size_m=0.1),
        junctions=(Junction(name="main", number=1, groups=(group,), plan="calm"),),
        lights=lights,
    )
    assert roadside_places(city_map) == {"rsu-main": (2.0, 2.0)}


def shares(air, distance_m, load=0.0, frames=4000):
    """Return what share of frames is heard at a distance."""
    places = Receivers({"there": (distance_m, 0.0)})
    x = np.zeros(frames)
    senders = [f"here{number}" for number in range(frames)]
    return air.reach(Burst("cam", senders, x, x, 0), places, np.array([load])).mean()


@pytest.mark.parametrize("distance_m", [2.0, 5.0, 8.0])
def test_loss_by_distance_follows_the_formula(distance_m):
    margin_db = 10.0 * 2.5 * np.log10(5.0 / distance_m)
    wanted = 1.0 - 0.5 * math.erfc(margin_db / (6.0 * math.sqrt(2.0)))
    air = radio(fading_db=6.0, path_loss_exponent=2.5)
    assert shares(air, distance_m) == pytest.approx(wanted, abs=0.03)


def test_causes_of_loss_add_up_as_independent_ones():
    air = radio(loss=0.2, fading_db=6.0)
    assert shares(air, 5.0, load=0.25) == pytest.approx(0.8 * 0.5 * 0.75, abs=0.03)
    counts = air.counts
    assert counts.by_chance + counts.by_distance + counts.by_load == counts.lost
    assert counts.by_chance / 4000 == pytest.approx(0.2, abs=0.03)
    assert counts.by_distance / 4000 == pytest.approx(0.8 * 0.5, abs=0.03)


def test_a_wall_between_shadows_and_one_beside_does_not():
    air = radio(wall_db=10.0, range_m=5.0)
    assert shares(air, 1.9) == 1.0
    assert shares(air, 2.1) == 0.0


def test_delays_lie_between_the_least_and_the_most():
    air = radio(delay_ms=30.0, jitter_ms=50.0)
    senders, x = [f"here{number}" for number in range(2000)], np.zeros(2000)
    delays_ms = air.delays(Burst("cam", senders, x, x, 0), np.ones((2000, 1), np.bool_)) / 1e6
    assert delays_ms.min() >= 30.0
    assert delays_ms.max() <= 80.0
    assert delays_ms.mean() == pytest.approx(55.0, abs=2.0)
    assert air.counts.late == 2000


def test_late_frames_come_in_the_order_of_their_time_and_never_before():
    late = DelayQueue()
    for due_ns, name in ((50, "b"), (20, "a"), (50, "c")):
        late.put(due_ns, PartStatus(station=name, t_ns=0))
    assert late.arrived(19) == []
    assert [frame.station for frame in late.arrived(49)] == ["a"]
    assert [frame.station for frame in late.arrived(50)] == ["b", "c"]
    assert len(late) == 0
