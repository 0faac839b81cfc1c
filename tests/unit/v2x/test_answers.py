"""The answer book: one effect an id, whatever comes twice, late, or under a used id."""

import pytest
from msgspec import structs

from scm.clock import NS_PER_S
from scm.v2x.answers import KEPT_NS, LONGEST_ID, SURE_NS, AnswerBook
from scm.v2x.exchange import Answer, Incoming
from scm.v2x.message import Refused
from scm.v2x.messages.plan_request import PlanReply, PlanRequest


def asked(request_id="r1", plan="calm", t_ns=0):
    return Incoming(PlanRequest(junction="x1", plan=plan, by="t", request_id=request_id), t_ns)


def done(item, plan="calm"):
    return Answer(item, PlanReply(junction="x1", plan=plan))


def test_a_retry_gets_the_answer_that_was_given():
    book, first = AnswerBook(), asked()
    assert book.meet(first) == "do"
    book.settle(done(first))
    met = book.meet(asked())
    assert met.reply == PlanReply(junction="x1", plan="calm")


def test_a_retry_under_another_trace_is_the_same_request():
    book, first = AnswerBook(), asked()
    book.meet(first)
    book.settle(done(first))
    again = structs.replace(asked().message, trace_id="4bf92f3577b34da6a3ce929d0e0e4736")
    assert book.meet(Incoming(again, 0)).reply == PlanReply(junction="x1", plan="calm")


def test_who_asks_while_it_is_done_waits_and_gets_the_same_answer():
    book, first, second = AnswerBook(), asked(), asked()
    assert book.meet(first) == "do"
    assert book.meet(second) == "wait"
    assert [answer.to for answer in book.settle(done(first))] == [first, second]


def test_an_id_of_another_request_is_refused_before_and_after_that_was_answered():
    book, first = AnswerBook(), asked()
    book.meet(first)
    before = book.meet(asked(plan="busy"))
    book.settle(done(first))
    after = book.meet(asked(plan="busy"))
    assert [met.reply.code for met in (before, after)] == ["invalid", "invalid"]


def test_without_an_id_everything_is_done_each_time():
    book = AnswerBook()
    assert [book.meet(asked("")) for _ in range(2)] == ["do", "do"]


def test_the_same_id_of_another_class_of_requests_is_another_one():
    from scm.v2x.messages.monitor_reset import MonitorReset

    book = AnswerBook()
    book.meet(asked())
    other = MonitorReset(junction="x1", by="t", reason="r", request_id="r1")
    assert book.meet(Incoming(other, 0)) == "do"


def test_what_could_not_be_done_just_now_may_be_done_when_asked_again():
    book, first = AnswerBook(), asked()
    book.meet(first)
    book.settle(Answer(first, Refused(code="offline", detail="not now")))
    assert book.meet(asked()) == "do"


def test_a_refusal_for_good_is_an_answer_as_any_other():
    book, first = AnswerBook(), asked()
    book.meet(first)
    book.settle(Answer(first, Refused(code="full", detail="no room")))
    assert book.meet(asked()).reply == Refused(code="full", detail="no room")


def test_answers_are_read_back_from_what_was_stored():
    book, first = AnswerBook(), asked()
    book.meet(first)
    again = AnswerBook(dict([book.record(done(first))]))
    assert again.meet(asked()).reply == PlanReply(junction="x1", plan="calm")
    assert again.meet(asked(plan="busy")).reply.code == "invalid"


def test_after_a_day_an_answer_is_forgotten_and_named_to_the_store():
    book, first = AnswerBook(), asked()
    book.meet(first)
    key, _ = book.record(done(first))
    book.settle(done(first))
    assert isinstance(book.meet(asked(t_ns=KEPT_NS)), Answer)
    assert book.meet(asked(t_ns=KEPT_NS + 1)) == "do"
    assert book.forgotten == [key]


def test_a_full_book_refuses_what_is_new_rather_than_forget_a_young_answer():
    book = AnswerBook(most=3)
    for n in range(3):
        item = asked(f"r{n}", t_ns=n * NS_PER_S)
        book.meet(item)
        book.settle(done(item))
    met = book.meet(asked("r3", t_ns=SURE_NS - 1))
    assert met.reply.code == "offline"
    assert isinstance(book.meet(asked("r0", t_ns=SURE_NS - 1)), Answer)
    assert book.meet(asked("r3", t_ns=SURE_NS)) == "do"
    assert book.meet(asked("r0", t_ns=SURE_NS)).reply.code == "offline"


def test_while_nothing_can_be_stored_only_what_is_known_is_answered():
    book, first = AnswerBook(), asked()
    book.meet(first)
    book.settle(done(first))
    assert book.meet(asked(), closed="disk full").reply == PlanReply(junction="x1", plan="calm")
    assert book.meet(asked("r2"), closed="disk full").reply.detail == "disk full"
    assert book.meet(asked(""), closed="disk full").reply.code == "offline"


@pytest.mark.parametrize("request_id", ["\x00", "é\U0001f600", "/" * 20, "x" * LONGEST_ID])
def test_whatever_an_id_is_made_of_its_key_is_plain(request_id):
    book, first = AnswerBook(), asked(request_id)
    assert book.meet(first) == "do"
    key, _ = book.record(done(first))
    assert key.isascii()
    assert key.count("/") == 1
    assert len(key) < 60


def test_an_id_without_end_is_refused():
    met = AnswerBook().meet(asked("x" * (LONGEST_ID + 1)))
    assert met.reply.code == "invalid"


def test_a_second_answer_to_one_request_changes_nothing():
    book, first = AnswerBook(), asked()
    book.meet(first)
    book.settle(done(first))
    assert book.settle(done(first, "busy")) == []
    assert book.meet(asked()).reply.plan == "calm"
