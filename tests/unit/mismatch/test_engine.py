"""Rollouts, prediction, whitening and fits, on drives that the simulator itself made."""

import numpy as np
import pytest

from scm.mismatch.drive import Drive
from scm.mismatch.fit import Fitter, _bounded
from scm.mismatch.likelihood import Likelihood
from scm.mismatch.listed import by_name, candidates
from scm.mismatch.rollouts import Rollouts
from tests.unit.mismatch.made_drive import big_nigel, made_drive


@pytest.fixture(scope="module")
def healthy():
    return Drive(made_drive(seconds=12.0), big_nigel())


@pytest.fixture(scope="module")
def model(healthy):
    return Likelihood([healthy], big_nigel())


def test_rows_do_not_feel_each_other(healthy):
    rollouts = Rollouts(healthy, big_nigel())
    sets = [{"steering.trim_rad": 0.002 * i} for i in range(40)]
    together, alone = rollouts.run(sets), rollouts.run([sets[37]])
    np.testing.assert_array_equal(together["speed"][:, 37], alone["speed"][:, 0])


def test_a_delay_is_the_command_later(healthy):
    motions = Rollouts(healthy, big_nigel()).run([{}, {"steering.delay_s": 0.1}])
    now, late = motions["steer_angle"].T
    np.testing.assert_allclose(late[300:], now[290:-10], atol=2e-3)


def test_the_pose_is_carried_back_so_that_a_long_drive_ends_where_it_was_measured(healthy):
    rollouts = Rollouts(healthy, big_nigel())
    rollouts.run([{"steering.trim_rad": 0.1}])
    fleet = rollouts.tiles.fleets[0]
    assert abs(float(fleet.x[0]) - healthy.smoothed["pose.x"].value[-1]) < 0.05


def test_at_the_truth_innovations_are_no_larger_than_noise(model, healthy):
    e, ok = model([{}])
    assert ok.all()
    for i, stream in enumerate(healthy.streams):
        power = np.mean(e[(model.whiteners[0].stream == i) & (model.settled > 0.0), 0] ** 2)
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
    step = _bounded(normal, slope, np.array([-1.0, -1.0]), np.array([1.0, 1.0]))
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
    drive = Drive(made_drive(((key, value),), seconds=12.0), big_nigel())
    model = Likelihood([drive], big_nigel())
    fitter = Fitter(model, np.ones(len(model.t)))
    (base,) = fitter.refine([fitter.null()], rounds=3, fresh=True)
    effect = by_name(candidates(big_nigel()), name)
    begun = fitter.begin(base, [((effect,), np.array(start)) for start in effect.starts])
    best = min(fitter.refine(begun, rounds=5), key=lambda f: f.q)
    assert best.q < base.q - 30.0
    assert best.values[0] == pytest.approx(value, rel=0.15)
    assert np.all(np.abs(best.z) <= 2.0)
