"""Every request has a trace id: its caller's, or one of its own, in answer, problem and log."""

import logging

import pytest
from starlette.responses import PlainTextResponse

from scm.api.app import create_app
from scm.api.audit_text import AuditText
from scm.api.audit_trail import newest_first
from scm.api.trace import HEADER, Traced, trace_id, trace_id_of, traced
from scm.clock import StepClock
from scm.runtime.part import BasePart, Service
from scm.runtime.station import Station
from scm.store.memory import MemoryStore
from scm.v2x.bus_memory import MemoryNetwork
from scm.v2x.exchange import Answer, Call
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.stop_request import StopRequest
from scm.v2x.write_ahead import DirectWriter

GIVEN = "4bf92f3577b34da6a3ce929d0e0e4736"
PARENT = f"00-{GIVEN}-00f067aa0ba902b7-01"


def test_the_id_of_the_caller_comes_back(client):
    answer = client("GET", "/healthz", headers={"traceparent": PARENT})
    assert answer.headers[HEADER] == GIVEN


def test_without_one_each_request_gets_its_own(client):
    first, second = (client("GET", "/healthz").headers[HEADER] for _ in range(2))
    assert len(first) == 32
    assert first != second
    assert trace_id() == ""


@pytest.mark.parametrize(
    "bad",
    ["", "00", f"ff-{GIVEN}-00f067aa0ba902b7-01", f"00-{'0' * 32}-00f067aa0ba902b7-01", "x" * 9000],
)
def test_what_cannot_be_read_is_replaced(bad):
    assert trace_id_of(bad) != GIVEN
    assert len(trace_id_of(bad)) == 32


def test_problems_and_the_log_name_it(client, caplog):
    with caplog.at_level(logging.WARNING, "scm.api.trace"):
        answer = client("GET", "/readyz", headers={"traceparent": PARENT})
    assert answer.json()["trace_id"] == GIVEN
    assert f"request_failed method=GET path=/readyz status=503 trace_id={GIVEN}" in caplog.text


def test_a_path_writes_no_line_of_its_own_into_the_log(client_of, caplog):
    app = Traced(PlainTextResponse("full", 507))
    with caplog.at_level(logging.WARNING, "scm.api.trace"):
        client_of(app)("PUT", "/api/v1/x%0Acity_stop%20by=ada")
    assert "path=/api/v1/x%0Acity_stop%20by%3Dada status=507" in caplog.text


def test_what_is_asked_of_the_city_carries_it(view, fake_city, city_map, client_of):
    fake_city.answers[StopRequest] = CityStop(t_ns=1, engaged=True)
    app = create_app(view, lambda request, wait_s: fake_city.ask(traced(request), wait_s), city_map)
    body = {"engaged": True, "by": "ada", "reason": "a hand"}
    headers = {"traceparent": PARENT}
    assert client_of(app)("PUT", "/api/v1/stop", json=body, headers=headers).status_code == 200
    assert [request.trace_id for request in fake_city.asked] == [GIVEN]
    assert traced(StopRequest(engaged=False, by="ada")).trace_id == "", "nothing is answered here"


class Button(BasePart):
    """A part with nothing but a red button."""

    name, role, period_ns, subscriptions = "world", "part", 1, ()
    services = (Service(StopRequest),)


def test_a_station_says_in_log_and_audit_under_which_trace_it_did_something(caplog):
    store, network = MemoryStore(), MemoryNetwork(StepClock(0))
    station = Station(Button(), network.bus("city", "world"), DirectWriter(store, "world", "s"))
    request = StopRequest(engaged=True, by="ada", trace_id=GIVEN)
    network.bus("city", "api").call(Call(request), print)
    with caplog.at_level(logging.INFO, "scm.runtime.station"):
        station.send(Answer(item, CityStop(t_ns=1, engaged=True)) for item in station.inbox())
    assert f"answered request=StopRequest reply=CityStop trace_id={GIVEN}" in caplog.text
    assert [row.trace_id for row in newest_first(store, AuditText({}))] == [GIVEN]


def test_the_gate_names_it_as_well(app, client_of):
    refused = client_of(app, "http://evil.example")(
        "GET", "/healthz", headers={"traceparent": PARENT}
    )
    assert (refused.status_code, refused.json()["trace_id"]) == (403, GIVEN)
