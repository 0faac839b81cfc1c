"""LIDAR scans: heard while somebody watches, shown with where the car was."""

import asyncio
import json

import numpy as np
import pytest

from scm.api.city import City
from scm.api.routes import scan as routes
from scm.api.routes.scan import _turns
from scm.api.scan_watch import scanner_of
from scm.api.stream import Stream
from scm.clock import NS_PER_S
from scm.v2x.messages.lidar_scan import LidarScan

API = "/api/v1"


def scan(at_s=1.0, vehicle="n1", ranges=(1.0, float("inf"), 2.5, 0.5)):
    payload = np.array(ranges, "<f4").tobytes()
    return LidarScan(
        vehicle=vehicle,
        t_ns=round(at_s * NS_PER_S),
        beams=len(ranges),
        range_min_m=0.15,
        range_max_m=12.0,
        payload=payload,
    )


def heard(view):
    return [one.where for one in view.subscriptions if one.kind is LidarScan]


def test_a_scan_is_heard_for_as_long_as_anybody_watches_it(view, hear):
    assert heard(view) == []
    with view.watching_scan("n1"):
        with view.watching_scan("n1"):
            assert heard(view) == [{"vehicle": "n1"}]
        hear(1.0, scan(), scan(vehicle="n2"))
        assert view.scan("n1")[0].message.vehicle == "n1"
        assert view.scan("n2") is None
    assert heard(view) == []
    assert view.scan("n1") is None


def test_a_scan_is_shown_with_the_pose_that_the_car_had_then(client, view, hear, snapshot):
    hear(1.0, snapshot(1.0, n1=(0.0, 0.0, 0.0)))
    hear(2.0, snapshot(2.0, 2, n1=(1.0, 2.0, 0.5)))
    with view.watching_scan("n1"):
        hear(2.0, scan(1.5))
        shown = client("GET", f"{API}/vehicles/n1/scan").json()
    assert (shown["x_m"], shown["y_m"], shown["yaw_rad"]) == (0.5, 1.0, 0.25)
    assert shown["ranges_m"] == [1.0, None, 2.5, 0.5]
    assert shown["bearing_step_rad"] == pytest.approx(np.pi / 2)
    assert shown["scanner_x_m"] == scanner_of("nigel")[0] > 0.1


def test_a_scan_older_than_what_is_known_of_the_car_has_no_pose(client, view, hear, snapshot):
    hear(2.0, snapshot(2.0, n1=(1.0, 2.0, 0.5)))
    with view.watching_scan("n1"):
        hear(2.0, scan(1.5))
        shown = client("GET", f"{API}/vehicles/n1/scan").json()
    assert shown["x_m"] is shown["yaw_rad"] is None


def test_no_car_and_no_scanner_are_said_in_words(client, hear, snapshot):
    hear(1.0, snapshot(n1=(0.0, 0.0, 0.0)))
    assert client("GET", f"{API}/vehicles/n9/scan").status_code == 404
    assert client("GET", f"{API}/vehicles/n9/scan/stream").status_code == 404


def test_a_stream_of_a_car_without_a_scanner_says_so_once_instead_of_being_refused(
    view, hear, snapshot, fake_city, city_map, seen, client, monkeypatch
):
    monkeypatch.setattr(routes, "scanner_of", lambda _car: None)
    hear(1.0, snapshot(n1=(0.0, 0.0, 0.0)))
    city = City(view, fake_city.ask, city_map)
    scanner = routes._scanner(city, "n1")

    async def first_two():
        told = _turns(city, Stream(city, "run", seen), "n1", scanner)
        return [await anext(told) for _ in range(2)]

    assert asyncio.run(first_two())[1] == b"event: scan\ndata: null\n\n"
    assert "has no LIDAR" in client("GET", f"{API}/vehicles/n1/scan").json()["detail"]


def test_a_stream_tells_each_turn_once_and_stops_listening_with_its_page(
    view, hear, snapshot, fake_city, city_map, seen
):
    city = City(view, fake_city.ask, city_map)
    stream = Stream(city, "run", seen)

    async def scenario():
        hear(1.0, snapshot(1.0, n1=(0.0, 0.0, 0.0)))
        turns = _turns(city, stream, "n1", (0.1, 0.0))
        assert await anext(turns) == b"retry: 1000\n\n"
        hear(1.1, scan(1.0))
        first = await anext(turns)
        hear(1.2, scan(1.2))
        second = await anext(turns)
        assert heard(view)
        await turns.aclose()
        return [json.loads(turn.split(b"data: ")[1])["t_ns"] for turn in (first, second)]

    assert asyncio.run(scenario()) == [NS_PER_S, 1.2 * NS_PER_S]
    assert heard(view) == []
