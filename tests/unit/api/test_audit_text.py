"""Each entry of the audit log is said in words, and says who really asked."""

import msgspec
import pytest

from scm.api.app import create_app
from scm.api.audit_text import AuditText
from scm.api.keys import KeyRing
from scm.clock import StepClock
from scm.runtime.part import BasePart, Service
from scm.runtime.station import Station
from scm.store.audit import AuditLog
from scm.store.memory import MemoryStore
from scm.v2x.bus_memory import MemoryNetwork
from scm.v2x.exchange import Answer, Call
from scm.v2x.message import Request
from scm.v2x.messages import message_classes
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.remove_request import RemoveReply, RemoveRequest
from scm.v2x.messages.stop_request import StopRequest
from scm.v2x.write_ahead import DirectWriter

API = "/api/v1"
REMOVAL = RemoveRequest(vehicle="n9", reason="battery empty")
EXAMPLES = {
    "BayRequest": ({"vehicle": "n9", "bay": "a3"}, "give n9 a3"),
    "ParkRequest": ({"vehicle": "n9", "goal": "a3"}, "park n9 at a3"),
    "BoxesRequest": ({}, "put the boxes back to their places"),
    "CalibrationRequest": (
        {"camera": "ceiling", "verb": "use", "calibration": "june_lens"},
        "put calibration june lens in force at ceiling",
    ),
    "JoinRequest": ({"vehicle": "n9"}, "join as n9, a remote nigel"),
    "LeaseRequest": ({"vehicle": "n9", "verb": "steal"}, "take from its owner the wheel of n9"),
    "LightRequest": ({"vehicle": "n9"}, "set the lights of n9"),
    "MonitorReset": ({"junction": "north_gate"}, "reset the monitor of north gate"),
    "PlanRequest": ({"junction": "crossing", "plan": "calm"}, "run calm at crossing"),
    "RemoveRequest": ({"vehicle": "n9"}, "take n9 off the map"),
    "RouteRequest": ({"vehicle": "n9", "via": ["a_b"]}, "send n9 through a b"),
    "SignalRequest": (
        {"junction": "crossing", "verb": "hold", "groups": ["north"], "expires_s": 60.0},
        "hold north at crossing for 60 s",
    ),
    "SpawnRequest": ({"vehicle": "n9", "car": "nigel"}, "add n9, a nigel"),
    "StopRequest": ({"engaged": True}, "stop the city"),
    "TwinSendRequest": (
        {"vehicle": "n9", "send": "n5", "by": "ada"},
        "send n5 to decide whose n9's change is",
    ),
    "VersionRequest": (
        {"vehicle": "n9", "version": 2, "by": "ada"},
        "predict n9 by version 2 of its file",
    ),
}


def test_every_request_that_has_an_effect_is_said_in_words():
    kinds = [kind for kind in message_classes() if issubclass(kind, Request)]
    assert {kind.__name__ for kind in kinds if kind.HAS_EFFECT} == set(EXAMPLES)
    words = AuditText({})
    for kind, (request, said) in EXAMPLES.items():
        assert words.of(kind, request) == said


def test_an_entry_that_is_not_as_it_was_written_is_called_by_its_kind(app):
    words = app.state.words
    assert words.of("LeaseRequest", {"vehicle": 3}) == "LeaseRequest"
    assert words.of("Forgotten_Request", {}) == "Forgotten Request"
    assert words.of("POST /api/v1/nothing", {}).endswith("unknown address, POST /api/v1/nothing")


@pytest.fixture
def store():
    return MemoryStore()


def asked_by(store):
    return [deed.by for _, deed in AuditLog(store).deeds()]


@pytest.mark.parametrize(
    ("headers", "actor"),
    [
        ({"User-Agent": "travel_times.py scm-client"}, "travel_times.py"),
        ({"User-Agent": "curl/8.5.0"}, "curl"),
        ({"User-Agent": "Mozilla/5.0", "Origin": "http://127.0.0.1:8000"}, "dashboard"),
        ({"User-Agent": ""}, "an unnamed program"),
        ({"User-Agent": "a\tb<i>c/1"}, "a_b_i_c"),
    ],
)
def test_without_keys_a_change_is_the_program_that_called(
    view, fake_city, city_map, store, client_of, headers, actor
):
    fake_city.answers[RemoveRequest] = RemoveReply(vehicle="n9")
    call = client_of(create_app(view, fake_city.ask, city_map, state=store))
    assert call("DELETE", f"{API}/vehicles/n9", headers=headers).status_code == 200
    (row,) = call("GET", f"{API}/audit").json()["items"]
    assert (row["by"], row["text"]) == (actor, "take a car off the map (n9)")


def test_with_keys_it_is_the_keys_owner_and_the_program(view, fake_city, city_map, client_of):
    keys = KeyRing(MemoryStore())
    key = keys.add("ada", "operator", 0)
    store = MemoryStore()
    fake_city.answers[StopRequest] = CityStop(t_ns=1, engaged=True)
    call = client_of(create_app(view, fake_city.ask, city_map, keys=keys, state=store))
    for extra in ({"User-Agent": "curl/8"}, {"Origin": "http://127.0.0.1:8000"}):
        headers = {"Authorization": f"Bearer {key}", **extra}
        body = {"engaged": True, "by": "bob"}
        assert call("PUT", f"{API}/stop", json=body, headers=headers).status_code == 200
    assert asked_by(store) == ["ada (curl)", "ada"]
    assert [request.by for request in fake_city.asked] == ["ada", "ada"]


def test_a_body_that_names_nobody_is_signed_by_the_program(view, fake_city, city_map, client_of):
    fake_city.answers[StopRequest] = CityStop(t_ns=1, engaged=True)
    call = client_of(create_app(view, fake_city.ask, city_map))
    headers = {"User-Agent": "curl/8"}
    call("PUT", f"{API}/stop", json={"engaged": True}, headers=headers)
    assert fake_city.asked[0].by == "curl"


class Door(BasePart):
    """A part with nothing but one request that it serves."""

    name, role, period_ns, subscriptions = "world", "part", 1, ()
    services = (Service(RemoveRequest), Service(StopRequest))


class Other(Door):
    name, services = "demand", ()


@pytest.mark.parametrize(
    ("request_", "by"),
    [
        (REMOVAL, ""),
        (msgspec.structs.replace(REMOVAL, actor="travel_times.py"), "travel_times.py"),
        (StopRequest(engaged=True, by="ada"), "ada"),
        (StopRequest(engaged=True, by="ada", actor="ada (curl)"), "ada (curl)"),
        (StopRequest(engaged=True, by="ada", actor="curl"), "ada (curl)"),
    ],
)
def test_a_part_notes_who_sent_a_request_not_whom_it_concerns(store, request_, by):
    network = MemoryNetwork(StepClock(0))
    station = Station(Door(), network.bus("city", "world"), DirectWriter(store, "world", "s"))
    network.bus("city", "api").call(Call(request_), print)
    station.send(
        Answer(
            item,
            CityStop(t_ns=1, engaged=True)
            if isinstance(request_, StopRequest)
            else RemoveReply(vehicle="n9"),
        )
        for item in station.inbox()
    )
    assert asked_by(store) == [by]


def test_what_a_part_asks_bears_its_name(store):
    network = MemoryNetwork(StepClock(0))
    station = Station(Door(), network.bus("city", "world"), DirectWriter(store, "world", "s"))
    Station(Other(), network.bus("city", "demand")).send([Call(REMOVAL)])
    station.send(Answer(item, RemoveReply(vehicle="n9")) for item in station.inbox())
    assert asked_by(store) == ["demand"]
