"""A car judged by residual windows, and the selection of several effects at once."""

from dataclasses import replace

import numpy as np
import pytest

from scm.mismatch.fit.data_split import split
from scm.mismatch.fit.noise import LAUNCH, MUCH, TURN, doublings, usual_noise
from scm.mismatch.fit.residual_windows import LENGTH_S, WindowedLikelihood, fit_sizes, least_sizes
from scm.mismatch.select.begin_again import numbers_at_ends, with_wider_numbers
from scm.mismatch.select.round import Context
from scm.mismatch.select.search import by_windows, select_many
from scm.mismatch.select.selected import Selected
from scm.mismatch.validate.explain import widened_of
from tests.unit.mismatch.made_drive import big_nigel, driven
from tests.unit.mismatch.made_fit import candidate


@pytest.fixture(scope="module")
def healthy():
    return driven()


@pytest.fixture(scope="module")
def model(healthy):
    return WindowedLikelihood.of([healthy], big_nigel())


def test_windows_are_linear_in_residuals(model):
    residuals, _ = model.residuals([{}, {"steering.trim_rad": 0.05}])
    e = model.weigh(residuals)
    mixed = [[3.0 * r[:, :1] - 2.0 * r[:, 1:] for r in residuals[0]]]
    np.testing.assert_allclose(model.weigh(mixed)[:, 0], 3.0 * e[:, 0] - 2.0 * e[:, 1], atol=1e-6)


def test_a_window_lies_within_one_part(model):
    parts = split(model)
    weights = parts.fit.weight + parts.choose.weight + parts.confirm.weight
    np.testing.assert_array_equal(weights, np.ones(len(model.t)))
    for part in (parts.fit, parts.choose, parts.confirm):
        middles = model.t[part.weight > 0.0]
        inside = [
            any(a - 1e-6 <= t - 0.5 * LENGTH_S and t + 0.5 * LENGTH_S <= b + 1e-6
                for a, b in part.spans[0])
            for t in middles
        ]  # fmt: skip
        assert all(inside)


def test_a_wrong_heading_is_missed_across_the_body_too(model):
    """The simulator turns at a wrong rate: half of it times the way is missed across."""
    drive, weigher = model.drives[0], model.whiteners[0]
    zero = [np.zeros((len(s.t), 1)) for s in drive.streams]
    rate = 0.1
    zero[drive.names.index("pose.yaw")] = (rate * drive.stream("pose.yaw").t)[:, None]
    misses = weigher.misses(zero)[:, 0]
    by = {name: misses[weigher.stream == i] for i, name in enumerate(drive.names)}
    np.testing.assert_allclose(by["pose.yaw"], rate * LENGTH_S, atol=1e-9)
    begin = weigher.t[: len(by["pose.y"])] - 0.5 * LENGTH_S
    x, y = drive.smoothed["pose.x"], drive.smoothed["pose.y"]
    way = np.hypot(x.at(begin + 1.0) - x.at(begin), y.at(begin + 1.0) - y.at(begin))
    assert np.median(by["pose.y"] / way) == pytest.approx(0.5 * rate * LENGTH_S, rel=0.2)


def test_sizes_grow_with_what_is_missed_and_never_below_the_least(model, healthy):
    residuals, _ = model.residuals([{}, {"steering.trim_rad": 0.1}])
    right, wrong = ([[r[:, i : i + 1] for r in residuals[0]]] for i in (0, 1))
    calm = fit_sizes(model, right).noise.own
    least = least_sizes([healthy])
    assert all(calm[name] >= least[name] for name in least)
    assert fit_sizes(model, wrong).noise.own["pose.yaw"] > 2.0 * calm["pose.yaw"]


def test_least_disturbances_are_no_doublings(healthy):
    noise = usual_noise([healthy])
    assert doublings(noise, [healthy]) == pytest.approx(0.0)
    assert doublings(replace(noise, side=4.0 * noise.side), [healthy]) == pytest.approx(2.0)


def test_launches_and_steering_leaps_count_only_where_they_are_off_by_a_tenth(healthy):
    noise = usual_noise([healthy])
    somewhat = replace(noise, launch=MUCH / LAUNCH * noise.launch, turn=MUCH / TURN * noise.turn)
    assert doublings(somewhat, [healthy]) == pytest.approx(0.0)
    more = replace(somewhat, launch=2.0 * somewhat.launch, turn=4.0 * somewhat.turn)
    assert doublings(more, [healthy]) == pytest.approx(3.0)


def test_two_effects_are_found_in_one_round():
    truth = {"steering.trim_rad": 0.06, "drive.gain": 0.8}
    drive = driven(tuple(truth.items()), seconds=7.0)
    names = ("steer_trim", "drive_gain", "gyro_bias", "steer_gain")
    library = [candidate(name) for name in names]
    context = Context(np.ones(1), tuple(library))
    many = by_windows(context, [drive], big_nigel())
    found = select_many(many.context, many.retuned)
    best = found.best
    assert set(best.names) == {"steer_trim", "drive_gain"}
    assert len(found.rounds) >= 2
    values = dict(zip(best.names, best.values, strict=True))
    assert values["steer_trim"] == pytest.approx(0.06, abs=0.01)
    assert values["drive_gain"] == pytest.approx(0.8, abs=0.08)


def test_numbers_at_an_end_of_their_scatter_get_a_wider_one_which_the_report_names():
    key, given = "drive.no_load_speed_rad_s", big_nigel().quantity("drive.no_load_speed_rad_s")
    true = given.value + 6.0 * given.std
    drive = driven(((key, true), ("steering.trim_rad", 0.06)), seconds=7.0)
    many = by_windows(Context(np.ones(1), (candidate("steer_trim"),)), [drive], big_nigel())
    first = select_many(many.context, many.retuned)
    selected = Selected(
        [drive.recording], [drive], big_nigel(), many.context, many.parts, first, ()
    )
    assert key in [one.key for one in numbers_at_ends(first.best)]
    found = with_wider_numbers(selected).best
    model = found.model
    (own,) = [one for one in model.nominal if one.key == key]
    assert own.std == 2.0 * given.std
    assert found.names == ("steer_trim",)
    assert found.numbers[key] == pytest.approx(true, rel=0.03)
    (text,) = [text for text in widened_of(model, big_nigel()) if key in text]
    assert "the recordings put the number at an end of what that allows" in text
    inside = replace(first.best, z=0.5 * first.best.z)
    within = replace(selected, selection=replace(first, best=inside))
    assert with_wider_numbers(within) is None
