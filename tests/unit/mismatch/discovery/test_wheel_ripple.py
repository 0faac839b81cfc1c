"""Torque over a wheel's turn: found by its waves, whatever the wheels had turned before."""

from functools import cache

import numpy as np

from scm.mismatch.discovery.general_effect import RIPPLE
from scm.mismatch.discovery.impulse_response import WAVES, by_turn, ripples
from scm.mismatch.discovery.try_dictionary import try_dictionary
from scm.mismatch.fit.fitter import Fitter
from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.fit.rollouts import Rollouts
from scm.mismatch.validate.curves import discovered_curves
from scm.replay.drive import Drive
from scm.vehicles.jit import plain
from tests.unit.mismatch.discovery import made_effect

TRUE = (0.03, 3.0, 0.7)  # N*m, waves in a turn, rad


@cache
def rippled():
    drive = made_effect.lawful_drive(by_turn().numbers(TRUE))
    model = Likelihood.of([drive], made_effect.lawful_nigel())
    fitter = Fitter(model, np.ones(len(model.t)))
    (base,) = fitter.refine([fitter.unfitted()], rounds=2, fresh=True)
    return fitter, base


@cache
def found():
    _, base = rippled()
    return try_dictionary(base, np.ones(len(base.model.t)))


def test_the_right_number_of_waves_in_a_turn_explains_most():
    explained = {values[1]: gain for values, gain in ripples(*rippled())}
    assert set(explained) == set(WAVES)
    assert max(explained, key=explained.get) == TRUE[1]


def test_a_ripple_is_found_with_its_torque_and_phase():
    (first, *_) = found().found
    assert first.names == ("drive torque against phase",)
    assert (first.effects[0].equation, first.effects[0].depends_on) == ("drive", ("phase",))
    np.testing.assert_allclose(first.values, TRUE, rtol=0.06, atol=0.05)


def test_its_curve_over_a_turn_runs_through_the_bands_of_all_waves():
    free, fit = discovered_curves(found().found[0], found())
    assert free.x_name == "wheel turn"
    np.testing.assert_allclose(fit.y.max(), TRUE[0], rtol=0.06)
    assert np.mean((free.low <= fit.y) & (fit.y <= free.high)) > 0.6


def test_only_driven_wheels_ripple():
    ripple = plain(RIPPLE.function)
    assert ripple(0.0, 1.0, 0.5, 2.0, 0.3) == 0.0
    np.testing.assert_allclose(ripple(1.0, 1.0, 0.5, 2.0, 0.3), 0.5 * np.sin(2.3))


def test_encoders_that_begin_elsewhere_shift_the_phase_alone():
    """Wheels are turned as far as measured; what encoders are predicted to count goes on evenly."""
    drive = made_effect.lawful_drive(seconds=6.0)
    late = made_effect.lawful_drive(seconds=6.0, sense=_counted_from(1000.0))
    assert np.ptp(late.turned - drive.turned) < 1e-6
    runs = [Rollouts(one, made_effect.lawful_nigel()).run([{}]) for one in (drive, late)]
    steps = [np.diff(run["wheel_angle.rl"][:, 0]) for run in runs]
    np.testing.assert_allclose(steps[1], steps[0], atol=1e-9)


def test_without_encoders_wheels_turn_as_far_as_the_poses_go():
    recording = made_effect.lawful_drive(seconds=6.0).recording
    both = [Drive(recording, made_effect.lawful_nigel())]
    kept = {n: c for n, c in recording.channels.items() if not n.startswith("encoder.")}
    both.append(Drive(type(recording)(recording.path, "nigel", kept), made_effect.lawful_nigel()))
    way = [drive.turned[-1] - drive.turned[100] for drive in both]
    np.testing.assert_allclose(way[1], way[0], rtol=0.05)


def _counted_from(count):
    return lambda name, _, values: values + count * name.startswith("encoder.")
