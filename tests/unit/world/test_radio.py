"""A frame reaches who is in range, loses its share, and every fate is counted."""

import numpy as np
import pytest

from scm.maps.model import CityMap, Floor, Group, Junction, Light, MapTag
from scm.maps.model import Conflict as Stretch
from scm.world.radio import Radio, roadside_places

PLACES = {"n1": (0.0, 0.0), "n2": (3.0, 4.0), "n3": (0.0, 5.1), "rsu-x": (1.0, 0.0)}


def radio(range_m=5.0, loss=0.0, seed=0):
    return Radio(range_m, np.random.default_rng(seed), loss)


def test_everybody_in_range_hears_it_but_the_sender():
    assert radio().receivers("n1", PLACES) == ["n2", "rsu-x"]


def test_a_sender_whose_place_is_unknown_reaches_nobody_and_is_counted():
    air = radio()
    assert air.receivers("ghost", PLACES) == []
    assert air.counts.unknown == 1


def test_loss_takes_its_share_of_the_frames():
    air = radio(loss=0.3)
    for _ in range(2000):
        air.receivers("n1", PLACES)
    assert air.counts.delivered / 4000 == pytest.approx(0.7, abs=0.03)


def test_equal_seeds_lose_the_same_frames():
    heard = [
        [air.receivers("n1", PLACES) for _ in range(50)]
        for air in (radio(loss=0.5), radio(loss=0.5))
    ]
    assert heard[0] == heard[1]


def test_every_station_but_the_sender_is_counted_once_a_frame():
    air = radio(loss=0.5)
    for _ in range(10):
        air.receivers("n2", PLACES)
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
