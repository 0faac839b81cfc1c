"""`report.json`: exactly the fixed fields, and numbers that every reader takes."""

import json

import pytest

from scm.mismatch.findings import Dropped, Estimate, Failure
from scm.mismatch.report.record import json_text, on_clock, plain
from tests.unit.mismatch import made_up_findings as made_up
from tests.unit.mismatch.made_up_findings import replace

TOP = {"verdict", "located", "effects", "undecided", "fit", "runtime_s", "data", "unasked",
       "processor_share", "compared_s", "dropped", "failure"}  # fmt: skip
LOCATED = {"equation", "channels", "depends_on", "when_s", "where", "share_of_error"}
EFFECT = {"name", "listed", "equation", "depends_on", "parameters", "probability", "said", "law",
          "rivals", "course", "since_s", "until_s", "before", "stated",
          "recorded_range"}  # fmt: skip


def read(diagnosis):
    def refuse(word):
        raise AssertionError(word)

    return json.loads(json_text(diagnosis), parse_constant=refuse)


@pytest.mark.parametrize("name", made_up.CASES)
def test_the_fields_are_exactly_the_fixed_ones(name):
    assert set(read(made_up.CASES[name]()[0])) == TOP


def test_what_stands_inside_has_exactly_the_fixed_fields():
    report = read(made_up.pair()[0])
    assert all(set(found) == LOCATED for found in report["located"])
    assert set(report["located"][1]["where"]) == {"x_m", "y_m"}
    assert report["located"][1]["when_s"][0] == [7.7, 10.2]
    assert all(set(effect) == EFFECT for effect in report["effects"])
    assert set(report["effects"][0]["rivals"][0]) == {"name", "probability", "ruled_out_by"}
    estimate = report["effects"][0]["parameters"]["time_constant_s"]
    assert set(estimate) == {"value", "low", "high", "unit"}
    (seen,) = read(made_up.CASES["unlisted_law"]()[0])["effects"][0]["recorded_range"].items()
    assert seen == ("heading", {"low": -1.2, "high": 2.4, "unit": "rad"})
    parts = {"fit", "choose", "confirm"}
    assert set(report["fit"]) == {"horizon_s", *parts, "retuned", "witness", "stated"}
    assert report["fit"]["retuned"] is report["fit"]["stated"] is None
    assert set(report["fit"]["witness"]) == {"position_m", "yaw_rad", "numbers"}
    assert set(report["fit"]["confirm"]) == {"windows", "before", "after", "noise_floor"}


def test_an_open_question_has_exactly_the_fixed_fields():
    (question,) = read(made_up.undecided()[0])["undecided"]
    assert set(question) == {"between", "drive_this", "expected_separation"}


def test_a_question_left_has_exactly_its_fields():
    first, second = read(made_up.cut_short()[0])["unasked"]
    assert first.keys() == second.keys() == {"name", "said"}
    assert (first["name"], second["name"]) == ("effects", "laws")


def test_what_was_dropped_and_a_failure_have_exactly_their_fields():
    gone = Dropped(name="stiction", text="It does not hold.")
    failure = Failure(text="The fit failed.", reasons=("A clock is at its bound.",))
    report = read(made_up.diagnosis(dropped=(gone,), failure=failure))
    assert report["dropped"] == [{"name": "stiction", "said": "It does not hold."}]
    assert report["failure"] == {"said": "The fit failed.", "reasons": ["A clock is at its bound."]}
    assert read(made_up.diagnosis())["failure"] is None


def test_words_of_the_verdict_are_text():
    report = plain(made_up.pair()[0])
    assert report["verdict"] == "mismatch"
    assert type(report["verdict"]) is str
    assert report["effects"][1]["equation"] == "surface"


def test_what_is_no_finite_number_is_null():
    endless = Estimate(value=float("nan"), low=float("-inf"), high=float("inf"), unit="s")
    effect = replace(made_up.lag(), parameters={"time_constant_s": endless})
    report = read(made_up.diagnosis(effects=(effect,), runtime_s=float("nan")))
    found = report["effects"][0]["parameters"]["time_constant_s"]
    assert (found["value"], found["low"], found["high"]) == (None, None, None)
    assert report["runtime_s"] is None


def test_places_in_time_are_by_the_clock_of_a_recording_with_pauses():
    diagnosis, evidence, *_ = made_up.pair()
    spans = ((1.0, 2.0), (14.0, 17.0), (18.0, 19.0))
    first = replace(diagnosis.located[0], when_s=spans)
    always = replace(first, when_s=None)
    cut = replace(evidence, pauses=((0.0, 0.0), (16.0, 86_400.0)))
    shown = on_clock(replace(diagnosis, located=(first, always)), cut)
    assert shown.located[0].when_s == (
        (1.0, 2.0), (14.0, 15.0), (86_416.0, 86_417.0), (86_418.0, 86_419.0)
    )  # fmt: skip
    assert shown.located[1].when_s is None
    assert on_clock(diagnosis, evidence) is diagnosis
