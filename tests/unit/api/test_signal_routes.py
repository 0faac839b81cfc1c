"""Wishes, flash, plans and proofs over REST: each with who, why and an end, none without proof."""

import time

import msgspec
import pytest

from scm.api.app import create_app
from scm.api.folders import Folders
from scm.records.signal_plans import SignalPhase, SignalPlan, SignalPolicy, SignalStage
from scm.records.signals import SignalOverride
from scm.v2x.messages.plan_request import PlanReply, PlanRequest
from scm.v2x.messages.signal_request import SignalReply, SignalRequest
from scm.v2x.messages.signal_site import SignalSite
from scm.v2x.messages.signal_status import SignalStatus

AT = "/api/v1/signals/crossing"
STAGES = [
    {"groups": ["south_east"], "green_s": 6.0, "extra_red_s": 0.5},
    {"groups": ["south_west"], "green_s": 3.0, "extra_red_s": 0.0},
]
TAKEN = SignalReply(junction="crossing", policy="fixed")


def phase(group):
    return SignalPhase(
        group=group,
        min_green_s=2.9,
        yellow_s=0.6,
        red_clear_s=4.6,
        passage_s=0.2,
        max1_s=7.7,
        max2_s=13.5,
    )


def site(**changes):
    told = SignalSite(
        junction="crossing",
        t_ns=1,
        phases=(phase("south_east"), phase("south_west")),
        conflicts=(("south_east", "south_west"),),
        rings=((("south_east", "south_west"),),),
        plans=(SignalPlan(plan="calm", about="long", cycle_s=28.4, stages=(), slots=()),),
        policies=(SignalPolicy(policy="actuated", about="who is there", has_detectors=True),),
    )
    return msgspec.structs.replace(told, **changes)


def status(**changes):
    told = SignalStatus(junction="crossing", t_ns=1, policy="fixed", plan="calm")
    return msgspec.structs.replace(told, **changes)


@pytest.fixture
def app(view, fake_city, city_map, tmp_path):
    fake_city.answers[SignalRequest] = TAKEN
    fake_city.answers[PlanRequest] = PlanReply(junction="crossing", plan="calm")
    folders = Folders(plans=tmp_path / "plans")
    return create_app(view, fake_city.ask, city_map, folders=folders)


@pytest.fixture
def heard(hear):
    hear(1.0, site(), status())


def refused(response, status_code, code):
    assert (response.status_code, response.json()["code"]) == (status_code, code)
    return response.json()["detail"]


@pytest.mark.parametrize(
    ("noun", "verb"),
    [
        ("calls", "call"),
        ("holds", "hold"),
        ("force-offs", "force_off"),
        ("omits", "omit"),
        ("preempts", "preempt"),
    ],
)
def test_a_wish_is_asked_for_with_who_why_and_an_end(client, fake_city, noun, verb):
    body = {"groups": ["south_east"], "by": "ada", "reason": "parade", "expires_s": 30.0}
    headers = {"Idempotency-Key": "k1"}
    assert client("POST", f"{AT}/{noun}", json=body, headers=headers).status_code == 200
    (asked,) = fake_city.asked
    assert (asked.verb, asked.groups, asked.request_id) == (verb, ("south_east",), "k1")
    assert (asked.by, asked.reason, asked.expires_s) == ("ada", "parade", 30.0)


@pytest.mark.parametrize(
    "body",
    [{"groups": []}, {"groups": ["a"], "expires_s": 901.0}, {"groups": ["a"], "colour": "green"}],
)
def test_a_wish_for_nobody_for_ever_or_for_a_colour_is_refused(client, fake_city, body):
    refused(client("POST", f"{AT}/holds", json=body), 422, "invalid")
    assert fake_city.asked == []


def test_wishes_of_one_kind_are_taken_back(client, fake_city):
    client("POST", f"{AT}/clear", json={"verb": "hold", "groups": ["south_east"]})
    (asked,) = fake_city.asked
    assert (asked.verb, asked.clears, asked.groups) == ("clear", "hold", ("south_east",))


def test_wishes_in_force_are_listed_a_page_at_a_time(client, hear):
    wish = SignalOverride(verb="hold", groups=("south_east",), by="ada", reason="", ends_ns=9)
    other = msgspec.structs.replace(wish, verb="omit", groups=("south_west",))
    hear(1.0, status(wishes=(wish, other)))
    first = client("GET", f"{AT}/wishes?limit=1").json()
    assert [one["verb"] for one in first["items"]] == ["hold"]
    second = client("GET", f"{AT}/wishes?limit=1&cursor={first['next']}").json()
    assert [one["verb"] for one in second["items"]] == ["omit"]


def test_flash_with_an_end_is_a_wish_and_without_one_a_plan(client, fake_city, heard):
    client("PUT", f"{AT}/flash", json={"engaged": True, "reason": "works", "expires_s": 60.0})
    client("PUT", f"{AT}/flash", json={"engaged": True, "reason": "works"})
    wish, plan = fake_city.asked
    assert (wish.verb, wish.policy, wish.expires_s) == ("policy", "flashing", 60.0)
    assert (plan.plan, plan.reason) == ("flash", "works")


def test_the_end_of_flash_takes_the_wish_back_and_goes_on_with_what_ran(client, fake_city, hear):
    flashing = SignalOverride(
        verb="policy", groups=(), by="ada", reason="", ends_ns=9, policy="flashing"
    )
    hear(1.0, site(), status(wishes=(flashing,), policy="actuated"))
    client("PUT", f"{AT}/flash", json={"engaged": False}, headers={"Idempotency-Key": "k"})
    clear, plan = fake_city.asked
    assert (clear.verb, clear.clears, clear.request_id) == ("clear", "policy", "k-wish")
    assert (plan.plan, plan.request_id) == ("", "k")


def test_the_site_has_a_tag_that_spares_reading_it_again(client, heard, hear):
    first = client("GET", f"{AT}/site")
    hear(11.0, site(t_ns=11))
    again = client("GET", f"{AT}/site", headers={"If-None-Match": first.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")


def test_before_the_controller_is_heard_there_are_no_plans(client):
    assert "has not reported yet" in refused(client("GET", f"{AT}/plans"), 503, "offline")
    refused(client("GET", "/api/v1/signals/moon/plans"), 404, "not_found")


def put(client, stages=STAGES, plan="rush", offset_s=None, **headers):
    named = {name.replace("_", "-"): value for name, value in headers.items()}
    body = {"about": "for the east", "by": "ada", "reason": "school", "stages": stages}
    body["offset_s"] = offset_s
    return client("PUT", f"{AT}/plans/{plan}", json=body, headers=named)


def prove(client, stages=STAGES):
    row = client("POST", f"{AT}/proofs", json={"plan": "rush", "stages": stages})
    assert row.status_code == 202
    where = row.headers["location"]
    for _ in range(1200):
        found = client("GET", where).json()
        if found["state"] not in ("waiting", "running"):
            return found
        time.sleep(0.1)
    raise AssertionError(found)


def test_nothing_is_saved_that_was_not_proven(client, heard):
    assert "not proven" in refused(put(client, If_None_Match="*"), 409, "unproven")
    assert [row["plan"] for row in client("GET", f"{AT}/plans").json()["items"]] == ["calm"]


@pytest.mark.parametrize("name", ["calm", "actuated", "flash"])
def test_a_name_that_means_something_else_is_refused(client, heard, name):
    refused(put(client, plan=name, If_None_Match="*"), 409, "name_taken")


def test_a_plan_is_proven_saved_edited_asked_for_and_deleted(client, fake_city, heard, hear):
    found = prove(client)
    assert (found["state"], found["error"]) == ("done", "")
    proof = client("GET", found["result"]).json()
    assert proof["states"] > 100
    assert put(client).status_code == 428
    first = put(client, If_None_Match="*")
    assert (first.status_code, first.json()["usable"]) == (201, True)
    refused(put(client, If_None_Match="*"), 412, "precondition_failed")
    refused(put(client, If_Match='"old"'), 412, "precondition_failed")
    tag = client("GET", f"{AT}/plans/rush").headers["etag"]
    changed = [STAGES[1], STAGES[0]]
    refused(put(client, changed, If_Match=tag), 409, "unproven")
    outside = refused(put(client, If_Match=tag, offset_s=20.5), 422, "invalid")
    assert "offset_s: got 20.5, expected less than 20.5, its cycle" in outside
    in_step = put(client, If_Match=tag, offset_s=7.5)
    assert (in_step.status_code, in_step.json()["offset_s"]) == (200, 7.5)
    client("PUT", f"{AT}/plan", json={"plan": "rush"})
    assert fake_city.asked[-1].stages == tuple(msgspec.convert(STAGES, list[SignalStage]))
    assert fake_city.asked[-1].offset_s == 7.5
    slower = msgspec.structs.replace(phase("south_west"), red_clear_s=6.0)
    hear(2.0, site(phases=(phase("south_east"), slower)))
    assert client("GET", f"{AT}/plans/rush").json()["usable"] is False
    refused(client("PUT", f"{AT}/plan", json={"plan": "rush"}), 409, "unproven")
    tag = client("GET", f"{AT}/plans/rush").headers["etag"]
    assert client("DELETE", f"{AT}/plans/rush").status_code == 428
    assert client("DELETE", f"{AT}/plans/rush", headers={"If-Match": tag}).status_code == 200
    refused(client("GET", f"{AT}/plans/rush"), 404, "not_found")


def test_a_plan_that_cannot_be_proven_says_why(client, heard):
    found = prove(client, [{**STAGES[0], "green_s": 1.0}, STAGES[1]])
    assert found["state"] == "failed"
    assert "expected at least 2.9 s" in found["error"]


def test_one_broken_file_does_not_hide_the_other_plans(client, heard, tmp_path):
    folder = tmp_path / "plans" / "crossing"
    folder.mkdir(parents=True)
    (folder / "bad.json").write_text("{", "utf-8")
    assert [row["plan"] for row in client("GET", f"{AT}/plans").json()["items"]] == ["calm"]
    assert "bad.json" in refused(client("GET", f"{AT}/plans/bad"), 409, "unreadable")
    refused(client("PUT", f"{AT}/plan", json={"plan": "bad"}), 409, "unreadable")


def test_no_file_outside_the_shelf_is_read(client, heard, fake_city, tmp_path):
    (tmp_path / "plans" / "crossing").mkdir(parents=True)  # without it no way leads out
    (tmp_path / "secret.json").write_text("{", "utf-8")
    assert client("PUT", f"{AT}/plan", json={"plan": "../../secret"}).status_code == 200
    assert fake_city.asked[-1].stages == ()  # the controller is asked, which knows no such plan
