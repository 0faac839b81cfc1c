"""On unseen driving no car found is worse than the given one, the re-tuned one, the witness."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from scm.clock import WallClock
from scm.errors import CarError
from scm.mismatch.budget import Budget
from scm.mismatch.findings import Verdict, Witness
from scm.mismatch.fit.data_split import split
from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.pipeline import write
from scm.mismatch.report.wording import quantity
from scm.mismatch.select.begin_again import from_witness
from scm.mismatch.select.round import Context
from scm.mismatch.select.search import Selection
from scm.mismatch.select.selected import Selected
from scm.mismatch.validate import conclude as module
from scm.mismatch.validate.conclude import conclude
from scm.mismatch.validate.free_runs import drives_alike, judge
from scm.mismatch.validate.never_worse import GIVEN, RETUNED, Worse, loses, reasons_of, worse_than
from scm.replay.numbers import POSE_CLOCK
from scm.vehicles.car import load_car
from tests.unit.mismatch import made_fit
from tests.unit.mismatch import made_up_findings as made_up
from tests.unit.mismatch.made_drive import big_nigel, car_with, driven, nigel

TRIM = "steering.trim_rad"


def selected(model, retuned, best):
    """What a search would have ended with."""
    catalogue = tuple(made_fit.candidate(name) for name in ("steer_trim", "drive_gain"))
    context = Context(np.ones(len(model.t)), catalogue)
    recordings = [drive.recording for drive in model.drives]
    return Selected(
        recordings, model.drives, nigel(), context, split(model), Selection(best, retuned), ()
    )


def concluded(model, retuned, best):
    return conclude(selected(model, retuned, best), lambda _: None)


@cache
def trimmed():
    return made_fit.trimmed()


@pytest.fixture
def plain_model(monkeypatch):
    """The witness as somebody says it is."""

    def errs_by(position_m, **numbers):
        numbers = numbers or {"dead_band": 0.1}  # of no effect in the catalogue
        found = Witness(position_m=position_m, yaw_rad=position_m, numbers=numbers)
        monkeypatch.setattr(module, "witness_of", lambda *_: found)

    return errs_by


def test_an_effect_that_holds_stays_beside_the_re_tuned_cars_errors():
    found = concluded(*trimmed()).diagnosis
    assert [effect.name for effect in found.effects] == ["steer_trim"]
    assert (found.dropped, found.failure) == ((), None)
    fit = found.fit
    assert fit.confirm.after["position_m"] < 0.5 * fit.retuned["position_m"]
    assert fit.confirm.after["position_m"] < 0.5 * fit.witness.position_m


def test_an_effect_with_which_unseen_driving_is_worse_is_dropped_and_listed(tmp_path):
    model, retuned, _ = made_fit.healthy()
    wrong = replace(
        retuned, effects=(made_fit.candidate("steer_trim"),), values=np.array([0.05]),
        jacobian=np.zeros((len(retuned.innovations), len(retuned.z) + 1)),
        covariance=np.eye(len(retuned.z) + 1),
    )  # fmt: skip
    result = concluded(model, retuned, wrong)
    found = result.diagnosis
    assert (found.effects, found.verdict, found.failure) == ((), Verdict.NONE, None)
    (gone,) = found.dropped
    assert gone.name == "steer_trim"
    assert "does not hold on parts that no fit has seen" in gone.text
    assert GIVEN in gone.text
    assert found.fit.confirm.after["position_m"] < 1.02 * found.fit.confirm.before["position_m"]
    assert not result.found_car.has(TRIM)
    write(result, tmp_path)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "Not confirmed" in page
    assert "Steering trim explains what was fitted, but does not hold" in page


def test_an_error_of_a_sensor_stays_where_only_the_cars_own_numbers_got_worse():
    model, retuned, best = made_fit.biased()
    astray = best.z.copy()
    astray[[own.key for own in model.nominal].index("drive.no_load_speed_rad_s")] += 8.0
    found = concluded(model, retuned, replace(best, z=astray))
    assert [effect.name for effect in found.diagnosis.effects] == ["gyro_bias"]
    assert found.diagnosis.dropped == ()
    others = (retuned.z, model.simulator.unfitted())
    assert any(np.array_equal(found.best.z, z) for z in others)


def test_an_error_of_a_sensor_stays_where_no_numbers_are_better_in_all(monkeypatch):
    """The given car is nearer in heading, the re-tuned one in position."""
    model, retuned, best = made_fit.biased()

    def worse(fit, beside):
        return worse_is[int(drives_alike(fit))]

    worse_is = Worse("yaw_rad", GIVEN, 0.004, 0.006), Worse("position_m", RETUNED, 0.005, 0.007)
    monkeypatch.setattr(module, "worse_than", worse)
    found = concluded(model, retuned, best)
    assert [effect.name for effect in found.diagnosis.effects] == ["gyro_bias"]
    assert np.array_equal(found.best.z, model.simulator.unfitted())


def _beside(best, name, *values):
    """A hypothesis with an effect more, not refitted."""
    more = len(best.z) + len(best.values) + len(values)
    return replace(
        best, effects=(*best.effects, made_fit.candidate(name)),
        values=np.array([*best.values, *values]),
        jacobian=np.zeros((len(best.innovations), more)), covariance=np.eye(more),
    )  # fmt: skip


def test_what_may_be_another_equation_goes_if_it_brings_the_car_no_nearer():
    model, retuned, best = trimmed()
    found = concluded(model, retuned, _beside(best, "steer_lag", 1e-4)).diagnosis
    assert [effect.name for effect in found.effects] == ["steer_trim"]
    (gone,) = found.dropped
    assert gone.name == "steer_lag"
    assert "brings the car hardly nearer" in gone.text


def test_what_no_equation_of_a_healthy_part_has_stays():
    model, retuned, best = trimmed()
    found = concluded(model, retuned, _beside(best, "drive_deadband", 1e-4)).diagnosis
    assert {effect.name for effect in found.effects} == {"steer_trim", "drive_deadband"}
    assert found.dropped == ()


@pytest.mark.parametrize(
    ("by_windows", "std", "goes"), [(True, 1.0, True), (True, 1e-9, False), (False, 1.0, False)]
)
def test_by_windows_what_may_as_well_be_nothing_goes_if_it_brings_the_car_no_nearer(
    by_windows, std, goes
):
    model, retuned, best = trimmed()
    both = _beside(best, "gyro_bias", 1e-3)
    both = replace(both, covariance=std**2 * both.covariance)
    ended = selected(model, retuned, both)
    ended = replace(ended, context=replace(ended.context, by_windows=by_windows))
    found = conclude(ended, lambda _: None).diagnosis
    assert [effect.name for effect in found.effects] == ["steer_trim", "gyro_bias"][: 2 - goes]
    assert [gone.name for gone in found.dropped] == ["gyro_bias"][: int(goes)]


def test_a_car_that_is_no_nearer_alone_has_no_effect_and_no_mismatch():
    model, retuned, _ = made_fit.healthy()
    found = concluded(model, retuned, _beside(retuned, "steer_lag", 1e-4)).diagnosis
    assert (found.effects, found.verdict) == ((), Verdict.NONE)
    assert [gone.name for gone in found.dropped] == ["steer_lag"]


def test_a_car_that_cannot_be_written_is_not_handed_out():
    model, retuned, best = trimmed()
    below = -1.5 * nigel().value("body.cog_height_m")
    found = concluded(model, retuned, _beside(best, "load_transfer", below))
    assert [effect.name for effect in found.diagnosis.effects] == ["steer_trim"]
    (gone,) = found.diagnosis.dropped
    assert gone.name == "load_transfer"
    assert "could not be written" in gone.text
    assert found.found_car.has(TRIM)


def test_a_car_of_which_a_stage_cannot_be_written_is_not_handed_out(monkeypatch):
    def stages(_files, fitted, *_):
        if fitted.effects:
            raise CarError("drive.gain: out of bounds")
        return really(_files, fitted, *_)

    really = module.CarFiles.stages
    monkeypatch.setattr(module.CarFiles, "stages", stages)
    found = concluded(*trimmed()).diagnosis
    assert found.effects == ()
    (gone,) = found.dropped
    assert "could not be written" in gone.text


def test_of_two_effects_the_one_that_worsens_the_car_goes():
    model, retuned, best = trimmed()
    gain = made_fit.candidate("drive_gain")
    worsened = replace(
        best, effects=(*best.effects, gain), values=np.array([*best.values, 0.7]),
        jacobian=np.zeros((len(best.innovations), len(best.z) + 2)),
        covariance=np.eye(len(best.z) + 2),
    )  # fmt: skip
    found = concluded(model, retuned, worsened).diagnosis
    assert [effect.name for effect in found.effects] == ["steer_trim"]
    assert [gone.name for gone in found.dropped] == ["drive_gain"]


@pytest.mark.parametrize(
    ("tuned", "found", "other"),
    [(0.05, 0.025, RETUNED), (0.025, 0.05, None), (0.0, -0.05, GIVEN)],
)
def test_a_car_is_worse_than_the_one_that_strays_less(tuned, found, other):
    drive = driven(((TRIM, 0.05),))
    parts = split(Likelihood.of([drive], big_nigel()), 5.0)
    given, tuned, found = (car_with({TRIM: trim}) for trim in (0.0, tuned, found))
    fits = [judge([drive], before, found, parts)[0] for before in (given, tuned)]
    worse = worse_than(*fits)
    assert (worse and worse.other) == other
    assert worse is None or worse.now > 1.02 * worse.was


def test_a_heading_that_got_worse_counts_too():
    fit = made_up.fit(before=0.361, after=0.042)
    turned = {**fit.confirm.after, "yaw_rad": 0.25}
    fit = made_up.replace(fit, confirm=made_up.replace(fit.confirm, after=turned))
    assert worse_than(fit, None).name == "yaw_rad"


def with_windows(count, **errors):
    """Errors of so many windows."""
    fit = made_up.fit(**errors)
    return made_up.replace(fit, confirm=made_up.replace(fit.confirm, windows=count))


def test_few_windows_must_show_a_larger_difference():
    errors = {"after": 0.083, "witness": made_up.bicycle(0.07)}
    assert not loses(with_windows(6, **errors))
    assert loses(with_windows(60, **errors))
    assert loses(with_windows(6, **{**errors, "after": 0.11}))


def test_the_witness_speaks_only_beyond_noise_and_five_per_cent():
    assert loses(with_windows(4000, after=0.1, witness=made_up.bicycle(0.094)))
    assert not loses(with_windows(4000, after=0.1, witness=made_up.bicycle(0.096)))
    floor = made_up.fit().confirm.noise_floor["position_m"]
    assert not loses(made_up.fit(after=2.9 * floor, witness=made_up.bicycle(floor)))
    assert not loses(made_up.fit(after=0.1, witness=None))


def test_a_healthy_car_stays_healthy_whatever_the_witness_says(plain_model):
    plain_model(1e-6)
    found = concluded(*made_fit.healthy()).diagnosis
    assert (found.verdict, found.failure, found.dropped) == (Verdict.NONE, None, ())


def missed():
    """A trim that was not found, and a fault of the gyro that is not there."""
    model, retuned, _ = trimmed()
    bias = replace(
        retuned, effects=(made_fit.candidate("gyro_bias"),), values=np.array([0.01]),
        jacobian=np.zeros((len(retuned.innovations), len(retuned.z) + 1)),
        covariance=np.eye(len(retuned.z) + 1),
    )  # fmt: skip
    return model, retuned, bias


def test_a_car_that_loses_to_the_witness_is_not_handed_out(plain_model, tmp_path):
    plain_model(0.005)
    result = concluded(*missed())
    found = result.diagnosis
    assert (found.verdict, found.effects) == (Verdict.MISMATCH, ())
    assert [gone.name for gone in found.dropped] == ["gyro_bias"]
    assert "The fit failed: after" in found.failure.text
    assert "times as far as a kinematic bicycle with 1 numbers (0.50 cm)" in found.failure.text
    assert f"`car.toml` is the car {RETUNED}" in found.failure.text
    assert any("lies across the way driven" in reason for reason in found.failure.reasons)
    assert any(why.startswith("Far beyond measurement noise: ") for why in found.failure.reasons)
    write(result, tmp_path)
    written = (tmp_path / "car.toml").read_text(encoding="utf-8")
    assert written.startswith("# The fit failed: after")
    car, tuned = (load_car(tmp_path / name) for name in ("car.toml", "retuned.toml"))
    stated = set(car.values) - set(tuned.values)
    assert stated == {"accuracy.position_error", "accuracy.yaw_error"}
    assert all(car.values[key] == value for key, value in tuned.values.items())
    assert not car.faults
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "A plain model drives more like the car" in page
    assert "Cause unknown" not in page


def test_a_search_that_lost_begins_again_where_the_witness_points(plain_model, monkeypatch):
    """From a bicycle of steering alone."""
    begun = []

    def again(*lost):
        begun.append(from_witness(*lost))
        return begun[-1]

    monkeypatch.setattr(module, "from_witness", again)
    plain_model(0.005, steering_offset_rad=0.03)
    found = concluded(*missed()).diagnosis
    (searched,) = begun
    assert searched.best.names == ("steer_trim",)
    assert searched.context.by_windows
    assert [effect.name for effect in found.effects] == ["steer_trim"]
    assert found.effects[0].parameters["offset_rad"].value == pytest.approx(0.05, abs=0.01)
    assert (found.failure, found.dropped) == (None, ())


def test_what_began_from_the_witness_counts_only_where_it_is_nearer(plain_model, monkeypatch):
    plain_model(0.005)
    model, retuned, best = trimmed()
    worse = selected(model, retuned, missed()[2])
    monkeypatch.setattr(module, "from_witness", lambda *_: worse)
    monkeypatch.setattr(module, "loses", lambda _: True)
    found = concluded(model, retuned, best).diagnosis
    assert [gone.name for gone in found.dropped] == ["steer_trim"]


def test_nothing_begins_again_where_no_effect_stands_for_the_bicycle_or_time_is_up():
    lost = selected(*missed())
    assert from_witness(lost, {"understeer_s2_per_m2": 0.1}) is None
    over = replace(lost, context=replace(lost.context, budget=Budget(0.0, WallClock())))
    assert from_witness(over, {"steering_offset_rad": 0.05}) is None
    (question,) = over.context.budget.unanswered
    assert question.name == "from_witness"


def test_a_failed_fit_without_effects_says_so_too(plain_model):
    plain_model(0.005)
    model, retuned, _ = trimmed()
    found = concluded(model, retuned, retuned).diagnosis
    assert (found.verdict, found.effects, found.dropped) == (Verdict.MISMATCH, (), ())
    assert f"the car {RETUNED} is" in found.failure.text
    assert "handed out" not in found.failure.text


def test_a_failed_fit_that_gained_nothing_says_how_far_the_given_car_strays(
    plain_model, monkeypatch
):
    plain_model(0.005)
    model, retuned, _ = trimmed()
    monkeypatch.setattr(module, "gained_nothing", lambda _: True)
    found = concluded(model, retuned, retuned).diagnosis
    assert found.fit.confirm.after == found.fit.confirm.before
    far = quantity(found.fit.confirm.before["position_m"], "m")
    assert f"the car {GIVEN} is {far} off" in found.failure.text


def test_a_failed_fit_is_a_mismatch_however_near_the_car_handed_out_is(plain_model, monkeypatch):
    plain_model(1e-3)
    monkeypatch.setattr(module, "loses", lambda _: True)
    assert concluded(*made_fit.healthy()).diagnosis.verdict is Verdict.MISMATCH


def test_numbers_at_an_end_of_what_the_file_allows_and_clocks_at_their_bound_are_named():
    _, retuned, _ = trimmed()
    keys = [own.key for own in retuned.model.nominal]
    z = np.zeros(len(keys))
    z[keys.index("body.mass_kg")], z[keys.index(POSE_CLOCK)] = 2.0, -2.0
    z[keys.index("steering.rate_rad_s")] = 1.5
    fit, runs = made_up.fit(), made_up.free_runs()
    reasons = reasons_of(replace(retuned, z=z), nigel(), fit, runs)
    assert reasons[0].startswith("At an end of what the car file allows: `body.mass_kg` ")
    assert "steering.rate" not in " ".join(reasons)
    assert reasons[1].startswith("At its bound: the clock of poses 6 ms")


@pytest.mark.parametrize(("far_nearer", "names"), [(0.7, ("steer_trim",)), (0.0, ())])
def test_effects_that_innovations_deny_stay_where_the_car_drives_far_nearer(
    monkeypatch, plain_model, far_nearer, names
):
    model, retuned, best = trimmed()
    plain_model(1.0)
    monkeypatch.setattr(module, "FAR_NEARER", far_nearer)
    found = replace(selected(model, retuned, retuned), denied=("steer_trim",), unconfirmed=best)
    diagnosis = conclude(found, lambda _: None).diagnosis
    assert tuple(effect.name for effect in diagnosis.effects) == names
    assert tuple(one.name for one in diagnosis.dropped) == (() if names else ("steer_trim",))
