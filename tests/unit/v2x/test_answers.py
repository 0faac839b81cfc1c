"""The answer book: one effect an id, whatever comes twice, late, or under a used id."""

import pytest
from msgspec import structs

from scm.clock import NS_PER_S
from scm.v2x.answers import MAX_ID_LENGTH, MIN_RETENTION_NS, RETENTION_NS, AnswerCache
from scm.v2x.exchange import Answer, Incoming
from scm.v2x.message import Refused
from scm.v2x.messages.plan_request import PlanReply, PlanRequest


def asked(request_id="r1", plan="calm", t_ns=0):
    return Incoming(PlanRequest(junction="x1", plan=plan, by="t", request_id=request_id), t_ns)


def done(item, plan="calm"):
    return Answer(item, PlanReply(junction="x1", plan=plan))


def test_a_retry_gets_the_answer_that_was_given():
    cache, first = AnswerCache(), asked()
    assert cache.check(first) == "do"
    cache.complete(done(first))
    met = cache.check(asked())
    assert met.reply == PlanReply(junction="x1", plan="calm")


def test_a_retry_under_another_trace_is_the_same_request():
    cache, first = AnswerCache(), asked()
    cache.check(first)
    cache.complete(done(first))
    again = structs.replace(asked().message, trace_id="4bf92f3577b34da6a3ce929d0e0e4736")
    assert cache.check(Incoming(again, 0)).reply == PlanReply(junction="x1", plan="calm")


def test_who_asks_while_it_is_done_waits_and_gets_the_same_answer():
    cache, first, second = AnswerCache(), asked(), asked()
    assert cache.check(first) == "do"
    assert cache.check(second) == "wait"
    assert [answer.to for answer in cache.complete(done(first))] == [first, second]


def test_an_id_of_another_request_is_refused_before_and_after_that_was_answered():
    cache, first = AnswerCache(), asked()
    cache.check(first)
    before = cache.check(asked(plan="busy"))
    cache.complete(done(first))
    after = cache.check(asked(plan="busy"))
    assert [met.reply.code for met in (before, after)] == ["invalid", "invalid"]


def test_without_an_id_everything_is_done_each_time():
    cache = AnswerCache()
    assert [cache.check(asked("")) for _ in range(2)] == ["do", "do"]


def test_the_same_id_of_another_class_of_requests_is_another_one():
    from scm.v2x.messages.monitor_reset import MonitorReset

    cache = AnswerCache()
    cache.check(asked())
    other = MonitorReset(junction="x1", by="t", reason="r", request_id="r1")
    assert cache.check(Incoming(other, 0)) == "do"


def test_a_request_that_failed_temporarily_may_succeed_when_repeated():
    cache, first = AnswerCache(), asked()
    cache.check(first)
    cache.complete(Answer(first, Refused(code="offline", detail="not now")))
    assert cache.check(asked()) == "do"


def test_a_refusal_for_good_is_an_answer_as_any_other():
    cache, first = AnswerCache(), asked()
    cache.check(first)
    cache.complete(Answer(first, Refused(code="full", detail="no room")))
    assert cache.check(asked()).reply == Refused(code="full", detail="no room")


def test_answers_are_read_back_from_what_was_stored():
    cache, first = AnswerCache(), asked()
    cache.check(first)
    again = AnswerCache(dict([cache.record(done(first))]))
    assert again.check(asked()).reply == PlanReply(junction="x1", plan="calm")
    assert again.check(asked(plan="busy")).reply.code == "invalid"


def test_after_a_day_an_answer_is_forgotten_and_named_to_the_store():
    cache, first = AnswerCache(), asked()
    cache.check(first)
    key, _ = cache.record(done(first))
    cache.complete(done(first))
    assert isinstance(cache.check(asked(t_ns=RETENTION_NS)), Answer)
    assert cache.check(asked(t_ns=RETENTION_NS + 1)) == "do"
    assert cache.dropped == [key]


def test_a_full_book_refuses_what_is_new_rather_than_forget_a_young_answer():
    cache = AnswerCache(most=3)
    for n in range(3):
        item = asked(f"r{n}", t_ns=n * NS_PER_S)
        cache.check(item)
        cache.complete(done(item))
    met = cache.check(asked("r3", t_ns=MIN_RETENTION_NS - 1))
    assert met.reply.code == "offline"
    assert isinstance(cache.check(asked("r0", t_ns=MIN_RETENTION_NS - 1)), Answer)
    assert cache.check(asked("r3", t_ns=MIN_RETENTION_NS)) == "do"
    assert cache.check(asked("r0", t_ns=MIN_RETENTION_NS)).reply.code == "offline"


def test_while_nothing_can_be_stored_only_what_is_known_is_answered():
    cache, first = AnswerCache(), asked()
    cache.check(first)
    cache.complete(done(first))
    assert cache.check(asked(), closed="disk full").reply == PlanReply(junction="x1", plan="calm")
    assert cache.check(asked("r2"), closed="disk full").reply.detail == "disk full"
    assert cache.check(asked(""), closed="disk full").reply.code == "offline"


@pytest.mark.parametrize("request_id", ["\x00", "é\U0001f600", "/" * 20, "x" * MAX_ID_LENGTH])
def test_whatever_an_id_is_made_of_its_key_is_plain(request_id):
    cache, first = AnswerCache(), asked(request_id)
    assert cache.check(first) == "do"
    key, _ = cache.record(done(first))
    assert key.isascii()
    assert key.count("/") == 1
    assert len(key) < 60


def test_an_id_without_end_is_refused():
    met = AnswerCache().check(asked("x" * (MAX_ID_LENGTH + 1)))
    assert met.reply.code == "invalid"


def test_a_second_answer_to_one_request_changes_nothing():
    cache, first = AnswerCache(), asked()
    cache.check(first)
    cache.complete(done(first))
    assert cache.complete(done(first, "busy")) == []
    assert cache.check(asked()).reply.plan == "calm"
