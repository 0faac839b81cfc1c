"""A frame reaches who is in range, loses its share, and every fate is counted."""

import numpy as np
import pytest

from scm.maps.model import CityMap, Floor, Group, Junction, Light, MapTag
from scm.maps.model import Conflict as Stretch
from scm.world.radio import Radio, Receivers, roadside_places

PLACES = {"n1": (0.0, 0.0), "n2": (3.0, 4.0), "n3": (0.0, 5.1), "rsu-x": (1.0, 0.0)}
STATIONS = Receivers(PLACES)


def radio(range_m=5.0, loss=0.0, seed=0):
    return Radio(range_m, np.random.default_rng(seed), loss)


def heard(air, *senders):
    """Return who hears a frame of each sender, sent from where it is, or from the origin."""
    x, y = np.array([PLACES.get(sender, (0.0, 0.0)) for sender in senders]).T
    reached = air.reach(senders, x, y, STATIONS)
    return [[STATIONS.names[i] for i in np.flatnonzero(row)] for row in reached]


def test_everybody_in_range_hears_it_but_the_sender():
    assert heard(radio(), "n1", "n3") == [["n2", "rsu-x"], ["n2"]]


def test_a_sender_that_is_no_receiver_itself_is_heard_by_all_in_range():
    assert heard(radio(), "hosted") == [["n1", "n2", "rsu-x"]]


def test_nobody_hears_where_there_is_nobody():
    x = np.zeros(2)
    assert radio().reach(["a", "b"], x, x, Receivers({})).shape == (2, 0)


def test_loss_takes_its_share_of_the_frames():
    air = radio(loss=0.3)
    heard(air, *["n1"] * 2000)
    assert air.counts.delivered / 4000 == pytest.approx(0.7, abs=0.03)


def test_equal_seeds_lose_the_same_frames():
    first, second = (heard(radio(loss=0.5), *["n1"] * 50) for _ in range(2))
    assert first == second


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
