"""Scripts of all tempers at the other end, in virtual time."""

import heapq

import pytest

from scm.clock import NS_PER_MS, NS_PER_S
from vehicle_agent.devkit.pingpong import PingPong


class TimedScript:
    """Answers packets one after the other; `takes_ns(number)` may be None: that one is lost."""

    def __init__(self, takes_ns, gap_ns=0):
        self.pace, self.takes_ns = PingPong(gap_ns), takes_ns
        self.now_ns = self.free_ns = 0
        self.sent, self.ages, self.waiting = [], [], []

    def run(self, span_s):
        end_ns = self.now_ns + round(span_s * NS_PER_S)
        while True:
            due_ns = max(self.now_ns, self.pace.due_ns(self.now_ns))
            if self.waiting and self.waiting[0][0] <= due_ns:
                self.now_ns, sent_ns = heapq.heappop(self.waiting)
                self.pace.replied(self.now_ns)
                self.ages.append(self.now_ns - sent_ns)
            elif due_ns > end_ns:
                self.now_ns = end_ns
                return self
            else:
                self.now_ns = due_ns
                self.pace.sent(due_ns)
                self._eat(due_ns)

    def _eat(self, t_ns):
        takes_ns = self.takes_ns(len(self.sent))
        self.sent.append(t_ns)
        if takes_ns is not None:
            self.free_ns = max(self.free_ns, t_ns) + takes_ns
            heapq.heappush(self.waiting, (self.free_ns, t_ns))


def test_a_quick_script_gets_one_packet_for_each_reply():
    script = TimedScript(lambda _: 5 * NS_PER_MS).run(1.0)
    assert len(script.sent) == pytest.approx(200, abs=1)
    assert script.pace.again == 0


def test_packets_keep_their_gap_on_a_grid():
    script = TimedScript(lambda n: (1 + n % 3) * NS_PER_MS, gap_ns=4 * NS_PER_MS).run(1.0)
    gaps = {b - a for a, b in zip(script.sent, script.sent[1:], strict=False)}
    assert gaps == {4 * NS_PER_MS}


def test_after_a_pause_the_gap_is_kept_and_not_made_up_for():
    takes = {10: 300 * NS_PER_MS}
    script = TimedScript(lambda n: takes.get(n, NS_PER_MS), gap_ns=10 * NS_PER_MS).run(1.0)
    gaps = [b - a for a, b in zip(script.sent, script.sent[1:], strict=False)]
    assert min(gaps) == 10 * NS_PER_MS


@pytest.mark.parametrize("lost", [0, 7])
def test_a_lost_packet_is_sent_again_after_a_second_and_costs_less_than_three(lost):
    script = TimedScript(lambda n: None if n == lost else 10 * NS_PER_MS).run(lost * 0.01 + 5.0)
    assert script.sent[lost + 1] - script.sent[lost] == NS_PER_S
    assert len(script.sent) > 200
    assert max(script.ages) <= 10 * NS_PER_MS


@pytest.mark.parametrize("takes_s", [1.1, 1.5, 2.9, 6.0])
def test_a_slow_script_is_not_given_more_than_it_can_eat(takes_s):
    takes_ns = round(takes_s * NS_PER_S)
    script = TimedScript(lambda _: takes_ns).run(60 * takes_s)
    assert script.pace.again <= 6
    assert len(script.ages) >= 59
    assert max(script.ages[12:]) == takes_ns  # nothing waits behind anything


def test_a_script_that_sleeps_for_a_minute_finds_few_packets_and_answers_fresh_ones_soon():
    takes = {5: 60 * NS_PER_S}
    script = TimedScript(lambda n: takes.get(n, 10 * NS_PER_MS)).run(80.0)
    asleep = [t for t in script.sent if t < 60 * NS_PER_S]
    assert len(asleep) < 6 + 12
    assert max(script.ages[-200:]) == 10 * NS_PER_MS


def test_a_script_that_never_answers_is_asked_ever_more_seldom():
    script = TimedScript(lambda _: None).run(100.0)
    assert len(script.sent) < 20
    assert script.sent[-1] - script.sent[-2] == 8 * NS_PER_S


def test_a_script_that_answers_twice_changes_nothing():
    pace = PingPong()
    pace.sent(0)
    pace.replied(NS_PER_MS)
    pace.replied(2 * NS_PER_MS)
    pace.sent(3 * NS_PER_MS)
    assert pace.due_ns(3 * NS_PER_MS) == 3 * NS_PER_MS + NS_PER_S


def test_a_script_that_answers_twice_is_given_no_more_than_it_eats():
    pace, now_ns, free_ns, sent, events = PingPong(), 0, 0, 0, []
    takes_ns, lags = 20 * NS_PER_MS, []
    while now_ns < 10 * NS_PER_S:
        if pace.due_ns(now_ns) <= now_ns:
            pace.sent(now_ns)
            sent += 1
            begins_ns, free_ns = max(now_ns, free_ns), max(now_ns, free_ns) + 2 * takes_ns
            heapq.heappush(events, (begins_ns + takes_ns, 0, sent))
            heapq.heappush(events, (free_ns, 0, sent))
            heapq.heappush(events, (free_ns, 1, sent))
            lags.append(free_ns - now_ns)
        now_ns, is_end, number = heapq.heappop(events)
        if is_end:
            pace.handled(number)
        else:
            pace.replied(now_ns)
    assert set(lags[12:]) == {2 * takes_ns}
    assert sent == pytest.approx(250, abs=3)


def test_a_handler_that_is_not_told_of_any_more_is_waited_for_once():
    pace = PingPong()
    pace.sent(0)
    for _ in range(4):
        pace.replied(1)
    pace.handled(1)
    pace.sent(2)
    pace.replied(3)
    assert pace.due_ns(3) == 3 + NS_PER_S
    pace.sent(3 + NS_PER_S)
    pace.replied(4 + NS_PER_S)
    assert pace.due_ns(4 + NS_PER_S) <= 4 + NS_PER_S
