"""Tokens run out, say so, and come back; what must never wait never does."""

import pytest
from starlette.responses import PlainTextResponse

from scm.api import limits
from scm.api.limits import Buckets, Limited, Policy
from scm.clock import NS_PER_S, StepClock

POLICY = Policy("looking", 3, 0.5)


@pytest.fixture
def clock():
    return StepClock()


@pytest.fixture
def client(clock, client_of):
    app = Limited(PlainTextResponse("yes"), clock=clock, looking=POLICY, changing=POLICY)
    return client_of(app)


def test_a_bucket_gives_what_it_holds_then_what_time_brings_back(clock):
    buckets = Buckets(POLICY, clock)
    assert [buckets.acquire("a") for _ in range(3)] == [(2.0, 0.0), (1.0, 0.0), (0.0, 0.0)]
    assert buckets.acquire("a") == (0.0, 2.0)
    clock.set_ns(clock.now_ns() + NS_PER_S)
    assert buckets.acquire("a") == (0.5, 1.0)
    clock.set_ns(clock.now_ns() + NS_PER_S)
    assert buckets.acquire("a") == (0.0, 0.0)
    clock.set_ns(clock.now_ns() + 3600 * NS_PER_S)
    assert buckets.acquire("a") == (2.0, 0.0)  # never more than it holds


def test_callers_have_buckets_of_their_own_and_the_oldest_is_forgotten(clock, monkeypatch):
    monkeypatch.setattr(limits, "MAX_CALLERS", 2)
    buckets = Buckets(POLICY, clock)
    for caller in ("a", "a", "b", "c", "a"):
        left, _ = buckets.acquire(caller)
    assert left == 2.0


def test_answers_say_what_is_left(client):
    told = client("GET", "/api/v1/map").headers
    assert told["ratelimit-policy"] == '"looking";q=3;w=6'
    assert told["ratelimit"] == '"looking";r=2;t=2'


def test_who_asks_too_often_is_told_when_to_come_back(client):
    for _ in range(3):
        assert client("GET", "/api/v1/map").status_code == 200
    refused = client("GET", "/api/v1/map")
    assert (refused.status_code, refused.json()["code"]) == (429, "too_many")
    assert refused.headers["retry-after"] == "2"
    assert refused.headers["ratelimit"] == '"looking";r=0;t=6'
    assert client("POST", "/api/v1/vehicles").status_code == 200


@pytest.mark.parametrize(
    ("method", "path"),
    [("PUT", "/api/v1/stop"), ("GET", "/healthz"), ("GET", "/api/v1/stream"), ("GET", "/static/a")],
)
def test_the_stop_health_and_streams_never_wait(client, method, path):
    for _ in range(5):
        assert client(method, path).status_code == 200
