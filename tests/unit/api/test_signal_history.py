"""What signals showed is kept for ten minutes, and what was told beforehand is judged once."""

import pytest

from scm.api.signal_history import HISTORY_S, SignalHistory
from scm.clock import NS_PER_S
from scm.records.signals import SignalGroup
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.spat import Spat

NAMES = ("north",)


class ProgressReporter:
    """Tells one group's colour, step by step, with promises given as seconds of its clock."""

    def __init__(self):
        self.history = SignalHistory()
        self.t_s = 0.0
        self._colour, self._since_s = None, 0.0

    def tell(
        self, colour, lasts_s, least_s, most_s=None, likely_s=None, mode="plan", plan="calm", lost=0
    ):
        for step in range(round(10 * lasts_s)):
            if colour != self._colour:
                self._colour, self._since_s = colour, self.t_s
            if step >= lost:
                self.history.receive(self._spat(least_s, most_s, likely_s, mode, plan))
            self.t_s = round(self.t_s + 0.1, 3)

    def _spat(self, least_s, most_s, likely_s, mode, plan):
        def ns(value_s):
            return None if value_s is None else round(value_s * NS_PER_S)

        group = SignalGroup(
            group="north",
            colour=self._colour,
            since_ns=ns(self._since_s),
            min_end_ns=ns(least_s),
            max_end_ns=ns(most_s),
            likely_end_ns=ns(likely_s),
            likely_confidence=0.8,
        )
        return Spat(junction="x", t_ns=ns(self.t_s), seq=1, mode=mode, plan=plan, groups=(group,))

    def bars(self):
        (group,) = self.history.history("x", NAMES).groups
        return [
            (bar.colour, bar.start_ns / 1e9, bar.end_ns and bar.end_ns / 1e9) for bar in group.bars
        ]

    def score(self):
        return self.history.score("x")


@pytest.fixture
def teller():
    return ProgressReporter()


def test_bars_lie_end_to_end_and_the_last_one_is_open(teller):
    teller.tell("red", 3, 3)
    teller.tell("green", 5, 8)
    teller.tell("yellow", 1, 9)
    assert teller.bars() == [("red", 0, 3), ("green", 3, 8), ("yellow", 8, None)]


def test_a_bar_ends_when_the_next_colour_began_though_it_was_heard_later(teller):
    teller.tell("green", 5, 5.0, 5.2)
    teller.tell("yellow", 1, 6, lost=3)
    assert teller.bars() == [("green", 0, 5), ("yellow", 5, None)]
    assert (teller.score().early, teller.score().late) == (0, 0)


def test_nothing_is_kept_for_ever(teller):
    for _ in range(HISTORY_S // 10 + 20):
        teller.tell("green", 5, teller.t_s + 5)
        teller.tell("red", 5, teller.t_s + 5)
    assert teller.bars()[0][2] >= teller.t_s - HISTORY_S - 1
    assert teller.score().judged <= HISTORY_S // 5 + 1


def test_a_kept_promise_is_not_broken(teller):
    teller.tell("red", 3, 3.0, 3.2)
    teller.tell("green", 5, 8.0, 8.2)
    teller.tell("yellow", 1, 9)
    told = teller.score()
    assert (told.judged, told.early, told.late, told.open) == (2, 0, 0, 0)


def test_an_end_before_the_earliest_that_was_ever_told_is_broken(teller):
    teller.tell("green", 2, 9.0, 10.0)
    teller.tell("green", 2, 2.0, 10.0)  # took it back: still told
    teller.tell("yellow", 1, 5)
    assert (teller.score().early, teller.score().late) == (1, 0)


def test_an_end_after_the_latest_that_was_ever_told_is_broken(teller):
    teller.tell("green", 2, 1.0, 3.0)
    teller.tell("green", 4, 1.0, 9.0)
    teller.tell("yellow", 1, 7)
    assert (teller.score().early, teller.score().late) == (0, 1)


def test_what_flash_cuts_is_not_judged(teller):
    teller.tell("green", 2, 9.0, 10.0)
    teller.tell("flashing_red", 2, 2, mode="flash")
    told = teller.score()
    assert (told.judged, told.cut, told.early) == (0, 1, 0)


def test_likely_ends_are_compared_as_they_were_told_before_the_end(teller):
    teller.tell("red", 6, 1.0, likely_s=9.0)  # at 4 s, 6 s before the end: told 9
    teller.tell("red", 4, 1.0, likely_s=11.5)  # from 6 s on: told 11.5
    teller.tell("green", 1, 12)
    leads = {one.lead_s: one for one in teller.score().leads if one.colour == "red"}
    assert leads[5].errors_s == (-1.0,)
    assert leads[2].errors_s == (1.5,)
    assert (leads[2].within, leads[5].within) == (0.0, 1.0)
    assert leads[2].told == pytest.approx(0.8)
    assert leads[20].errors_s == ()
    assert leads[20].unknown == 0  # it was not red for that long


def test_a_forecast_that_was_not_made_is_counted_as_unknown(teller):
    teller.tell("green", 4, 1.0)
    teller.tell("yellow", 1, 5)
    lead = next(one for one in teller.score().leads if (one.colour, one.lead_s) == ("green", 2))
    assert (lead.unknown, lead.mean_s, lead.worst_s) == (1, None, None)


def test_silence_leaves_a_gap_and_judges_nothing(teller):
    teller.tell("green", 2, 9.0, 10.0)
    teller.t_s += 30
    teller.tell("red", 2, 40)
    assert teller.bars() == [("green", 0, 1.9), ("red", 32.0, None)]
    assert teller.score().judged == 0


def test_a_clock_that_goes_back_begins_anew(teller):
    teller.tell("green", 2, 9.0)
    teller.t_s, teller._colour = 0.5, None
    teller.tell("red", 1, 9.0)
    assert teller.bars() == [("red", 0.5, None)]


def test_changes_of_what_runs_are_kept(teller):
    teller.tell("red", 1, 1)
    teller.tell("red", 1, 1, plan="brisk")
    ran = teller.history.history("x", NAMES).ran
    assert [(one.t_ns / 1e9, one.plan) for one in ran] == [(0, "calm"), (1, "brisk")]


def test_the_monitors_words_are_kept_when_they_change():
    history = SignalHistory()
    said = ((None, ""), (None, ""), ("stale", "0.6 s"), ("stale", "0.6 s"), ("stale", "2 s"))
    for t_ns, (fault, detail) in enumerate((*said, (None, ""))):
        status = MonitorStatus(junction="x", t_ns=t_ns, fault=fault, since_ns=0, detail=detail)
        history.receive_monitor(status)
    assert [(one.t_ns, one.fault, one.detail) for one in history.verdicts("x")] == [
        (5, None, ""),
        (4, "stale", "2 s"),
        (2, "stale", "0.6 s"),
        (0, None, ""),
    ]


def test_a_junction_that_was_never_heard_has_an_empty_past():
    history = SignalHistory()
    assert history.history("moon", NAMES).t_ns is None
    assert history.score("moon").judged == 0
    assert history.verdicts("moon") == ()
