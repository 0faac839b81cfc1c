"""The kernel as arrays is the kernel; a million random steps are without conflict."""

import numpy as np
import pytest

from scm.traffic.signals import kernel
from scm.traffic.signals.kernel import GroupTimes, Program
from scm.traffic.signals.proof.kernel_proof import prove
from scm.traffic.signals.proof.random_requests import (
    GREEN,
    KernelArrays,
    differences,
    run_random_requests,
)


def pairs(*names):
    return frozenset(frozenset(pair) for pair in names)


CROSSING = Program(("a", "b"), (GroupTimes(3, 2, 4), GroupTimes(2, 3, 2)), pairs("ab"))
TRIANGLE = Program(
    ("a", "b", "c"),
    (GroupTimes(2, 1, 2), GroupTimes(1, 2, 3), GroupTimes(2, 2, 1)),
    pairs("ab", "bc"),
)


@pytest.mark.parametrize("program", [CROSSING, TRIANGLE])
def test_arrays_and_kernel_agree_in_every_state_under_every_wish(program):
    states = prove(kernel, program, dts=(1, 0, 2)).states
    assert differences(program, states, dts=(1, 0, 2, 5)) == 0


def test_a_difference_is_found(monkeypatch):
    monkeypatch.setattr("scm.traffic.signals.proof.random_requests.YELLOW", 1)
    assert differences(CROSSING, prove(kernel, CROSSING).states) > 0


def test_a_million_random_steps_begin_thousands_of_greens_and_no_conflict():
    judged = run_random_requests(TRIANGLE, 2000, 500, seed=1)
    assert judged.steps == 1_000_000
    assert judged.greens > 10_000
    assert (judged.conflicts, judged.short_clearances) == (0, 0)


def test_the_judge_sees_conflicts_and_short_clearances(monkeypatch):
    def blind(self, requested, flash, dt=1):
        self.phase[:] = np.where(requested, GREEN, 0)

    monkeypatch.setattr(KernelArrays, "step", blind)
    judged = run_random_requests(CROSSING, 100, 200, seed=1)
    assert judged.conflicts > 0
    assert judged.short_clearances > 0
