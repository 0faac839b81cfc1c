"""Live trials are scored by hand-made labels: what was noticed, whose it was, what was adopted."""

import pytest

from scm.clock import nanoseconds
from scm.records.twins import TwinCause, TwinChange, TwinEffect, TwinVersion
from scm.twin.trial.city import Adopted, CarFound, Chunk, CityFound
from scm.twin.trial.score import Judged, judge_city
from scm.twin.trial.table import each, lines

BEGIN_NS, LASTED_S = nanoseconds(1000.0), 3000.0


def true(whose="car", of="n1", name="steer_trim", begins_s=600.0, ends_s=None, **more):
    spot = {"x_m": 1.0, "y_m": 0.5, "radius_m": 0.3} if whose == "place" else {"offset_rad": 0.03}
    return {
        "whose": whose, "of": of if whose in ("car", "tag", "camera") else "", "names": [name],
        "parameters": [spot], "car": "nigel", "listed": True, "equation": "steering",
        "depends_on": ["constant"], "strength": [2.0], "course": "step", "begins_s": begins_s,
        "complete_s": begins_s, "ends_s": ends_s, **more,
    }  # fmt: skip


def reported(noticed_s=640.0, since_s=601.0, names=(), cause="undecided", at=None, **more):
    effects = tuple(TwinEffect(name=one, probability=0.9, parameters=()) for one in names)
    where = TwinCause(kind="place", probability=0.9, x_m=at, y_m=0.5, radius_m=0.3)
    noticed_ns, since_ns = (BEGIN_NS + nanoseconds(t_s) for t_s in (noticed_s, since_s))
    return TwinChange(
        noticed_ns=noticed_ns, since_ns=since_ns, since_low_ns=since_ns, since_high_ns=since_ns,
        effect="gyro_bias", parameter="", size=0.1, unit="", score=12.0, effects=effects,
        cause=cause, causes=(where,) if cause == "place" else (), **more,
    )  # fmt: skip


def judged_of(truth, changes, adopted=(), versions=(), by_others=()):
    """Return how a car that drives half of the time is judged, and one beside it if it reports."""
    car = CarFound(
        driven=[(0.0, 0.0), (LASTED_S, 0.5 * LASTED_S)],
        changes={one.noticed_ns: one for one in changes},
        versions={one.number: one for one in versions}, adopted=list(adopted),
    )  # fmt: skip
    judged = Judged()
    cars = {"n1": car}
    if by_others:
        cars["n2"] = CarFound(changes={one.noticed_ns: one for one in by_others})
    found = CityFound(begin_ns=BEGIN_NS, lasted_s=LASTED_S, cars=cars)
    judge_city("case_000", {"changes": truth}, found, judged)
    return judged


def version(number=1, report="r"):
    return TwinVersion(
        number=number, car="nigel", file="", made_ns=0, state="adopted", report=report
    )


def adoption(now_m, until_s=900.0):
    chunk = Chunk(begins_s=until_s - 60.0, ends_s=until_s, windows=10, before_m=0.1, now_m=now_m)
    return Adopted(t_s=800.0, number=1, after=0, later=[chunk])


def test_time_until_it_is_noticed_is_that_of_driving():
    (one,) = judged_of([true()], [reported()]).outcomes
    assert one.noticed_s == pytest.approx(20.0)
    assert one.onset_off_s == pytest.approx(1.0)


def test_change_that_nobody_reports_is_missed_and_no_false_alarm():
    judged = judged_of([true()], [])
    assert judged.outcomes[0].noticed_s is None
    assert judged.false_alarms == []


@pytest.mark.parametrize(
    ("names", "between", "named"),
    [
        (("steer_trim",), (), "exact"),
        (("gyro_bias",), (), "wrong"),
        (("steer_trim", "gyro_bias"), (), "among"),
        ((), ("steer_trim", "gyro_bias"), "among"),
        ((), (), "wrong"),
    ],
)
def test_name_is_right_if_it_is_all_that_is_found_or_left_undecided(names, between, named):
    (one,) = judged_of([true()], [reported(names=names, between=between)]).outcomes
    assert one.named == named


@pytest.mark.parametrize(
    ("whose", "cause", "at", "right"),
    [
        ("car", "car", None, "right"),
        ("car", "tag", None, "right"),
        ("car", "undecided", None, "undecided"),
        ("car", "everywhere", None, "wrong"),
        ("camera", "car", None, "wrong"),
        ("place", "place", 1.1, "right"),
        ("place", "place", 2.5, "wrong"),
    ],
)
def test_cause_is_right_if_it_is_the_same_kind_and_place(whose, cause, at, right):
    (one,) = judged_of([true(whose, "n1")], [reported(cause=cause, at=at)]).outcomes
    assert one.cause == right
    assert (one.named is None) == (whose in ("camera", "place"))


def test_alarm_of_nothing_is_false_whenever_it_comes():
    for noticed_s, of in ((500.0, "n1"), (1300.0, "n1"), (640.0, "n2")):
        judged = judged_of([true(of=of)], [reported(noticed_s)])
        assert [alarm.at_s for alarm in judged.false_alarms] == [noticed_s]
    assert any("2.40 an hour" in line for line in lines(judged))


@pytest.mark.parametrize(("at", "noticed"), [(1.1, True), (2.5, False)])
def test_place_is_noticed_for_all_cars_by_the_one_that_reports_it(at, noticed):
    spill = [true("place", name="surface_patch")]
    judged = judged_of(spill, [], by_others=[reported(cause="place", at=at)])
    mine, other = judged.outcomes
    assert (mine.noticed_s is not None, other.cause) == (noticed, "right" if noticed else "wrong")
    undecided = judged_of(spill, [], by_others=[reported()])
    assert undecided.outcomes[0].noticed_s is None


def test_that_something_is_gone_again_is_a_change():
    late = reported(1100.0, 1000.0)
    judged = judged_of([true(ends_s=1000.0)], [reported(), late])
    assert [(one.at_s, one.is_over) for one in judged.outcomes] == [(600.0, False), (1000.0, True)]
    assert judged.outcomes[1].noticed_s == pytest.approx(50.0)
    assert judged.false_alarms == []


def test_two_things_at_once_are_one_change_of_two_causes():
    truth = [true(), true("everywhere", name="grade")]
    (one,) = judged_of(truth, [reported(cause="everywhere")]).outcomes
    assert one.effects == ("steer_trim", "grade")
    assert one.cause == "right"


def test_ramp_is_dated_in_parts_of_it():
    truth = true(course="ramp", complete_s=700.0)
    (one,) = judged_of([truth], [reported(since_s=610.0)]).outcomes
    assert one.onset_off == pytest.approx(0.1)
    assert one.onset_off_s is None


@pytest.mark.parametrize(("now_m", "later"), [(0.05, "better"), (0.2, "worse")])
def test_version_is_judged_on_later_driving(now_m, later):
    changes = [reported(report="r")]
    judged = judged_of([true()], changes, [adoption(now_m)], [version()])
    assert (judged.outcomes[0].version, judged.outcomes[0].later) == ("adopted", later)
    assert judged.wrong_adoptions == (later == "worse")


def test_driving_after_the_next_change_says_nothing_of_a_version():
    truth = [true(ends_s=880.0)]
    changes = [reported(report="r")]
    judged = judged_of(truth, changes, [adoption(0.2)], [version()])
    assert judged.outcomes[0].later == ""


@pytest.mark.parametrize("whose", ["camera", "nothing"])
def test_version_for_what_no_car_file_has_is_wrong(whose):
    truth = [true(whose)] if whose != "nothing" else []
    judged = judged_of(truth, [reported(report="r")], [adoption(0.05)], [version()])
    assert judged.wrong_adoptions == 1
    assert [alarm.is_adopted for alarm in judged.false_alarms] == [True] * (whose == "nothing")


def test_table_has_a_row_for_each_kind_and_a_line_for_each_change():
    judged = judged_of([true()], [reported(names=("steer_trim",), cause="car")])
    (row,) = [line for line in lines(judged) if line.startswith("car ")]
    assert row.split()[:6] == ["car", "1", "1", "20,", "20", "1"]
    assert "1+0 of 1" in row
    assert "1/0/0" in row
    assert "named exact" in each(judged)[0]
