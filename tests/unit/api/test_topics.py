"""Topics tell parts of the city; shelves lie in one folder; the stream takes only known names."""

from pathlib import Path

import msgspec
import pytest

from scm.api.city import City
from scm.api.encoding import encode
from scm.api.folders import Folders, folders_in
from scm.api.topics import EVENTS, pulse_of, topics_of
from scm.clock import NS_PER_S
from scm.v2x.messages.trip import Trip


@pytest.fixture
def city(view, fake_city, city_map):
    return City(view, fake_city.ask, city_map)


def test_every_topic_can_be_told_before_anything_is_heard(city, seen):
    for name, topic in topics_of(city, seen).items():
        assert encode(topic.make(city.view.picture())), name
        assert topic.every >= 1


def test_events_are_no_state_and_so_no_topic_made_from_a_picture(city, seen):
    assert EVENTS not in topics_of(city, seen)


def test_the_pulse_is_unknown_until_the_world_is_heard(view, hear, snapshot):
    still = pulse_of(view.picture())
    assert (still.t_ns, still.tick, still.vehicles) == (None, None, 0)
    hear(2.0, snapshot(at_s=1.0, tick=7, n1=(0, 0, 0), n2=(1, 0, 0)))
    beats = pulse_of(view.picture())
    assert (beats.t_ns, beats.tick, beats.vehicles) == (1_000_000_000, 7, 2)
    assert (still.moving, beats.moving) == (0, 2)


def test_the_pulse_names_signals_that_were_heard_and_are_silent(view, hear, spat):
    other = msgspec.structs.replace(spat(), junction="station")
    hear(1.0, spat(), other)
    hear(2.9)
    assert pulse_of(view.picture()).silent_signals == ()
    hear(3.1, other)
    assert pulse_of(view.picture()).silent_signals == ("crossing",)
    hear(3.2, spat())
    assert pulse_of(view.picture()).silent_signals == ()


def test_a_topic_follows_the_picture(city, seen, hear, snapshot):
    vehicles = topics_of(city, seen)["vehicles"].make
    hear(2.0, snapshot(n1=(0, 0, 0)))
    before = encode(vehicles(city.view.picture()))
    hear(2.05, snapshot(at_s=1.05, n1=(0.1, 0, 0)))
    assert encode(vehicles(city.view.picture())) != before


def test_an_unknown_topic_is_refused_with_the_nearest_one(client):
    answer = client("GET", "/api/v1/stream?topics=vehicles,signal")
    assert (answer.status_code, answer.json()["code"]) == (422, "invalid")
    assert "got 'signal'" in answer.json()["detail"]
    assert "did you mean 'signals'" in answer.json()["detail"]


def test_all_shelves_lie_in_one_folder():
    folders = folders_in(Path("runs"))
    assert folders.recordings == Path("runs")
    folders = [folders.reports, folders.scenarios, folders.calibrations, folders.plans]
    assert len(set(folders)) == 4
    assert all(folder.parent == Path("runs") for folder in folders)
    assert Folders().recordings is None


def test_pulse_trips_and_a_list_say_what_makes_measurements_void(
    client, view, hear, snapshot, spat
):
    under_way = Trip(
        vehicle="n1",
        trip_id="n1-1",
        t_ns=12 * NS_PER_S,
        route=("east_loop",),
        done_m=1.0,
        length_m=5.0,
        started_ns=2 * NS_PER_S,
    )
    hear(2.0, snapshot(n1=(0, 0, 0)), spat(at_s=2.0))
    for at_s in range(20, 120):
        hear(at_s / 10, spat(at_s=at_s / 10, mode="flash" if at_s >= 80 else "plan"))
    hear(12.0, snapshot(at_s=12.0, n1=(0, 0, 0)), under_way)
    (one,) = pulse_of(view.picture()).disturbances
    assert (one.kind, one.source, one.text) == (
        "flash",
        "crossing",
        "the signals of crossing flash",
    )
    (row,) = client("GET", "/api/v1/vehicles").json()["vehicles"]
    assert row["trip"]["void"] == ["the signals of crossing flash for 4.0 of 10.0 s"]
    hear(12.1, spat(at_s=12.1))
    assert pulse_of(view.picture()).disturbances == ()
    (over,) = client("GET", "/api/v1/disturbances").json()["disturbances"]
    assert (over["start_ns"], over["end_ns"]) == (8 * NS_PER_S, round(12.1 * NS_PER_S))
