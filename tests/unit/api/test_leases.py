"""Leases by REST: list, take, keep, give back, each in the caller's own name."""

import msgspec
import pytest

from scm.api.app import create_app
from scm.api.keys import KeyRing
from scm.store.memory import MemoryStore
from scm.v2x.message import Refused
from scm.v2x.messages.lease_request import LeaseReply, LeaseRequest

LEASES = "/api/v1/leases"


@pytest.fixture
def leased(fake_city):
    reply = LeaseReply(vehicle="n1", owner="anna", epoch=7, ttl_ms=1000)
    fake_city.answers[LeaseRequest] = reply
    return fake_city


def test_all_leases_are_listed_by_pages(client, hear, snapshot):
    told = snapshot(n2=(0.0, 0.0, 0.0), n1=(0.0, 0.0, 0.0))
    first, second = told.vehicles
    first = msgspec.structs.replace(first, owner="desk", epoch=3, lease_left_ms=640.4)
    second = msgspec.structs.replace(second, epoch=9)
    hear(1.0, msgspec.structs.replace(told, vehicles=(first, second)))
    page = client("GET", f"{LEASES}?limit=1").json()
    assert page["items"] == [{"vehicle": "n1", "owner": "world", "epoch": 9, "left_ms": None}]
    page = client("GET", f"{LEASES}?limit=1&cursor={page['next']}").json()
    assert page["items"] == [{"vehicle": "n2", "owner": "desk", "epoch": 3, "left_ms": 640}]
    assert page["next"] is None
    assert client("GET", f"{LEASES}/n2").json()["owner"] == "desk"
    assert client("GET", f"{LEASES}/n9").status_code == 404


def test_taking_asks_for_the_lease_in_the_callers_name(client, leased):
    headers = {"Idempotency-Key": "k1"}
    reply = client("POST", f"{LEASES}/n1", json={"program": "keeper"}, headers=headers)
    assert (reply.status_code, reply.json()["epoch"]) == (201, 7)
    assert leased.asked == [
        LeaseRequest(
            request_id="k1", vehicle="n1", owner="this machine/keeper", verb="acquire", ttl_ms=1000
        )
    ]


def test_only_a_reason_takes_it_from_somebody(client, leased):
    client("POST", f"{LEASES}/n1", json={"reason": " "})
    client("POST", f"{LEASES}/n1", json={"reason": "it blocks"})
    assert [request.verb for request in leased.asked] == ["acquire", "steal"]


def test_keeping_and_giving_back_name_the_epoch(client, leased):
    client("PUT", f"{LEASES}/n1", json={"epoch": 7, "ttl_ms": 500})
    client("DELETE", f"{LEASES}/n1?epoch=7")
    renew, release = leased.asked
    assert (renew.verb, renew.epoch, renew.ttl_ms) == ("renew", 7, 500)
    assert (release.verb, release.epoch) == ("release", 7)


@pytest.mark.parametrize("body", [{"ttl_ms": 99}, {"ttl_ms": 60_001}, {"owner": "bo"}])
def test_a_wrong_wish_is_refused_before_anybody_is_asked(client, leased, body):
    assert client("POST", f"{LEASES}/n1", json=body).status_code == 422
    assert leased.asked == []


def test_a_refusal_of_the_world_is_a_conflict(client, fake_city):
    fake_city.answers[LeaseRequest] = Refused(code="owned", detail="leased to 'bo'")
    assert client("POST", f"{LEASES}/n1", json={}).status_code == 409


def test_a_viewer_takes_nothing(view, leased, city_map, client_of):
    ring = KeyRing(MemoryStore())
    client = client_of(create_app(view, leased.ask, city_map, keys=ring))
    header = {"Authorization": f"Bearer {ring.add('vera', 'viewer', 1)}"}
    assert client("GET", LEASES, headers=header).status_code == 200
    assert client("POST", f"{LEASES}/n1", json={}, headers=header).status_code == 403
    assert leased.asked == []
