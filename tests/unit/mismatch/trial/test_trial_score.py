"""A diagnosis is judged by names, laws and parameters, and by nothing kinder."""

import dataclasses
import math

import pytest
from msgspec.structs import replace

from scm.data_quality.quality import DataProblem
from scm.mismatch.findings import Diagnosis, Effect, Equation, Estimate, Undecided, Verdict
from scm.mismatch.trial.again import Ratio
from scm.mismatch.trial.labels import label_of
from scm.mismatch.trial.score import each, failed, lines, score, wilson


def label(*names, parameters=None, listed=True, equation="body", depends_on=("time",), **more):
    said = {
        "names": list(names), "car": "nigel", "equation": equation, "listed": listed,
        "depends_on": list(depends_on), "parameters": parameters or [{} for _ in names], **more,
    }  # fmt: skip
    return label_of("case_000", said)


def effect(name, *, listed=True, equation=Equation.BODY, depends_on=("time",), **values):
    estimates = {
        key: Estimate(value=value, low=low, high=high, unit="1")
        for key, (value, low, high) in values.items()
    }
    return Effect(
        name=name, is_known=listed, equation=equation, depends_on=depends_on, parameters=estimates,
        probability=0.9, text="",
    )  # fmt: skip


def diagnosis(*effects, undecided=()):
    verdict = Verdict.MISMATCH if effects else Verdict.UNDECIDED if undecided else Verdict.NONE
    groups = tuple(
        Undecided(between=tuple(group), drive_this="", expected_separation=0.0)
        for group in undecided
    )
    return Diagnosis(
        verdict=verdict, located=(), effects=effects, undecided=groups, fit=None, runtime_s=1.0
    )


def test_the_right_name_alone_is_exact():
    got = score(label("wind"), diagnosis(effect("wind")))
    assert (got.exact, got.among, got.missed, got.false_names) == (True, True, False, ())


def test_a_second_name_spoils_exactness_but_not_the_first():
    got = score(label("wind"), diagnosis(effect("wind"), effect("steer_trim")))
    assert (got.exact, got.among, got.false_names) == (False, True, ("steer_trim",))


def test_a_wrong_name_is_neither_found_nor_missed():
    got = score(label("steer_gain"), diagnosis(effect("steer_trim")))
    assert (got.exact, got.among, got.missed) == (False, False, False)


def test_silence_about_an_effect_is_a_miss():
    assert score(label("wind"), diagnosis()).missed


def test_silence_about_nothing_is_exact():
    got = score(label(), diagnosis())
    assert got.exact
    assert not got.false_names


@pytest.mark.parametrize(
    "found", [diagnosis(effect("wind")), diagnosis(undecided=[("wind", "grade")])]
)
def test_anything_about_nothing_is_a_false_alarm(found):
    got = score(label(), found)
    assert not got.exact
    assert got.false_names


def test_one_of_two_is_neither_exact_nor_enough():
    got = score(label("wind", "steer_gain"), diagnosis(effect("wind")))
    assert (got.exact, got.among, got.false_names) == (False, False, ())


def test_a_wrong_unit_may_be_reported_as_a_problem_of_the_data():
    problem = DataProblem(channel="imu.gyro_z", name="unit", text="")
    got = score(label("unit_error"), replace(diagnosis(), data=(problem,)))
    assert (got.exact, got.missed) == (True, False)


def test_twins_that_no_drive_tells_apart_are_right_when_left_undecided():
    assert score(label("payload"), diagnosis(undecided=[("payload", "motor_gain")])).exact
    assert not score(label("payload"), diagnosis(undecided=[("payload", "steer_gain")])).exact
    assert not score(label("steer_lag"), diagnosis(undecided=[("steer_lag", "steer_delay")])).exact


def test_the_twin_that_gives_an_undecided_effect_its_name_is_no_false_name():
    either = diagnosis(effect("grade"), undecided=[("grade", "wind")])
    assert score(label("wind"), either).exact
    assert not score(label("wind"), diagnosis(effect("grade"))).exact
    more = diagnosis(effect("grade"), effect("steer_trim"), undecided=[("grade", "wind")])
    assert score(label("wind"), more).false_names == ("steer_trim",)


def test_an_undecided_name_is_among_those_reported():
    got = score(label("steer_lag"), diagnosis(undecided=[("steer_lag", "steer_delay")]))
    assert got.among


LAW = {"listed": False, "equation": "surface", "depends_on": ("heading",)}


@pytest.mark.parametrize(
    ("said", "right"),
    [
        (effect("drag", listed=False, equation=Equation.SURFACE, depends_on=("yaw",)), True),
        (effect("drag", listed=False, equation=Equation.BODY, depends_on=("heading",)), True),
        (effect("drag", listed=False, equation=Equation.STEERING, depends_on=("heading",)), False),
        (effect("drag", listed=False, equation=Equation.BODY, depends_on=("time",)), False),
        (effect("d", listed=False, equation=Equation.BODY, depends_on=("yaw", "time")), False),
        (effect("grade", equation=Equation.SURFACE, depends_on=("heading",)), False),
    ],
)
def test_a_law_outside_the_library_needs_its_equation_and_variables(said, right):
    truth = label("nap", or_equation=["body", "drive"], **LAW)
    assert score(truth, diagnosis(said)).exact is right


def test_a_parameters_error_is_relative_to_what_it_does():
    truth = label("steer_gain", parameters=[{"gain": 1.2}])
    got = score(truth, diagnosis(effect("steer_gain", gain=(1.25, 1.21, 1.3))))
    assert got.errors == (pytest.approx(0.25),)
    assert got.covered == (False,)


def test_an_angle_is_compared_the_short_way_round():
    truth = label("grade", parameters=[{"slope": 0.02, "uphill_rad": math.pi - 0.05}])
    found = effect(
        "grade", slope=(0.02, 0.01, 0.03), uphill_rad=(-math.pi + 0.05, -3.15, -math.pi + 0.15)
    )
    got = score(truth, diagnosis(found))
    assert got.errors == (pytest.approx(0.0), pytest.approx(0.1))
    assert got.covered == (True, False)


def test_parts_of_a_vector_are_measured_by_its_length():
    truth = label("wind", parameters=[{"force_x_n": 0.0, "force_y_n": 0.5}])
    found = effect("wind", force_x_n=(0.05, -0.1, 0.1), force_y_n=(0.5, 0.4, 0.6))
    assert score(truth, diagnosis(found)).errors == (pytest.approx(0.1), pytest.approx(0.0))


def test_shared_parameters_of_a_shipped_pair_go_where_the_library_says():
    truth = label(
        "battery_sag", "wheel_radius", parameters={"fraction_per_min": 0.1, "scale": 1.03}
    )
    assert truth.parameters == ({"fraction_per_min": 0.1}, {"scale": 1.03})
    assert truth.kind == "pair"


@pytest.mark.parametrize("kind", ["shuffled", "other_car"])
def test_data_that_fits_no_car_must_be_called_that_and_no_effects_invented(kind):
    problem = DataProblem(channel="command.throttle", name="other_car", text="")
    truth = label(kind=kind, listed=False)
    assert score(truth, replace(diagnosis(), data=(problem,))).exact
    assert score(truth, diagnosis()).missed
    assert not score(truth, replace(diagnosis(effect("wind")), data=(problem,))).exact


def test_wilsons_interval_is_that_of_the_textbook():
    low, high = wilson(9, 10)
    assert (low, high) == (pytest.approx(0.5958, abs=1e-3), pytest.approx(0.9821, abs=1e-3))
    assert wilson(0, 0) == (0.0, 1.0)


def test_the_table_compares_patched_cars_with_nominal_tuned_and_true_ones():
    ratios = [Ratio("case_000", 0.1, 0.02, 0.019, 0.08), Ratio("case_001", 0.1, 0.04, None)]
    text = "\n".join(lines([score(label(), diagnosis())], ratios))
    assert "the nominal car's: median 0.30 (bar 0.25); the true car itself" in text
    assert "noise of poses: 0.19" in text
    assert "the re-tuned car's: median 0.25; above 1.02: none" in text
    assert "the true car's: median 1.05, within 1.15 in 100 %" in text
    assert "the nominal car's, both beyond the true car's: median 0.06" in text
    assert "at most half in 100 %" in text
    worse = [Ratio("case_000", 0.1, 0.02, 0.019, 0.0195), Ratio("case_001", 0.1, 0.04, None, 0.038)]
    text = "\n".join(lines([score(label(), diagnosis())], worse))
    assert "above 1.02: case_001 1.05, case_000 1.03" in text


def test_the_table_has_a_line_for_each_value_of_each_aspect_of_families():
    brush = {"family": {"tyre": "brush", "step_hz": 2000}}
    cubics = {"family": {"tyre": "two_cubics", "step_hz": 8000}}
    outcomes = [
        score(label("wind", **brush), diagnosis(effect("wind"))),
        score(label("steer_gain", **cubics), diagnosis(effect("steer_trim"))),
        score(label("wind", **(cubics | {"family": cubics["family"] | {"step_hz": 2000}})),
              diagnosis(effect("wind"))),
    ]  # fmt: skip
    outcomes[1] = dataclasses.replace(
        outcomes[1], label=dataclasses.replace(outcomes[1].label, case="case_001")
    )
    table = lines(outcomes, [Ratio("case_001", 0.1, 0.04, 0.02)])
    rows = table[next(k for k, row in enumerate(table) if row.startswith("family ")) + 1 :]
    assert [" ".join(row[:32].split()) for row in rows] == [
        "tyre brush", "tyre two_cubics", "step_hz 2000", "step_hz 8000"
    ]  # fmt: skip
    half = ["50", "%", *"({:.0f} to {:.0f})".format(*(100 * v for v in wilson(1, 2))).split()]
    assert rows[1].split()[2:-1] == ["2", *half, *half]
    assert [row.endswith("   0.40") for row in rows] == [False, True, False, True]


def test_cases_without_families_have_no_lines_of_them():
    assert not any(row.startswith("family") for row in lines([score(label(), diagnosis())], []))


def test_the_table_counts_each_kind_and_names_what_went_wrong():
    outcomes = [
        score(label("wind", strength=[1.5]), diagnosis(effect("wind"))),
        score(label("steer_gain", strength=[3.0]), diagnosis(effect("steer_trim"))),
        score(label(), diagnosis()),
        failed(label("steer_lag", strength=[2.5]), "ValueError: no"),
        score(label(kind="other_car", listed=False), diagnosis()),
    ]
    table = lines(outcomes, [])
    text = "\n".join(table)
    shares = {line[:26].strip(): line[26:].split()[:2] for line in table[:4]}
    assert shares["single"] == ["3", "33"]
    assert shares["of these, 2 x floor up"] == ["2", "0"]
    assert "1 x  steer_gain  ->  steer_trim" in text
    assert "1 x  steer_lag  ->  ValueError: no" in text
    assert "1 x  other car  ->  nothing" in text
    assert [line.split()[2] for line in each(outcomes)] == [
        "exact", "wrong", "exact", "wrong", "wrong"
    ]  # fmt: skip


def moment(value):
    return Estimate(value=value, low=value - 1.0, high=value + 1.0, unit="s")


@pytest.mark.parametrize(
    ("course", "since_s", "until_s", "exact", "covered"),
    [
        ("intermittent", 29.5, 52.4, True, (True, True)),
        ("intermittent", 29.5, 54.0, True, (True, False)),
        ("intermittent", 29.5, 55.1, False, (True, False)),
        ("intermittent", 26.9, 52.0, False, (False, True)),
        ("intermittent", 29.5, None, False, (True,)),
        ("step", 29.5, 52.0, False, (True, True)),
    ],
)
def test_an_effect_that_came_and_went_is_exact_by_course_and_both_moments(
    course, since_s, until_s, exact, covered
):
    truth = label("wind", kind="intermittent", since_s=30.0, until_s=52.0)
    found = replace(
        effect("wind"), course=course, since_s=moment(since_s),
        until_s=None if until_s is None else moment(until_s),
    )  # fmt: skip
    got = score(truth, diagnosis(found))
    assert (truth.kind, got.exact, got.moments_covered) == ("intermittent", exact, covered)
    assert got.late_s[0] == pytest.approx(since_s - 30.0)


def test_the_table_counts_each_moment_of_a_change():
    pair = label("wind", kind="intermittent", since_s=30.0, until_s=52.0)
    one = label("wind", kind="step", since_s=30.0)
    found = replace(effect("wind"), course="intermittent", since_s=moment(31.5),
                    until_s=moment(52.0))  # fmt: skip
    late = replace(effect("wind"), course="step", since_s=moment(40.0))
    table = lines([score(pair, diagnosis(found)), score(one, diagnosis(late))], [])
    (row,) = [line for line in table if line.startswith("moments")]
    assert "3 found, off by 1.5 s" in row
    assert "within 3 s in 67 %" in row
