"""Every request has a trace id: its caller's, or one of its own, in answer, problem and log."""

import logging

import pytest

from scm.api.trace import HEADER, trace_id, trace_id_of

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


def test_the_gate_names_it_as_well(app, client_of):
    refused = client_of(app, "http://evil.example")(
        "GET", "/healthz", headers={"traceparent": PARENT}
    )
    assert (refused.status_code, refused.json()["trace_id"]) == (403, GIVEN)
