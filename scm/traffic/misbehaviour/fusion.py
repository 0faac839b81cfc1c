"""Fusion of many plausibilities into one score a station, with memory and hysteresis.

    points = min(MAX_POINTS, -log10(least plausibility of all checks)) - FREE_POINTS, at least 0
    score <- score exp(-dt / MEMORY_S) + points
    suspected from SUSPECTED_FROM up, until it has fallen below CLEARED_BELOW

The least counts and not the sum: checks use the same numbers, so they are wrong together.
FREE_POINTS is what the worst of twenty checks gives an honest car. SUSPECTED_FROM takes two blatant
claims, or many doubtful ones within the memory. Where the Eye cannot see a car's tag, it cannot
confirm its position: checks that it could overrule raise the score to MAX_UNSEEN_SCORE at most.
"""

import math
from collections import deque

from scm.traffic.misbehaviour.check import Check, Strayed
from scm.traffic.misbehaviour.claim import Claim
from scm.traffic.misbehaviour.kalman import Kalman

MEMORY_S = 10.0  # in which a score falls to 37 %
FREE_POINTS, MAX_POINTS = 0.8, 4.0
SUSPECTED_FROM, CLEARED_BELOW = 5.0, 2.0
MAX_UNSEEN_SCORE = 3.0
MAX_EVIDENCE = 6  # claims in a report
REPEAT_REPORT_NS = 10_000_000_000  # of a suspicion that lasts


class Noted:
    """The findings of one check on a station since it was last clear.

    Attributes:
        least: The worst plausibility.
        claims: How many claims were at least doubtful.
    """

    __slots__ = ("check", "claims", "least")

    def __init__(self, check: Check) -> None:
        self.check, self.least, self.claims = check, 1.0, 0


class StationHistory:
    """What is known of one station.

    Attributes:
        station: Its name on the bus.
        newest: Its last claim.
        first_ns: Since when it is known.
        late_ns: When time last passed without it being moved; None: never.
        hard_ns: When it was last driven by hand, or the city stopped; None: never.
        is_tag_unseen: Whether it is a car whose tag the Eye should see and never saw.
        idle: Its fast claims in a row without any change.
        score: See the module.
        since_ns: Since when it is suspected; None: it is not.
        reported_ns: When that was last reported.
        is_news: Whether that report was the first of this suspicion.
        noted: By check, the findings that led to it.
        evidence: The last claims that gave points, each with the one before it.
    """

    __slots__ = (
        "evidence",
        "first_ns",
        "hard_ns",
        "idle",
        "is_news",
        "is_tag_unseen",
        "kalman",
        "late_ns",
        "newest",
        "noted",
        "reported_ns",
        "score",
        "since_ns",
        "station",
        "strayed",
        "worst",
    )  # fmt: skip

    def __init__(self, station: str, first_ns: int) -> None:
        self.station = station
        self.first_ns = first_ns
        self.strayed = Strayed()
        self.newest: Claim | None = None
        self.kalman = Kalman()
        self.late_ns: int | None = None
        self.hard_ns: int | None = None
        self.is_tag_unseen = False
        self.idle = 0
        self.score = 0.0
        self.worst = ""
        self.since_ns: int | None = None
        self.reported_ns: int | None = None
        self.is_news = False
        self.noted: dict[str, Noted] = {}
        self.evidence: deque[Claim] = deque(maxlen=MAX_EVIDENCE)

    def add(self, claim: Claim, gap_s: float, findings: list[tuple[Check, float]]) -> bool:
        """Add the findings of the checks on a claim; return whether a report is due.

        Args:
            claim: The claim.
            gap_s: Since the station's last one.
            findings: Checks that found it suspicious, and its plausibility.
        """
        points = soft = 0.0
        for check, plausibility in findings:
            found = min(MAX_POINTS, -math.log10(plausibility)) - FREE_POINTS
            if found <= 0.0:
                continue
            noted = self.noted.get(check.name)
            if noted is None:
                noted = self.noted[check.name] = Noted(check)
            noted.claims += 1
            noted.least = min(noted.least, plausibility)
            if found > max(points, soft):
                self.worst = check.name
            if check.witnessed and self.is_tag_unseen:
                soft = max(soft, found)
            else:
                points = max(points, found)
        self.score = self.score * math.exp(-max(0.0, gap_s) / MEMORY_S) + points
        if soft > points:
            self.score = max(self.score, min(self.score + soft - points, MAX_UNSEEN_SCORE))
        if points or soft:
            self._keep(claim)
        return self._judge(claim.sent_ns)

    def _keep(self, claim: Claim) -> None:
        before = self.newest
        if before is not None and (not self.evidence or self.evidence[-1] is not before):
            self.evidence.append(before)
        self.evidence.append(claim)

    def _judge(self, now_ns: int) -> bool:
        if self.since_ns is None:
            if self.score < SUSPECTED_FROM:
                if self.score < CLEARED_BELOW / 10.0:
                    self.noted.clear()
                return False
            self.since_ns = now_ns
        elif self.score < CLEARED_BELOW:
            self.since_ns = self.reported_ns = None
            self.noted.clear()
            return False
        if self.reported_ns is not None and now_ns - self.reported_ns < REPEAT_REPORT_NS:
            return False
        self.is_news, self.reported_ns = self.reported_ns is None, now_ns
        return True
