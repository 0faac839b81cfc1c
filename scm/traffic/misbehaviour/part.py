"""The misbehaviour part: checks all CAMs received at roadside units, and reports suspects.

It compares them with each other and with the Eye, knows no world truth, and changes nothing: a
report is for people, and for receivers that choose to ignore a station.
"""

import logging
from collections.abc import Sequence

from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import CarError
from scm.log import event
from scm.records.city_map import CityMap
from scm.records.misbehaviour import StationScore
from scm.records.traffic import EvidencePose
from scm.runtime.part import BasePart, Subscription
from scm.traffic.car_facts import facts_of, outline_of
from scm.traffic.misbehaviour.check import Sender
from scm.traffic.misbehaviour.detector import MAX_EYE_SILENCE_NS, CheckedClaim, Detector
from scm.traffic.misbehaviour.ground import Ground, Sees
from scm.traffic.misbehaviour.limits import Limits, limits_of
from scm.v2x.etsi.convert import roadside_station
from scm.v2x.exchange import Incoming, Outgoing
from scm.v2x.message import Message
from scm.v2x.messages.cam import CamRx
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.eye_track import EyeTrack
from scm.v2x.messages.misbehaviour_report import (
    EvidenceCam,
    MisbehaviourReport,
    Observation,
)
from scm.v2x.messages.misbehaviour_scores import MisbehaviourScores
from scm.v2x.messages.part_status import PartStatus

_log = logging.getLogger(__name__)

NAME = "misbehaviour"
PERIOD_NS = 50 * NS_PER_MS
CAR = "nigel"
FASTEST_CAR_MPS = 7.0  # of a car file without top speed: a 1:10 racing car's
MAX_SCORES = 200  # stations in a list of scores, the highest first


class MisbehaviourPart(BasePart):
    """Checks the CAMs of one city; see `scm.runtime.part.Part`."""

    role = "part"
    period_ns = PERIOD_NS

    def __init__(self, city_map: CityMap, sees: Sees | None = None) -> None:
        """Use a map; `sees` is what the Eye overlooks, the map's cameras if it is None."""
        self.name = NAME
        units = [roadside_station(junction.name) for junction in city_map.junctions]
        at_units = (Subscription(CamRx, {"receiver": unit}, once=True) for unit in units)
        self.subscriptions: Sequence[Subscription] = (*at_units, Subscription(EyeTrack))
        self.detector = Detector(Ground(city_map, sees), limits_by_car)
        self._unseen: set[str] = set()
        self._due_ns = 0

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Check what arrived; report at once, publish scores once a second."""
        outbox: list[Outgoing] = []
        detector = self.detector
        for item in inbox:
            message = item.message
            if isinstance(message, EyeTrack):
                detector.see(message)
            elif isinstance(message, CamRx):
                found = detector.receive(
                    message.station,
                    message.receiver,
                    message.t_ns,
                    message.body,
                    message.lost_ns,
                    Sender(message.car, message.by_hand, message.stopped, message.touches),
                )
                if found is not None and found.is_reported:
                    outbox += self._reports(found, now_ns)
        if now_ns >= self._due_ns:
            self._due_ns = now_ns + NS_PER_S
            detector.forget(now_ns)
            outbox += self._each_second(now_ns)
        return outbox

    def _reports(self, found: CheckedClaim, now_ns: int) -> list[Message]:
        report = report_of(found, self.detector, now_ns)
        if not found.history.is_news:
            return [report]
        checks = [one.check for one in report.observations[:3]]
        described = ", ".join(check.replace("_", " ") for check in checks)
        facts = {"station": report.suspect, "score": report.score, "checks": ",".join(checks)}
        event(_log, "station_suspected", level=logging.WARNING, **facts)
        news = CityEvent(
            severity="warning",
            source=NAME,
            t_ns=now_ns,
            name="misbehaviour",
            text=f"{report.suspect} is suspected of lying on the air: {described}",
            vehicle=report.suspect,
        )
        return [report, news]

    def _each_second(self, now_ns: int) -> list[Message]:
        histories = sorted(self.detector.histories.items(), key=lambda one: -one[1].score)
        suspected = sum(history.since_ns is not None for _, history in histories)
        rows = tuple(
            StationScore(
                station=history.station,
                station_id=who,
                score=round(history.score, 3),
                worst=history.worst,
                suspected=history.since_ns is not None,
                tag_unseen=history.is_tag_unseen,
            )
            for who, history in histories[:MAX_SCORES]
        )
        eye_ns = self.detector.eye_ns
        witness = eye_ns is not None and now_ns - eye_ns <= MAX_EYE_SILENCE_NS
        detail = f"{len(histories)} stations, {suspected} suspected"
        return [
            *self._report_unseen(now_ns),
            MisbehaviourScores(t_ns=now_ns, witness=witness, stations=rows),
            PartStatus(station=NAME, t_ns=now_ns, detail=detail),
        ]

    def _report_unseen(self, now_ns: int) -> list[Message]:
        """Report once each car whose tag the Eye cannot see; that is no suspicion."""
        unseen = {one.station for one in self.detector.histories.values() if one.is_tag_unseen}
        news = [
            CityEvent(
                severity="info",
                source=NAME,
                t_ns=now_ns,
                name="tag_unseen",
                text=f"the Eye cannot see the tag of {station}: no camera confirms its place",
                vehicle=station,
            )
            for station in sorted(unseen - self._unseen)
        ]
        self._unseen = unseen
        return list(news)


def limits_by_car(car: str) -> Limits:
    """Return the limits of a car file by its name; of one that is not here, a Nigel's.

    A file without a top speed gets `FASTEST_CAR_MPS`.
    """
    try:
        facts, (front_share, has_tag) = facts_of(car), outline_of(car)
    except CarError:
        facts, (front_share, has_tag) = facts_of(CAR), outline_of(CAR)
    return limits_of(min(facts.speed_mps, FASTEST_CAR_MPS), front_share, has_tag=has_tag)


def report_of(found: CheckedClaim, detector: Detector, now_ns: int) -> MisbehaviourReport:
    """Return the report on a station that has just been judged."""
    history, claim = found.history, found.claim
    worst_first = sorted(history.noted.values(), key=lambda noted: noted.least)
    track = detector.track_of(claim.who)
    return MisbehaviourReport(
        suspect=history.station,
        suspect_id=claim.who,
        t_ns=now_ns,
        since_ns=history.since_ns or now_ns,
        score=round(history.score, 3),
        observations=tuple(
            Observation(
                kind=noted.check.kind,
                check=noted.check.name,
                plausibility=noted.least,
                claims=noted.claims,
            )
            for noted in worst_first
        ),
        evidence=tuple(EvidenceCam(t_ns=one.sent_ns, body=one.body) for one in history.evidence),
        seen=None
        if track is None or track.stale
        else EvidencePose(
            t_ns=track.t_ns,
            x_m=track.x_m,
            y_m=track.y_m,
            yaw_rad=track.yaw_rad,
            speed_mps=track.speed_mps,
        ),
    )
