"""Metrics say what the city and the server do, in the text that Prometheus reads."""

import msgspec
import pytest
from msgspec import structs
from prometheus_client.parser import text_string_to_metric_families
from starlette.responses import Response

from scm.api.acknowledgements import Acknowledgements
from scm.api.app import create_app
from scm.api.city import City, Link
from scm.api.folders import Folders
from scm.api.keys import KeyRing
from scm.api.metrics import Measured, Metrics
from scm.api.stream import Stream
from scm.clock import StepClock
from scm.store.memory import MemoryStore
from scm.store.open import open_store
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.presence import Presence
from tests.unit.api.made_twins import blind, watched


@pytest.fixture
def read(client):
    def numbers():
        text = client("GET", "/metrics").text
        return {
            (sample.name, *(value for _, value in sorted(sample.labels.items()))): sample.value
            for family in text_string_to_metric_families(text)
            for sample in family.samples
        }

    return numbers


def test_before_anything_is_heard_there_is_no_world_but_a_server(read):
    told = read()
    assert told["scm_stream_listeners",] == 0.0
    assert told["scm_router_up",] == 1.0
    assert ("scm_snapshot_age_seconds",) not in told


def test_the_world_its_cars_and_the_stop_are_told(read, hear, snapshot):
    world = snapshot(at_s=1.0, n1=(0, 0, 0), n2=(1, 0, 0))
    n1, n2 = world.vehicles
    world = msgspec.structs.replace(world, vehicles=(msgspec.structs.replace(n1, age_ms=250.0), n2))
    hear(2.0, world, CityStop(t_ns=1, engaged=True))
    hear(2.5)
    told = read()
    assert told["scm_vehicles", "hosted"] == 2.0
    assert told["scm_snapshot_age_seconds",] == pytest.approx(0.5)
    assert told["scm_vehicle_state_age_seconds", "hosted"] == pytest.approx(0.75)
    assert told["scm_city_stopped",] == 1.0
    assert told["scm_late_ticks_total",] == 0.0


def test_of_commands_the_oldest_of_each_kind_of_car_is_told(read, hear, snapshot):
    told = snapshot(n1=(0, 0, 0), n2=(1, 0, 0), n3=(2, 0, 0))
    first, second, third = told.vehicles
    cars = structs.replace(first, command_age_ms=20.0), structs.replace(second, command_age_ms=90.0)
    hear(1.0, structs.replace(told, vehicles=(*cars, structs.replace(third, kind="real"))))
    hear(1.1)
    numbers = read()
    assert numbers["scm_cmd_age_seconds", "hosted"] == pytest.approx(0.19)
    assert ("scm_cmd_age_seconds", "real") not in numbers, "nobody drives it from outside"


def test_parts_tell_their_slowest_step_and_what_they_lost(read, hear):
    here = Presence(role="part", station="world", session="s", alive=True)
    hear(1.0, here, PartStatus(station="world", t_ns=1, step_ms=4.0, late_steps=3, dropped=2))
    told = read()
    assert told["scm_part_up", "world"] == 1.0
    assert told["scm_part_step_seconds", "world"] == pytest.approx(0.004)
    assert told["scm_part_late_steps_total", "world"] == 3.0
    assert told["scm_part_dropped_messages_total", "world"] == 2.0
    hear(2.0, msgspec.structs.replace(here, alive=False))
    told = read()
    assert told["scm_part_up", "world"] == 0.0
    assert ("scm_part_step_seconds", "world") not in told


def test_a_latched_fault_counts_once_however_often_it_is_told(read, hear):
    for at_s, since_ns in ((1.0, 10), (2.0, 10), (3.0, 20)):
        status = MonitorStatus(junction="crossing", t_ns=1, fault="conflict", since_ns=since_ns)
        hear(at_s, status)
        told = read()
    assert told["scm_monitor_fault", "crossing"] == 1.0
    assert told["scm_monitor_faults_total", "conflict", "crossing"] == 2.0


def test_requests_are_counted_by_route_not_by_address(read, client):
    client("GET", "/api/v1/vehicles/n1")
    client("GET", "/api/v1/vehicles/n2")
    client("GET", "/api/v1/nothing/at/all")
    told = read()
    route = "/api/v1/vehicles/{name}"
    assert told["scm_requests_total", "GET", route, "404"] == 2.0
    assert told["scm_request_seconds_count", "GET", route] == 2.0
    assert told["scm_requests_total", "GET", "none", "404"] == 1.0


def test_methods_that_nobody_knows_are_counted_as_one(read, client):
    for number in range(3):
        client(f"BREW{number}", "/api/v1/vehicles")
    told = {key: value for key, value in read().items() if key[0] == "scm_requests_total"}
    assert told == {("scm_requests_total", "other", "/api/v1/vehicles", "405"): 3.0}


def test_an_endless_answer_is_counted_and_not_timed(view, fake_city, city_map, client_of):
    city = City(view, fake_city.ask, city_map, {}, Folders(), Link())
    metrics = Metrics(city, Stream(city, "r", Acknowledgements(MemoryStore(), StepClock())))
    for media in ("text/event-stream", "text/plain"):
        client_of(Measured(Response("", media_type=media), metrics=metrics, clock=StepClock()))(
            "GET", "/"
        )
    text = metrics.text().decode()
    assert 'scm_requests_total{method="GET",route="none",status="200"} 2.0' in text
    assert 'scm_request_seconds_count{method="GET",route="none"} 1.0' in text


def test_losses_of_the_bus_are_told(view, fake_city, city_map, client_of):
    link = Link(is_connected=lambda: False, rejected=lambda: 7)
    text = client_of(create_app(view, fake_city.ask, city_map, link=link))("GET", "/metrics").text
    assert "scm_bus_callback_errors_total 7.0" in text
    assert "scm_router_up 0.0" in text


def test_with_keys_metrics_need_one(view, fake_city, city_map, client_of, tmp_path):
    keys = KeyRing(open_store(f"sqlite:{tmp_path / 'keys'}"))
    key = keys.add("scraper", "viewer", 1)
    ask = client_of(create_app(view, fake_city.ask, city_map, keys=keys))
    assert ask("GET", "/metrics").status_code == 401
    headers = {"Authorization": f"Bearer {key}"}
    assert ask("GET", "/metrics", headers=headers).status_code == 200


def test_of_watched_cars_state_driving_changes_and_version_are_counted(read, hear):
    hear(1.0, watched(), blind())
    numbers = read()
    states = [numbers["scm_twin_state", one, "n1"] for one in ("learning", "watching", "blind")]
    assert states == [0.0, 1.0, 0.0]
    assert numbers["scm_twin_state", "blind", "n3"] == 1.0
    assert numbers["scm_twin_driven_seconds", "n1"] == pytest.approx(1104.26)
    assert (numbers["scm_twin_changes", "n1"], numbers["scm_twin_changes", "n3"]) == (2.0, 0.0)
    assert (numbers["scm_twin_version", "n1"], numbers["scm_twin_version", "n3"]) == (1.0, 0.0)
