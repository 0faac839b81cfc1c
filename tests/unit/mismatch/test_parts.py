"""Parts of recordings: disjoint, whole, in blocks that take turns."""

import numpy as np

from scm.mismatch.fit.data_split import NAMES, split
from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.validate.free_runs import horizon_of
from tests.unit.mismatch.made_drive import big_nigel, driven, healthy_model


def lengths(spans):
    return sum(end - start for start, end in spans)


def test_every_innovation_is_in_exactly_one_part():
    parts = split(healthy_model(), 1.0)
    assert np.all(sum(getattr(parts, name).weight for name in NAMES) == 1.0)


def test_half_of_the_time_is_to_fit_and_a_quarter_each_to_choose_and_confirm():
    parts = split(healthy_model(), 1.0)
    times = np.array([lengths(getattr(parts, name).spans[0]) for name in NAMES])
    assert np.allclose(times / times.sum(), (0.5, 0.25, 0.25), atol=0.03)


def test_weights_and_spans_say_the_same():
    model = healthy_model()
    parts = split(model)
    for name in NAMES:
        part = getattr(parts, name)
        inside = np.zeros(len(model.t), dtype=bool)
        for start, end in part.spans[0]:
            inside |= (model.t >= start) & (model.t < end)
        assert np.mean(inside == (part.weight == 1.0)) > 0.999


def test_the_order_of_turns_changes_so_that_no_lap_falls_in_step_with_it():
    parts = split(healthy_model(), 1.0)
    starts = [round(start - parts.fit.spans[0][0][0]) % 4 for start, _ in parts.confirm.spans[0]]
    assert len(set(starts)) > 2


def test_even_a_short_drive_has_all_three_parts():
    model = Likelihood.of([driven(seconds=4.0)], big_nigel())
    parts = split(model)
    assert all(getattr(parts, name).weight.any() for name in NAMES)


def test_two_drives_are_split_each():
    one = healthy_model().drives[0]
    parts = split(Likelihood.of([one, one], big_nigel()), 1.0)
    for name in NAMES:
        first, second = getattr(parts, name).spans
        assert abs(lengths(first) - lengths(second)) < 0.1 * lengths(first)
        assert first != second


def test_many_drives_too_short_to_cut_take_turns_as_wholes():
    one = driven(seconds=4.0)
    parts = split(Likelihood.of([one] * 4, big_nigel()))
    held = [sum(len(getattr(parts, name).spans[i]) for name in NAMES) for i in range(4)]
    assert held == [1, 1, 1, 1]
    counts = {name: sum(map(bool, getattr(parts, name).spans)) for name in NAMES}
    assert counts == {"fit": 2, "choose": 1, "confirm": 1}


def test_a_short_stretch_beside_a_long_one_is_not_cut():
    parts = split(Likelihood.of([driven(seconds=8.0), driven(seconds=3.0)], big_nigel()), 1.9)
    held = [sum(len(getattr(parts, name).spans[i]) for name in NAMES) for i in range(2)]
    assert held == [4, 1]


def test_a_short_stretch_does_not_shorten_the_windows_of_all():
    drives = [driven(seconds=14.0), driven(seconds=2.5)]
    parts = split(Likelihood.of(drives, big_nigel()), 3.4)
    assert horizon_of(drives, parts) > 2.8
