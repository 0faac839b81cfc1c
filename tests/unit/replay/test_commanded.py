"""Commands as means over steps."""

import numpy as np

from scm.replay.commands import Commanded

COMMAND = Commanded(np.array([0.0, 0.05, 0.1]), np.array([1.0, -1.0, 0.5]))


def test_a_step_within_a_row_has_the_rows_value():
    np.testing.assert_allclose(
        COMMAND.means(np.array([0.01, 0.02, 0.03]), np.zeros(1))[:, 0], [1.0, 1.0]
    )


def test_a_step_over_an_edge_has_the_mean_of_both_sides():
    assert np.isclose(COMMAND.means(np.array([0.04, 0.06]), np.zeros(1))[0, 0], 0.0)


def test_a_delay_moves_the_command_by_itself():
    edges = np.arange(0.0, 0.2, 0.01)
    late = COMMAND.means(edges, np.array([0.03]))[3:, 0]
    np.testing.assert_allclose(late, COMMAND.means(edges, np.zeros(1))[:-3, 0], atol=1e-12)


def test_before_the_first_row_it_is_zero_and_after_the_last_it_holds():
    means = COMMAND.means(np.array([-0.2, -0.1, 0.0, 0.3, 0.4]), np.zeros(1))[:, 0]
    assert means[0] == 0.0
    assert np.isclose(means[-1], 0.5)


def test_the_mean_is_the_difference_of_the_integral_whatever_delays_stand_beside():
    rng = np.random.default_rng(2)
    command = Commanded(np.cumsum(rng.uniform(0.01, 0.03, 50)), rng.uniform(-1.0, 1.0, 50))
    edges, delays = np.linspace(-0.1, 1.5, 400), np.array([0.0, 0.013, 0.0, 0.2])
    fine = np.linspace(edges[0], edges[-1], 400_001)
    for delay, means in zip(delays, command.means(edges, delays).T, strict=True):
        row = np.searchsorted(command.t, fine - delay, side="right") - 1
        held = np.where(row >= 0, command.values[row], 0.0)
        area = np.concatenate(([0.0], np.cumsum(held[:-1] * np.diff(fine))))
        expected = np.diff(np.interp(edges, fine, area)) / np.diff(edges)
        np.testing.assert_allclose(means, expected, atol=3e-3)
