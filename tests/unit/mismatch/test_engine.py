"""Rollouts, prediction, whitening and fits, on drives that the simulator itself made."""

from dataclasses import replace

import numpy as np
import pytest

from scm.mismatch.effect_catalogue import candidates
from scm.mismatch.fit.fitter import Fitter, bounded_step
from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.fit.noise import fit_noise, usual_noise
from scm.mismatch.fit.rollouts import Rollouts, shares_of
from scm.mismatch.fit.whitening import Events, Whitener
from scm.mismatch.select.round import Context, extend
from scm.mismatch.select.search import retune
from scm.replay.drive import Drive
from scm.replay.numbers import COMMAND_CLOCK, THROTTLE_CLOCK
from tests.unit.mismatch.made_drive import big_nigel, made_drive
from tests.unit.mismatch.made_fit import by_name


@pytest.fixture(scope="module")
def healthy():
    return Drive(made_drive(seconds=9.0), big_nigel())


@pytest.fixture(scope="module")
def model(healthy):
    return Likelihood.of([healthy], big_nigel())


def test_rows_do_not_feel_each_other(healthy):
    rollouts = Rollouts(healthy, big_nigel())
    sets = [{"steering.trim_rad": 0.002 * i} for i in range(40)]
    together, alone = rollouts.run(sets), rollouts.run([sets[37]])
    np.testing.assert_array_equal(together["speed"][:, 37], alone["speed"][:, 0])


@pytest.mark.parametrize(
    ("sets", "longest"), [(5, [5]), (16, [8]), (17, [16]), (40, [16, 8]), (48, [16, 8]), (64, [32])]
)
def test_both_threads_drive_about_as_much(sets, longest):
    every = shares_of(sets)
    driven = [k for share in every for tile in share for k in tile]
    assert sorted(driven) == list(range(sets))
    assert max(sum(map(len, share)) for share in every) == sum(longest)


def test_samples_of_one_moment_are_weighed_as_if_one_followed_at_once(healthy):
    noise, apart = usual_noise([healthy]), Events(healthy)
    same = np.diff(apart.t, prepend=-1.0) == 0.0
    assert same.any()
    apart.t = apart.t + 1e-9 * np.where(same, np.arange(len(same)) % 3, 0)
    together = Whitener(healthy, noise)
    np.testing.assert_allclose(
        together.log_size, Whitener(healthy, noise, apart).log_size, rtol=0.0, atol=1e-4
    )


def test_a_delay_is_the_command_later(healthy):
    motions = Rollouts(healthy, big_nigel()).run([{}, {"steering.delay_s": 0.1}])
    now, late = motions["steer_angle"].T
    np.testing.assert_allclose(late[300:], now[290:-10], atol=2e-3)


@pytest.mark.parametrize("late_s", [0.002, 0.005])
def test_a_servo_at_its_rate_is_not_hurried_by_a_command_within_a_step(healthy, late_s):
    motions = Rollouts(healthy, big_nigel()).run([{}, {"steering.delay_s": late_s}])
    now, late = motions["steer_angle"].T
    rate = np.diff(now) / 0.01
    slewing = np.flatnonzero(
        (rate[:-2] == rate[1:-1]) & (rate[1:-1] == rate[2:]) & (rate[1:-1] > 0.2)
    )
    assert len(slewing) > 50
    behind = (now - late)[slewing + 2] / rate[slewing + 1]
    assert np.median(behind) == pytest.approx(late_s, abs=1e-4)


def test_a_clock_of_commands_that_is_late_delays_both_commands(model):
    both = {"drive.delay_s": 0.02, "steering.delay_s": 0.02}
    residuals, _ = model.residuals([{}, {COMMAND_CLOCK: 0.02}, both])
    e = model.weigh(residuals)[model.valid > 0.0]
    clock, delayed = e[:, 1] - e[:, 0], e[:, 2] - e[:, 0]
    assert np.linalg.norm(clock - delayed) < 0.1 * np.linalg.norm(delayed)


def test_a_clock_of_commands_shows_however_little_it_is_late(model):
    residuals, _ = model.residuals([{}, {COMMAND_CLOCK: 0.002}, {COMMAND_CLOCK: 0.0001}])
    e = model.weigh(residuals)[model.valid > 0.0]
    much, little = e[:, 1] - e[:, 0], e[:, 2] - e[:, 0]
    np.testing.assert_allclose(20.0 * little, much, atol=0.02 * np.abs(much).max())


def test_a_motor_may_answer_milliseconds_late_without_an_effect(model):
    assert THROTTLE_CLOCK in [own.key for own in model.nominal]
    late = {"drive.delay_s": 0.004}
    e, _ = model([{}, late, late | {THROTTLE_CLOCK: -0.004}])
    assert np.abs(e[:, 1] - e[:, 0]).max() > 0.1
    np.testing.assert_array_equal(e[:, 2], e[:, 0])


def test_the_pose_is_carried_back_so_that_a_long_drive_ends_where_it_was_measured(healthy):
    rollouts = Rollouts(healthy, big_nigel())
    rollouts.run([{"steering.trim_rad": 0.1}])
    fleet = rollouts.tiles.fleets[0]
    assert abs(float(fleet.x[0]) - healthy.smoothed["pose.x"].value[-1]) < 0.05


def test_at_the_truth_innovations_are_no_larger_than_noise(model, healthy):
    e, ok = model([{}])
    assert ok.all()
    for i, stream in enumerate(healthy.streams):
        power = np.mean(e[(model.whiteners[0].stream == i) & (model.valid > 0.0), 0] ** 2)
        assert power < 1.25, stream.name
        if stream.name.startswith("pose."):
            assert power > 0.8, stream.name


def test_whitening_is_linear(model, healthy):
    residuals, _ = model.residuals([{}, {"steering.trim_rad": 0.05}])
    e = model.weigh(residuals)
    mixed = [[3.0 * r[:, :1] - 2.0 * r[:, 1:] for r in residuals[0]]]
    np.testing.assert_allclose(model.weigh(mixed)[:, 0], 3.0 * e[:, 0] - 2.0 * e[:, 1], atol=1e-6)


@pytest.mark.parametrize(
    ("key", "value", "stream"),
    [
        ("measure.gyro_bias_rad_s", 0.05, "imu.gyro_z"),
        ("measure.pose_scale", 1.1, "pose.x"),
        ("measure.encoder_loss", 0.1, "encoder.left"),
        ("measure.pose_delay_s", 0.1, "pose.x"),
        ("measure.camera_tilt_x_per_m", 0.1, "pose.x"),
    ],
)
def test_a_fault_of_measurement_changes_what_its_sensor_is_expected_to_say(
    model, healthy, key, value, stream
):
    residuals, _ = model.residuals([{}, {key: value}])
    for i, one in enumerate(healthy.streams):
        moved = not np.allclose(residuals[0][i][:, 0], residuals[0][i][:, 1])
        alike = one.name == stream or one.name.partition(".")[0] == stream.partition(".")[0]
        assert moved == alike or (alike and not stream.startswith(one.name)), one.name
    i = healthy.names.index(stream)
    assert not np.allclose(residuals[0][i][:, 0], residuals[0][i][:, 1])


def test_a_step_within_bounds_is_the_best_there():
    normal = np.array([[2.0, 1.9], [1.9, 2.0]])
    slope = np.array([-4.0, -3.0])
    step = bounded_step(normal, slope, np.array([-1.0, -1.0]), np.array([1.0, 1.0]))
    tried = np.stack(np.meshgrid(np.linspace(-1, 1, 81), np.linspace(-1, 1, 81)), -1).reshape(-1, 2)
    values = 0.5 * np.einsum("ni,ij,nj->n", tried, normal, tried) + tried @ slope
    assert 0.5 * step @ normal @ step + slope @ step <= values.min() + 1e-3


@pytest.mark.parametrize(
    ("name", "key", "value"),
    [
        ("steer_trim", "steering.trim_rad", 0.05),
        ("drive_gain", "drive.gain", 0.8),
        ("steer_backlash", "steering.backlash_rad", 0.08),
    ],
)
def test_a_fit_finds_what_was_concealed(name, key, value):
    drive = Drive(made_drive(((key, value),), seconds=9.0), big_nigel())
    model = Likelihood.of([drive], big_nigel())
    fitter = Fitter(model, np.ones(len(model.t)))
    (base,) = fitter.refine([fitter.unfitted()], rounds=3, fresh=True)
    effect = by_name(candidates(big_nigel()), name)
    begun = fitter.begin(base, [((effect,), np.array(start)) for start in effect.starts])
    best = min(fitter.refine(begun, rounds=5), key=lambda f: f.score)
    assert best.score < base.score - 30.0
    assert best.values[0] == pytest.approx(value, rel=0.15)
    assert np.all(np.abs(best.z) <= 2.0)


def test_the_cars_own_twin_of_an_effect_stays_as_the_file_has_it():
    drive = Drive(made_drive((("steering.rate_scale", 0.6),), seconds=12.0), big_nigel())
    model = Likelihood.of([drive], big_nigel())
    fitter = Fitter(model, np.ones(len(model.t)))
    (base,) = fitter.refine([fitter.unfitted()], rounds=3, fresh=True)
    own = [o.key for o in model.nominal].index("steering.rate_rad_s")
    assert base.z[own] < -0.2
    effect = by_name(candidates(big_nigel()), "steer_rate")
    (best,) = fitter.refine(
        fitter.begin(base, [((effect,), np.array([0.75]))]), rounds=6, fresh=True
    )
    assert best.z[own] == pytest.approx(0.0, abs=1e-12)
    assert best.values[0] == pytest.approx(0.6, rel=0.02)


def test_noise_that_a_poor_model_raised_is_taken_back(healthy):
    model = Likelihood.of([healthy], big_nigel())
    least, (residuals, _) = model.noise, model.residuals([{}])
    raised = replace(least, speed=16 * least.speed, side=16 * least.side, launch=8 * least.launch)
    learnt = fit_noise(model.under(raised), residuals, rounds=1).noise
    assert learnt.speed <= 2 * least.speed
    assert learnt.launch <= 2 * least.launch


def test_no_noise_model_is_weighed_twice(healthy, monkeypatch):
    model, weighed = Likelihood.of([healthy], big_nigel()), []
    residuals, _ = model.residuals([{}])
    model, under = model.under(replace(model.noise, speed=4 * model.noise.speed)), Whitener.under
    monkeypatch.setattr(
        Whitener, "under", lambda one, noise: (weighed.append(repr(noise)), under(one, noise))[1]
    )
    learnt = fit_noise(model, residuals, rounds=2)
    assert weighed.pop() == repr(learnt.noise)  # that of the likelihood returned
    assert len(weighed) == len(set(weighed)) > 20


def test_another_noise_model_leaves_a_likelihood_as_it_was(healthy):
    model = Likelihood.of([healthy], big_nigel())
    before, noise = model([{}])[0], model.noise
    louder = model.under(replace(noise, speed=4 * noise.speed))
    assert np.abs(louder([{}])[0] - before).max() > 0.0
    np.testing.assert_array_equal(model([{}])[0], before)
    assert model.noise == noise


def test_no_effect_is_tried_beside_its_twin(healthy):
    model = Likelihood.of([healthy], big_nigel())
    listed = [c for c in candidates(big_nigel()) if c.name in {"grade", "wind", "steer_trim"}]
    context = Context(np.ones(len(model.t)), tuple(listed))
    fitter = context.fitter(model)
    (base,) = fitter.refine([fitter.unfitted()], rounds=1, fresh=True)
    grade = next(c for c in listed if c.name == "grade")
    (sloped,) = fitter.refine(
        fitter.begin(base, [((grade,), np.array([0.01, 0.0]))]), rounds=1, fresh=True
    )
    tried = {one.names[-1] for one in extend(context, sloped).alternatives}
    assert tried == {"steer_trim"}


def test_a_delay_is_told_from_a_lag():
    made = made_drive(seconds=9.0)
    sent = made.channels["command.steering"]
    early = {**made.channels, "command.steering": replace(sent, t=sent.t - 0.03)}
    drive = Drive(replace(made, channels=early), big_nigel())
    model = Likelihood.of([drive], big_nigel())
    listed = [c for c in candidates(big_nigel()) if c.name in {"steer_delay", "steer_lag"}]
    context = Context(np.ones(len(model.t)), tuple(listed))
    best = extend(context, retune(context, model)).alternatives[0]
    assert best.names == ("steer_delay",)
    assert best.values[0] == pytest.approx(0.03, abs=0.006)


def test_an_effect_smaller_than_its_trials_and_of_the_other_sign_is_begun_where_it_is():
    biased = Drive(made_drive([], sense=_lower_y), big_nigel())
    fitter = Fitter(Likelihood.of([biased], big_nigel()), np.ones(1))
    effect = by_name(candidates(big_nigel()), "accel_bias")
    base = fitter.with_nominal_car(fitter.unfitted())
    trials = [((effect,), np.array(start)) for start in effect.starts]
    assert min(f.score for f in fitter.begin(base, trials)) > base.score
    best = min(fitter.begin(base, trials, amplified=True), key=lambda f: f.score)
    assert best.values[1] == pytest.approx(-0.03, abs=0.01)


def _lower_y(name, _t, values):
    return values - 0.03 if name == "imu.accel_y" else values
