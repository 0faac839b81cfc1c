"""The misbehaviour part in a city on a stepped clock, with cars that lie and cars that do not."""

import itertools
import logging
import random
from dataclasses import dataclass

import pytest

from scm.clock import NS_PER_S, nanoseconds, seconds
from scm.maps.load import load_map
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.traffic.misbehaviour.attacker import Attacker
from scm.traffic.misbehaviour.part import MisbehaviourPart, limits_by_car
from scm.traffic.signals.part import TrafficPart
from scm.v2x.etsi.convert import read_cam, station_id
from scm.v2x.exchange import Incoming
from scm.v2x.messages.cam import CamRx, CamTx
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.misbehaviour_report import MisbehaviourReport
from scm.v2x.messages.misbehaviour_scores import MisbehaviourScores
from scm.world.part import WorldPart
from tests.unit.traffic.misbehaviour.claims import RSU, body, state, track
from vehicle_agent.agent import AgentPart

MAP = load_map("driving_school")
START_NS = 1_795_000_000_000_000_000
CARS = (("n1", "nigel"), ("n2", "nigel"), ("n3", "nigel"))
KINDS = (MisbehaviourReport, MisbehaviourScores, CityEvent, CamTx)


class Starved:
    """A part whose process now and then sleeps for a while; what it hears meanwhile waits."""

    def __init__(self, part, seed=1):
        self._part, self._rng, self._inbox = part, random.Random(f"{seed} {part.name}"), []
        self._sleeps_ns, self._wakes_ns = START_NS + 4 * NS_PER_S, 0

    def __getattr__(self, name):
        return getattr(self._part, name)

    def step(self, now_ns, inbox):
        self._inbox += inbox
        if now_ns >= self._sleeps_ns:
            self._wakes_ns = now_ns + nanoseconds(self._rng.expovariate(1.0 / 0.4))
            self._sleeps_ns = self._wakes_ns + nanoseconds(self._rng.expovariate(1.0 / 0.6))
        if now_ns < self._wakes_ns:
            return []
        inbox, self._inbox = self._inbox, []
        return self._part.step(now_ns, inbox)


def run(attacks, span_s=25.0, *more, **options):
    """Return reports, the last scores, events and CAMs of a city in which some lie."""
    world = Attacker(WorldPart(MAP, 1, hosted=CARS), attacks, MAP, **options)
    with Lockstep([world, TrafficPart(MAP), MisbehaviourPart(MAP), *more], start_ns=START_NS) as c:
        boxes = [c.subscribe(Subscription(kind)) for kind in KINDS]
        c.run_for(span_s)
        reports, scores, events, cams = (
            [item.message for item in box.drain()] for box in boxes
        )  # fmt: skip
    return reports, scores[-1], [e for e in events if e.name == "misbehaviour"], cams


def run_starved(attacks):
    """Return who is reported in a starved city, how much time it lost, and the last scores."""
    hosted, agent = WorldPart(MAP, 1, hosted=CARS), AgentPart("n4")
    world = Attacker(hosted, attacks, MAP)
    parts = [Starved(one) for one in (world, TrafficPart(MAP), agent, MisbehaviourPart(MAP))]
    with Lockstep(parts, start_ns=START_NS) as city:
        reports = city.subscribe(Subscription(MisbehaviourReport))
        city.run_for(25.0)
        suspects = {item.message.suspect for item in reports.drain()}
    return suspects, seconds(hosted.world.pace.lost_ns), parts[-1].detector.histories.values()


class Log(logging.Handler):
    """Keeps the text of every record."""

    def __init__(self):
        super().__init__()
        self.texts = []

    def emit(self, record):
        self.texts.append(record.getMessage())


@dataclass(frozen=True, slots=True)
class Lying:
    """A city in which n2 says that it stands: what it said of itself, and what was found out."""

    reports: list
    scores: MisbehaviourScores
    events: list
    cams: list
    lines: list
    log: list


@pytest.fixture(scope="module")
def lying():
    log, lines = Log(), []
    logging.getLogger().addHandler(log)
    try:
        found = run({"n2": "zero_speed"}, print_line=lines.append)
    finally:
        logging.getLogger().removeHandler(log)
    return Lying(*found, lines, log.texts)


def test_a_liar_is_reported_and_nobody_else(lying):
    assert {report.suspect for report in lying.reports} == {"n2"}
    rows = {row.station: row for row in lying.scores.stations}
    assert rows["n2"].suspected
    assert not rows["n1"].suspected
    assert rows["n1"].score < 2.0
    assert not lying.scores.witness


def test_a_report_names_class_check_and_plausibility(lying):
    first = lying.reports[0]
    assert first.suspect_id == station_id("n2")
    assert "speed" in {one.kind for one in first.observations}
    assert first.observations[0].plausibility < 0.01
    worst = [one.plausibility for one in first.observations]
    assert worst == sorted(worst)


def test_its_evidence_is_the_cams_that_were_sent(lying):
    sent = {(cam.t_ns, cam.body) for cam in lying.cams if cam.station == "n2"}
    evidence = lying.reports[0].evidence
    assert len(evidence) >= 2
    assert {(one.t_ns, one.body) for one in evidence} <= sent
    assert [one.t_ns for one in evidence] == sorted(one.t_ns for one in evidence)
    assert all(read_cam(one.body).speed_mps == 0.0 for one in evidence)


def test_people_are_told_once_though_reports_go_on(lying):
    assert len(lying.reports) >= 2
    assert [one.vehicle for one in lying.events] == ["n2"]
    gaps = [b.t_ns - a.t_ns for a, b in itertools.pairwise(lying.reports)]
    assert min(gaps) >= 10_000_000_000


def test_whoever_watches_an_attack_is_told_of_the_first_lie_the_report_and_the_end(lying):
    first, found, last = lying.lines
    report = lying.reports[0]
    assert first == "n2 sends its first false CAM: a speed of zero while driving"
    assert f"score {report.score:.1f}: {report.observations[0].check}" in found
    assert 0.0 < float(found.split(" s after")[0].rpartition(" ")[2]) < 20.0
    count = sum(cam.station == "n2" for cam in lying.cams)
    assert last.startswith(f"n2 leaves: {count} CAMs, ")
    assert last.endswith("of them false, reported")


def test_the_log_names_a_suspect_once(lying):
    (line,) = [one for one in lying.log if one.startswith("station_suspected")]
    assert "station=n2" in line


def test_an_honest_city_is_left_in_peace():
    reports, scores, events, _ = run({})
    assert reports == events == []
    assert len(scores.stations) == 3


def test_in_a_city_that_is_too_slow_nobody_honest_is_suspected():
    suspects, lost_s, histories = run_starved({})
    assert lost_s > 5.0
    assert suspects == set()
    assert {history.station for history in histories} == {"n1", "n2", "n3", "n4"}


def test_in_a_city_that_is_too_slow_a_liar_is_still_found():
    suspects, _, histories = run_starved({"n2": "zero_speed"})
    assert suspects == {"n2"}
    assert all(history.newest.lost_ns > 0 for history in histories), "also of who lies"


def test_ghosts_under_the_attackers_key_are_known_by_their_numbers():
    reports, _, _, _ = run({"n2": "congestion_sybil"}, 15.0)
    assert reports
    assert {one.suspect for one in reports} == {"n2"}
    assert station_id("n2") not in {one.suspect_id for one in reports}
    assert all("identity" in {o.check for o in one.observations} for one in reports)


def test_ghosts_with_names_of_their_own_are_found_by_what_they_say():
    reports, _, _, _ = run({"n2": "congestion_sybil"}, 20.0, own_names=True)
    found = {one.suspect for one in reports}
    assert found
    assert all(name.startswith("n2-ghost") for name in found)


def test_late_frames_are_sent_when_they_are_due():
    _, _, _, cams = run({"n2": "time_delay"}, 8.0)
    first = {name: min(c.t_ns for c in cams if c.station == name) for name in ("n1", "n2")}
    assert 1.9e9 < first["n2"] - first["n1"] < 4.5e9


def test_a_car_that_joins_and_lies_is_a_station_of_its_own():
    agent = Attacker(AgentPart("n9"), {"n9": "constant_position_offset"}, MAP)
    reports, scores, _, cams = run({}, 15.0, agent)
    assert "n9" in {row.station for row in scores.stations}
    assert {one.suspect for one in reports} == {"n9"}
    assert {one.station for one in cams} >= {"n1", "n9"}


def test_an_attack_that_nobody_finds_ends_without_a_report():
    lines = []
    attacks = {"n2": "zero_speed"}
    world = Attacker(WorldPart(MAP, 1, hosted=CARS), attacks, MAP, print_line=lines.append)
    with Lockstep([world, TrafficPart(MAP)], start_ns=START_NS) as city:
        city.subscribe(Subscription(CamTx))  # somebody listens, and judges nothing
        city.run_for(10.0)
    assert lines[-1].endswith("never reported")


def test_a_liar_that_was_never_let_in_said_nothing():
    lines = []
    Attacker(AgentPart("n9"), {"n9": "zero_speed"}, MAP, print_line=lines.append).finish(START_NS)
    assert lines == ["n9 leaves: it was never in the city"]


def hear_alone(names, car="nigel", seen=(), seconds_=8, eye_from_s=0):
    """Let a part hear cars that drive while the Eye sees some of them; return all that it says."""
    part, said = MisbehaviourPart(MAP, lambda _x, _y: True), []
    for k in range(seconds_):
        now_ns = START_NS + k * NS_PER_S
        for place, name in enumerate(names):
            told = state(1.0 * k, 0.1 + 0.4 * place + 0.01 * k, v=0.01, name=name)
            cam = CamRx(receiver=RSU, station=name, t_ns=told.t_ns, body=body(told), car=car)
            inbox = [Incoming(message=cam, t_ns=now_ns)]
            if name in seen and k >= eye_from_s:
                inbox.insert(0, Incoming(message=track(told), t_ns=now_ns))
            said += part.step(now_ns, inbox)
    return said


def test_an_eye_that_has_just_begun_may_not_have_seen_every_tag_yet():
    said = hear_alone(("n2", "n1"), seen=("n2",), seconds_=8, eye_from_s=5)
    assert not [one for one in said if isinstance(one, CityEvent)]
    said = hear_alone(("n2", "n1"), seen=("n2",), seconds_=12, eye_from_s=5)
    assert [one.vehicle for one in said if isinstance(one, CityEvent)] == ["n1"]


@pytest.mark.parametrize("car", ["nigel", "dart"])
def test_that_the_eye_cannot_see_a_tag_is_told_once_and_accuses_nobody(car):
    said = hear_alone(("n2", "n1"), car, seen=("n2",))
    news = [one for one in said if isinstance(one, CityEvent)]
    unseen = {"n1"} if car == "nigel" else {"n1", "n2"}  # a bare roof shows no tag of its own
    assert {(one.name, one.severity, one.vehicle) for one in news} == {
        ("tag_unseen", "info", name) for name in unseen
    }
    assert len(news) == len(unseen)
    rows = next(one for one in reversed(said) if isinstance(one, MisbehaviourScores)).stations
    assert {row.station for row in rows if row.tag_unseen} == unseen
    assert max(row.score for row in rows) < 1.0


def test_limits_are_those_of_the_car_and_of_a_nigel_where_its_file_is_not_here():
    assert limits_by_car("f1tenth").speed_mps == 7.0
    assert (limits_by_car("f1tenth").has_tag, limits_by_car("dart").has_tag) == (True, False)
    assert limits_by_car("no such car") == limits_by_car("nigel") == limits_by_car("")
