"""The routes of misbehaviour: scores, and reports with their evidence."""

from scm.clock import NS_PER_S
from scm.records.misbehaviour import StationScore
from scm.v2x.messages.misbehaviour_report import MisbehaviourReport, Observation
from scm.v2x.messages.misbehaviour_scores import MisbehaviourScores

URL = "/api/v1/misbehaviour"


def scores():
    row = StationScore(station="n2", station_id=7, score=6.5, worst="identity", suspected=True)
    return MisbehaviourScores(t_ns=NS_PER_S, witness=True, stations=(row,))


def report(t_s=1, suspect="n2"):
    seen = Observation(kind="security", check="identity", plausibility=1e-9, claims=2)
    return MisbehaviourReport(
        suspect=suspect,
        suspect_id=7,
        t_ns=t_s * NS_PER_S,
        since_ns=NS_PER_S,
        score=6.5,
        observations=(seen,),
        evidence=(),
    )


def test_before_anything_is_heard_nobody_watches(client):
    told = client("GET", URL).json()
    assert told["watched"] is False
    assert told["stations"] == told["reported"] == []


def test_scores_and_who_is_reported(client, hear):
    hear(1.0, scores(), report())
    told = client("GET", URL).json()
    assert told["watched"] is True
    assert told["witness"] is True
    assert told["stations"][0]["score"] == 6.5
    assert told["reported"] == ["n2"]


def test_scores_of_a_part_that_fell_silent_are_told_no_longer(client, hear):
    hear(1.0, scores(), report())
    hear(7.0)
    told = client("GET", URL).json()
    assert (told["watched"], told["stations"], told["reported"]) == (False, [], ["n2"])


def test_the_newest_report_on_a_station(client, hear):
    hear(1.0, report(1), report(11))
    told = client("GET", f"{URL}/n2").json()
    assert told["t_ns"] == 11 * NS_PER_S
    assert told["observations"][0]["kind"] == "security"


def test_who_is_not_reported_is_not_found(client):
    answer = client("GET", f"{URL}/n5")
    assert answer.status_code == 404
    assert answer.json()["code"] == "not_found"
