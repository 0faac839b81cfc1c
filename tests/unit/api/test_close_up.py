"""What a car reports of itself, heard while somebody looks, and told as rows."""

import asyncio
import json

import numpy as np
import pytest
from msgspec.structs import replace

from scm.api.city import City
from scm.api.close_up import DEPTH, sample_of
from scm.api.routes.close_up import _reports
from scm.api.routes.scan import Turns
from scm.api.stream import Stream
from scm.runtime.part import Subscription
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.network_view import NetworkView
from scm.v2x.messages.vehicle_state import VehicleState


@pytest.fixture
def report():
    def build(seq=1, vehicle="n1", steering=0.2):
        return VehicleState(
            vehicle=vehicle, t_ns=seq * 20_000_000, seq=seq, x_m=0.0, y_m=0.0, yaw_rad=0.0,
            speed_mps=0.25, yaw_rate_radps=0.1, accel_mps2=0.5, steering_rad=0.05, throttle=0.9,
            steering=steering, source="simulated",
        )  # fmt: skip

    return build


def test_reports_are_heard_only_while_somebody_looks(view):
    wish = Subscription(VehicleState, {"vehicle": "n1"})
    assert wish not in view.subscriptions
    with view.watching_closely("n1"), view.watching_closely("n1"):
        assert list(view.subscriptions).count(wish) == 1
    assert wish not in view.subscriptions


def test_each_report_is_told_once_and_in_order(view, hear, report):
    with view.watching_closely("n1"):
        hear(1.0, report(1), report(2), report(1, vehicle="n2"))
        number, states = view.reports_after("n1", 0)
        assert [state.seq for state in states] == [1, 2]
        hear(1.1, report(3))
        number, states = view.reports_after("n1", number)
        assert [state.seq for state in states] == [3]
        assert view.reports_after("n1", number) == (number, ())


def test_what_nobody_fetches_is_forgotten(view, hear, report):
    with view.watching_closely("n1"):
        hear(1.0, *(report(seq) for seq in range(1, DEPTH + 3)))
        assert len(view.reports_after("n1", 0)[1]) == DEPTH
    with view.watching_closely("n1"):
        assert view.reports_after("n1", 0)[1] == ()


def test_a_row_holds_command_and_response_in_the_documented_order(report):
    row = sample_of(report(5))
    assert row.__struct_fields__[:4] == ("t_s", "throttle", "steering", "speed_mps")
    assert (row.t_s, row.throttle, row.steering, row.speed_mps) == (0.1, 0.9, 0.2, 0.25)
    assert (row.steering_rad, row.yaw_rate_radps, row.accel_mps2) == (0.05, 0.1, 0.5)
    assert sample_of(report(steering=None)).steering is None


def test_scans_come_with_the_reports_for_who_asks_and_null_where_there_is_no_lidar(
    view, hear, snapshot, fake_city, city_map, seen, report
):
    city = City(view, fake_city.ask, city_map)
    stream = Stream(city, "run", seen)
    scan = LidarScan(
        vehicle="n1", t_ns=10**9, beams=2, range_min_m=0.1, range_max_m=4.0, bearing_first_rad=0.0,
        payload=np.array([1.0, 2.0], "<f4").tobytes(),
    )  # fmt: skip

    async def heard(scanner):
        told = _reports(city, stream, "n1", Turns(city, "n1", scanner))
        await anext(told)
        hear(1.1, report(1), scan)
        both = [await anext(told), await anext(told)]
        await told.aclose()
        return both

    hear(1.0, snapshot(1.0, n1=(0.0, 0.0, 0.0)))
    reports, turn = asyncio.run(heard((0.1, 0.0)))
    assert reports.startswith(b"event: reports")
    assert json.loads(turn.split(b"data: ")[1])["ranges_m"] == [1.0, 2.0]
    assert asyncio.run(heard(None))[1] == b"event: scan\ndata: null\n\n"
    assert not any(wish.kind is LidarScan for wish in view.subscriptions)


def test_what_a_network_sees_comes_with_the_reports_for_who_requests_it(
    view, hear, snapshot, fake_city, city_map, seen, report
):
    city = City(view, fake_city.ask, city_map)
    stream = Stream(city, "run", seen)
    made = NetworkView(
        vehicle="n1", camera="front", t_ns=10**9, network="paper", file="model.onnx", steering=0.2,
        throttle=0.9, delay_s=0.03, inference_s=0.004, top=0.3, rows=1, columns=2,
        saliency=(0.0, -0.1),
    )  # fmt: skip
    wanted = Subscription(NetworkView, {"vehicle": "n1"})

    async def events(*, with_network):
        stream_of_n1 = _reports(city, stream, "n1", with_network=with_network)
        await anext(stream_of_n1)
        is_subscribed = wanted in view.subscriptions
        hear(1.1, report(1), made, replace(made, vehicle="n2"))
        both = [await anext(stream_of_n1), await anext(stream_of_n1)]
        await stream_of_n1.aclose()
        return is_subscribed, both

    hear(1.0, snapshot(1.0, n1=(0.0, 0.0, 0.0)))
    is_subscribed, (_, event) = asyncio.run(events(with_network=True))
    assert is_subscribed
    assert event.startswith(b"event: network\n")
    assert json.loads(event.split(b"data: ")[1])["saliency"] == [0.0, -0.1]
    assert wanted not in view.subscriptions
    is_subscribed, both = asyncio.run(events(with_network=False))
    assert not is_subscribed
    assert not any(event.startswith(b"event: network") for event in both)


def test_a_car_that_is_not_there_has_no_reports(client):
    assert client("GET", "/api/v1/vehicles/n9/reports").status_code == 404
