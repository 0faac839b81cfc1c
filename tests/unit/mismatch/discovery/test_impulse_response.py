"""Responses of moments: their sums are what a rollout gives, and the best law is found in them."""

from dataclasses import replace
from functools import cache

import numpy as np

from scm.mismatch.discovery.general_effect import PREFIX
from scm.mismatch.discovery.impulse_response import Cells, Response, cells_of, respond
from scm.mismatch.discovery.screen import polished, pushes, remembered, screen
from scm.mismatch.fit.fitter import Fitter
from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.validate.curves import axis_of
from tests.unit.mismatch.discovery import made_effect


@cache
def healthy():
    """Model, fitter and base of a healthy drive, and its moments."""
    model = Likelihood.of([made_effect.lawful_drive()], made_effect.lawful_nigel())
    fitter = Fitter(model, np.ones(len(model.t)))
    (base,) = fitter.refine([fitter.unfitted()], rounds=1, fresh=True)
    return model, fitter, base, cells_of(base)


def explained(model, fitter, base, change):
    """What a change of the innovations adds to the objective, own numbers refitted linearly."""
    weights, own = fitter.weights(base.innovations), base.jacobian
    normal = (own.T * weights) @ own + np.eye(own.shape[1])
    held = np.linalg.solve(normal, (own.T * weights) @ change)
    return float(change @ (weights * change) - held @ normal @ held)


def test_hats_together_are_the_rollout_of_the_whole_course():
    model, fitter, base, cells = healthy()
    for channel, size in (("along_n", 0.2), ("turn_rad", 0.01)):
        response = respond(fitter, base, cells, channel)
        course = size * np.sin(2.0 * np.pi * cells.driven["time"] / 4.0)
        swing = {
            PREFIX + "by_time": 2.0 * np.pi / 4.0,
            PREFIX + "sine": size,
            PREFIX + channel: 1.0,
        }
        numbers = base.numbers
        e, _ = model([numbers, numbers | swing])
        true = explained(model, fitter, base, e[:, 1] - e[:, 0])
        np.testing.assert_allclose(course @ response.bend @ course, true, rtol=0.1)


def made_cells():
    t = 0.1 * np.arange(600)
    driven = {"time": t, "x": np.cos(0.5 * t), "y": np.sin(0.5 * t), "yaw": 0.5 * t + 1.57,
              "speed": 0.5 + 0.2 * np.sin(1.3 * t), "steer": 0.3 * np.sin(0.9 * t),
              "throttle": 0.5 + 0.3 * np.cos(1.1 * t), "rate": np.full(600, 0.5),
              "side": 0.2 * np.sin(0.7 * t)}  # fmt: skip
    return Cells(0.1, np.zeros(600, dtype=np.int64), driven)


def eights():
    """The same on eights: on a circle a place and a heading are one."""
    cells = made_cells()
    t = cells.driven["time"]
    turning = 0.5 * t * 1.01
    x, y = np.sin(turning), 0.8 * np.sin(2.0 * turning) + 0.2 * np.sin(0.21 * t)
    yaw = np.unwrap(np.arctan2(np.gradient(y, t), np.gradient(x, t)))
    return replace(cells, driven={**cells.driven, "x": x, "y": y, "yaw": yaw})


def best_of(law, values, cells=None):
    """The best start where every moment is measured by itself and one law is true."""
    cells = cells or made_cells()
    response = Response(-pushes(law, cells, values), np.eye(len(cells)))
    ((first, *_),) = screen([law], cells, {law.channel.response: response})
    return polished(first, cells, response), cells, response


def test_the_period_of_a_gust_is_found():
    best, _, response = best_of(made_effect.gust(), (0.8, 0.9, 3.3, 0.5))
    assert abs(best.values[2] - 3.3) < 0.05
    assert best.gain > 0.95 * float(response.slope @ response.slope)


def test_the_way_of_a_nap_is_found():
    law = made_effect.law("drive force against heading", "one way")
    best, _, _ = best_of(law, (0.8, 2.0))
    np.testing.assert_allclose(best.values, (0.8, 2.0), atol=0.05)


def test_the_waves_of_a_floor_are_found():
    law = made_effect.law("drive force against position", "wave")
    best, cells, response = best_of(law, (0.5, 0.7, 0.4, 0.3))
    assert abs(best.values[1] - 0.7) < 0.02
    assert best.gain > 0.9 * float(response.slope @ response.slope)
    assert len(cells) == len(response.slope)


def test_the_place_of_a_yaw_moment_is_found():
    law = made_effect.law("yaw moment against position", "near")
    best, cells, response = best_of(law, (0.3, 0.6, -0.5, 0.45), eights())
    assert best.gain > 0.9 * float(response.slope @ response.slope)
    np.testing.assert_allclose(best.values[1:], (0.6, -0.5, 0.45), atol=0.1)
    x, name, unit = axis_of(law, best.values[1:], cells)
    assert (unit, name.startswith("distance from")) == ("m", True)
    assert 0.0 <= x.min() < 0.45


def test_the_centre_of_a_spring_is_found():
    law = made_effect.law("spring against position", "everywhere")
    best, _, response = best_of(law, (0.8, 0.3, -0.4), eights())
    assert best.gain > 0.99 * float(response.slope @ response.slope)
    np.testing.assert_allclose(best.values, (0.8, 0.3, -0.4), atol=0.02)


def test_turns_are_laid_over_each_other_so_that_a_heading_fills_one_bin():
    law = made_effect.law("drive force against heading", "one way")
    yaw = np.linspace(-12.0, 3.0, 400)
    cells = Cells(wide=0.1, drive=np.zeros(400, dtype=np.int64), driven={"yaw": yaw})
    x, name, unit = axis_of(law, (0.5,), cells)
    assert (name, unit) == ("heading", "rad")
    assert np.abs(x).max() <= np.pi
    np.testing.assert_allclose(np.cos(x), np.cos(yaw), atol=1e-12)


def test_what_is_remembered_of_the_throttle_fades_and_begins_with_every_drive_anew():
    values = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 1.0])
    drive = np.array([0, 0, 0, 0, 1, 1])
    np.testing.assert_allclose(remembered(values, drive, 0.5), [0.0, 0.5, 0.75, 0.875, 0.0, 0.0])


def test_a_law_of_the_throttle_s_past_begins_near_how_long_it_is_remembered():
    worked = made_effect.law("throttle against throttle's past", "worked")
    start, _, _ = best_of(worked, (-0.2, 8.0))
    assert start.effect is worked
    np.testing.assert_allclose(start.values, (-0.2, 8.0), rtol=0.1)
