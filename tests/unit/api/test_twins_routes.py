"""Watched cars over REST: a row each, all of one, and another version put in force."""

import msgspec
import pytest
from msgspec.structs import replace

from scm.api.twin_rows import in_short
from scm.api.view import FORGET_TWINS_NS
from scm.clock import NS_PER_S
from scm.records.twins import Twin, TwinCause
from scm.v2x.message import Refused
from scm.v2x.messages.presence import Presence
from scm.v2x.messages.twin_send_request import TwinSendRequest
from scm.v2x.messages.twin_status import TwinStatus
from scm.v2x.messages.version_request import VersionRequest
from tests.unit.api.conftest import Client, bearer
from tests.unit.api.made_twins import (
    NAMED,
    NOW_NS,
    blind,
    change,
    floor_changed,
    undecided,
    watched,
)

URL = "/api/v1/twins"
NORTH = TwinCause(kind="camera", probability=0.95, camera="north")
PART = Presence(role="part", station="twin", session="s", alive=True)


def defaults_of(kind):
    return {field.name: field.default for field in msgspec.structs.fields(kind)}


def test_record_has_the_fields_of_the_message():
    assert defaults_of(Twin) == defaults_of(TwinStatus)


def test_rows_say_what_changed_in_short(client, hear):
    assert client("GET", URL).json() == {"items": [], "next": None}
    hear(1.0, undecided(), watched(), blind(), floor_changed())
    first, second, third, fourth = client("GET", URL).json()["items"]
    assert first == {
        "vehicle": "n1", "car": "nigel", "t_ns": NOW_NS, "state": "watching", "reason": "",
        "driven_s": 1104.3, "version": 1, "changes": 2, "changed_ns": 1130 * NS_PER_S,
        "search": "searching", "newest": "looks like tyre grip",
        "x_m": None, "y_m": None, "radius_m": None,
    }  # fmt: skip
    assert second["newest"] == "looks like steer trim or gyro bias"
    assert (third["state"], third["reason"]) == ("blind", "no command that it obeyed is known")
    assert (third["changes"], third["newest"], third["changed_ns"]) == (0, "", None)
    assert (fourth["search"], fourth["newest"]) == (
        "elsewhere", "the floor at (1.2, 0.4), not the car"
    )  # fmt: skip
    assert (fourth["x_m"], fourth["y_m"], fourth["radius_m"]) == (1.2, 0.4, 0.3)


@pytest.mark.parametrize(
    ("found", "words"),
    [
        (change(1), "looks like steer trim or gyro bias"),
        (change(1, search="named", effects=(NAMED,)), "steer trim, 99.9 %"),
        (
            change(1, search="named", effects=(replace(NAMED, probability=0.97),) * 2),
            "steer trim, 97 % and steer trim, 97 %",
        ),
        (change(1, search="unexplained"), "no known effect explains it"),
        (change(1, cause="camera", causes=(NORTH,)), "camera north, not the car"),
        (change(1, cause="camera", causes=(replace(NORTH, camera=""),)), "camera, not the car"),
    ],
)
def test_change_in_short_is_what_explains_it_or_what_it_looks_like(found, words):
    assert in_short(found) == words


def test_list_is_cut_into_pages(client, hear):
    hear(1.0, undecided(), watched(), blind())
    answer = client("GET", f"{URL}?limit=2")
    assert [row["vehicle"] for row in answer.json()["items"]] == ["n1", "n2"]
    rest = client("GET", f"{URL}?limit=2&cursor={answer.json()['next']}").json()
    assert [row["vehicle"] for row in rest["items"]] == ["n3"]


def test_one_car_has_all_of_its_status(client, hear):
    hear(1.0, watched())
    body = client("GET", f"{URL}/n1").json()
    assert body == msgspec.json.decode(msgspec.json.encode(watched()))
    assert body["changes"][0]["effects"][0]["parameters"][0]["low"] == -0.0334


def test_car_that_is_gone_for_long_is_forgotten(client, hear):
    hear(1.0, watched())
    hear(FORGET_TWINS_NS / NS_PER_S - 10)
    assert len(client("GET", URL).json()["items"]) == 1
    hear(FORGET_TWINS_NS / NS_PER_S + 10)
    assert client("GET", URL).json()["items"] == []


@pytest.mark.parametrize("is_watched", [False, True])
def test_car_without_a_status_is_refused_with_what_to_do(client, hear, snapshot, is_watched):
    hear(1.0, snapshot(n1=(0, 0, 0)), *([PART] if is_watched else []))
    body = {"version": 0}
    put, post = {"json": body}, {"json": {"send": "n2"}}
    for method, path, sent in (
        ("GET", "", {}), ("PUT", "/version", put), ("POST", "/drive", post)
    ):  # fmt: skip
        unknown = client(method, f"{URL}/n7{path}", **sent)
        assert (unknown.status_code, unknown.json()["detail"]) == (
            404, "there is no car named 'n7'",
        )  # fmt: skip
        known = client(method, f"{URL}/n1{path}", **sent)
        assert known.status_code == 404
        words = "was not looked at yet" if is_watched else "expected the part 'twin', `scm up"
        assert words in known.json()["detail"]


def test_version_is_put_in_force_in_the_name_of_who_requests_it(client, hear, fake_city):
    hear(1.0, watched())
    fake_city.answers[VersionRequest] = watched(version=0)
    body = {"version": 0, "by": "ada", "reason": "wheels straightened"}
    headers = {"Idempotency-Key": "k1"}
    for _ in range(2):
        answer = client("PUT", f"{URL}/n1/version", json=body, headers=headers)
        assert (answer.status_code, answer.json()["version"]) == (200, 0)
    (request,) = fake_city.asked
    sent = (request.vehicle, request.version, request.by, request.reason, request.request_id)
    assert sent == ("n1", 0, "ada", "wheels straightened", "k1")
    texts = {row["text"] for row in client("GET", "/api/v1/audit").json()["items"]}
    assert texts == {"predict a car by another version of its file (n1)"}


def test_car_is_sent_in_the_name_of_who_agrees(client, hear, fake_city):
    hear(1.0, undecided())
    assert client("GET", f"{URL}/n2").json()["changes"][0]["drive"]["state"] == "open"
    fake_city.answers[TwinSendRequest] = undecided(state="waiting", by="ada")
    body = {"send": "n1", "by": "ada", "reason": "it stands about"}
    answer = client("POST", f"{URL}/n2/drive", json=body, headers={"Idempotency-Key": "k1"})
    assert (answer.status_code, answer.json()["changes"][0]["drive"]["by"]) == (200, "ada")
    (request,) = fake_city.asked
    sent = (request.vehicle, request.send, request.by, request.reason, request.request_id)
    assert sent == ("n2", "n1", "ada", "it stands about", "k1")
    detail = "no change of n2 waits to be decided by 'n9', expected n1"
    fake_city.answers[TwinSendRequest] = Refused(code="not_found", detail=detail)
    refused = client("POST", f"{URL}/n2/drive", json={"send": "n9"})
    assert (refused.status_code, refused.json()["detail"]) == (404, detail)
    for wrong in ({}, {"send": "N 9"}, {"send": "n1", "vehicle": "n2"}):
        assert client("POST", f"{URL}/n2/drive", json=wrong).status_code == 422


def test_unknown_version_is_refused_as_the_part_does(client, hear, fake_city):
    hear(1.0, watched())
    detail = "n1 has no version 9; it has 0 to 2"
    fake_city.answers[VersionRequest] = Refused(code="not_found", detail=detail)
    answer = client("PUT", f"{URL}/n1/version", json={"version": 9})
    assert (answer.status_code, answer.json()["detail"]) == (404, detail)
    for wrong in ({"version": -1}, {"version": 0.5}, {}, {"version": 0, "car": "n1"}):
        assert client("PUT", f"{URL}/n1/version", json=wrong).status_code == 422


@pytest.mark.parametrize(
    ("method", "path", "body"),
    [("PUT", "version", {"version": 1}), ("POST", "drive", {"send": "n2"})],
)
def test_change_needs_an_operator(keyed_app, hear, key_of, fake_city, method, path, body):
    hear(1.0, watched())
    fake_city.answers |= {VersionRequest: watched(), TwinSendRequest: watched()}
    client, codes = Client(keyed_app), []
    for role in ("viewer", "operator"):
        headers = bearer(key_of(role))
        answer = client(method, f"{URL}/n1/{path}", json=body, headers=headers)
        codes.append(answer.status_code)
    assert codes == [403, 200]
