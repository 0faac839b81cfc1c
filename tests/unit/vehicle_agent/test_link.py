"""The agent's tie to the city, question by question and answer by answer."""

import pytest

from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import RunError
from scm.v2x.exchange import Call, Incoming
from scm.v2x.message import Refused
from scm.v2x.messages.join_request import JoinReply, JoinRequest
from scm.v2x.messages.lease_request import LeaseReply, LeaseRequest
from scm.v2x.messages.remove_request import RemoveRequest
from vehicle_agent.link import Link


def welcome(epoch=10):
    return JoinReply(vehicle="n7", x_m=1.0, y_m=2.0, yaw_rad=0.5, tag_id=3, epoch=epoch, t_ns=0)


def lease(epoch, owner="n7"):
    return LeaseReply(vehicle="n7", owner=owner, epoch=epoch, ttl_ms=1000)


def ask(link, now_ms):
    """Return the one question that is due, or None."""
    calls = link.due(now_ms * NS_PER_MS)
    return calls[0].request if calls else None


def answer(link, reply, request, now_ms=0):
    return link.accept_reply(Incoming(reply, now_ms * NS_PER_MS, Call(request)))


@pytest.fixture
def link():
    return Link("n7", "nigel", "remote", "a", "s1")


@pytest.fixture
def inside(link):
    assert answer(link, welcome(), ask(link, 0))
    return link


def test_it_asks_to_join_once_a_second_with_the_same_id_until_it_is_answered(link):
    first = ask(link, 0)
    assert isinstance(first, JoinRequest)
    assert (first.vehicle, first.session, first.spawn) == ("n7", "s1", "a")
    assert ask(link, 999) is None
    assert ask(link, 1000) == first


def test_it_asks_for_the_tag_that_the_car_wears():
    assert ask(Link("n7", "nigel", "real", "", "s1", 7), 0).tag_id == 7
    assert ask(Link("n7", "nigel", "real", "", "s1"), 0).tag_id is None


def test_it_does_not_ask_before_it_knows_its_session():
    assert ask(Link("n7", "nigel", "remote", "", ""), 0) is None


def test_a_refused_joining_is_asked_anew_and_its_reason_kept(link):
    first = ask(link, 0)
    answer(link, Refused(code="full", detail="no place is free"), first)
    assert link.reason == "no place is free"
    assert not link.is_inside
    assert ask(link, 1000).request_id != first.request_id


def test_a_joining_that_can_never_be_is_given_up(link):
    refused = Refused(code="invalid", detail="map x: no spawn 'zz'")
    with pytest.raises(RunError, match="no spawn 'zz'"):
        answer(link, refused, ask(link, 0))


def test_a_newcomer_gives_up_a_name_that_stays_taken(link):
    refused = Refused(code="owned", detail="there is already one named 'n7'")
    for t_ms in range(0, 10_000, 1000):
        answer(link, refused, ask(link, t_ms), t_ms)
    with pytest.raises(RunError, match="already one named 'n7'"):
        answer(link, refused, ask(link, 10_000), 10_000)


def test_a_car_that_was_inside_waits_for_its_name_as_long_as_it_takes(inside):
    inside.leave("the city came back")
    refused = Refused(code="owned", detail="there is already one named 'n7'")
    for t_ms in range(20_000, 60_000, 1000):
        answer(inside, refused, ask(inside, t_ms), t_ms)
    assert not inside.is_inside


def test_an_unanswered_joining_keeps_its_id(link):
    first = ask(link, 0)
    answer(link, Refused(code="timeout", detail="no answer"), first)
    assert ask(link, 1000) == first


def test_a_welcome_tells_place_and_epoch(inside):
    assert inside.standing == "own"
    assert inside.epoch == 10
    assert (inside.start.x, inside.start.y, inside.start.yaw) == (1.0, 2.0, 0.5)


def test_inside_it_renews_five_times_a_second(inside):
    beat = ask(inside, 200)
    assert isinstance(beat, LeaseRequest)
    assert (beat.verb, beat.epoch) == ("renew", 10)
    assert ask(inside, 399) is None
    assert ask(inside, 400) == beat


@pytest.mark.parametrize("code", ["timeout", "offline"])
def test_the_link_is_dead_one_second_after_the_last_answer(inside, code):
    beat = ask(inside, 200)
    answer(inside, lease(10), beat, 300)
    answer(inside, Refused(code=code, detail=""), ask(inside, 400), 1300)
    assert inside.is_alive(1300 * NS_PER_MS)
    assert not inside.is_alive(1301 * NS_PER_MS)


def test_a_refused_renewal_means_somebody_else_drives_and_the_link_lives(inside):
    answer(inside, Refused(code="owned", detail=""), ask(inside, 2000), 2000)
    assert inside.standing == "foreign"
    assert inside.is_alive(2 * NS_PER_S)


def test_a_car_that_the_city_does_not_know_joins_again(inside):
    answer(inside, Refused(code="not_found", detail=""), ask(inside, 200), 200)
    assert inside.standing == "outside"
    assert isinstance(ask(inside, 1200), JoinRequest)


def test_a_loss_asks_for_one_newer_lease_however_often(inside):
    inside.regain()
    first = ask(inside, 200)
    assert first.verb == "acquire"
    inside.regain()
    assert ask(inside, 400) == first


def test_only_a_newer_epoch_ends_the_loss(inside):
    inside.regain()
    request = ask(inside, 200)
    answer(inside, lease(10), request)
    assert inside.standing == "regaining"
    answer(inside, lease(11), request)
    assert (inside.standing, inside.epoch) == ("own", 11)


def test_a_late_refusal_of_an_old_renewal_does_not_take_a_regained_car_away(inside):
    old = ask(inside, 200)
    inside.regain()
    answer(inside, lease(11), ask(inside, 400))
    answer(inside, Refused(code="owned", detail=""), old)
    assert inside.standing == "own"


def test_a_refused_newer_lease_leaves_the_car_to_the_other(inside):
    inside.regain()
    answer(inside, Refused(code="owned", detail=""), ask(inside, 200))
    assert inside.standing == "foreign"


def test_two_losses_ask_for_two_leases(inside):
    inside.regain()
    first = ask(inside, 200)
    answer(inside, lease(11), first)
    inside.regain()
    assert ask(inside, 400).request_id != first.request_id


def test_outside_nothing_can_be_regained_or_given_away(link):
    link.regain()
    link.give_way()
    assert link.standing == "outside"


def test_a_second_welcome_changes_nothing(inside):
    assert not answer(inside, welcome(epoch=99), JoinRequest(vehicle="n7", session="s1"))
    assert inside.epoch == 10


def test_whoever_never_asked_to_join_leaves_without_a_word(link):
    assert link.goodbye() == []


def test_it_takes_its_own_car_off_the_map_and_no_other_of_that_name(inside):
    (call,) = inside.goodbye()
    expected = RemoveRequest(vehicle="n7", reason="its agent leaves", session="s1")
    assert call.request == expected


@pytest.mark.parametrize("lost", ["timeout", "offline"])
def test_it_says_goodbye_too_where_the_city_may_have_let_it_in_unheard(link, lost):
    asked = ask(link, 0)
    assert len(link.goodbye()) == 1
    answer(link, Refused(code=lost, detail="no answer"), asked)
    assert len(link.goodbye()) == 1


def test_whoever_was_refused_leaves_without_a_word(link):
    answer(link, Refused(code="full", detail="no place is free"), ask(link, 0))
    assert link.goodbye() == []
