"""Every reachable state of the kernel under every wish is safe; every mutant of it is caught."""

from itertools import combinations

import pytest

from scm.errors import PlanError
from scm.traffic.signals import kernel
from scm.traffic.signals.kernel import GroupTimes, Phase, Program
from scm.traffic.signals.proof.kernel_proof import in_steps, prove
from tests.unit.traffic.signals.mutants import KERNEL, mutant_of


def pairs(*names):
    return frozenset(frozenset(pair) for pair in names)


CROSSING = Program(("a", "b"), (GroupTimes(3, 2, 4), GroupTimes(2, 3, 2)), pairs("ab"))
TRIANGLE = Program(
    ("a", "b", "c"),
    (GroupTimes(2, 1, 2), GroupTimes(1, 2, 3), GroupTimes(2, 2, 1)),
    pairs("ab", "bc"),
)


def dual_ring():
    """NEMA's eight phases: two rings, and a barrier between 1 2 5 6 and 3 4 7 8."""
    halves = (("12", "56"), ("34", "78"))
    together = {(one, other) for ring1, ring2 in halves for one in ring1 for other in ring2}
    names = tuple("12345678")
    conflicts = pairs(*(pair for pair in combinations(names, 2) if pair not in together))
    return Program(names, (GroupTimes(2, 1, 2),) * 8, conflicts)


@pytest.mark.parametrize("program", [CROSSING, TRIANGLE], ids=["crossing", "triangle"])
def test_no_state_of_a_small_junction_is_unsafe_however_steps_fall(program):
    assert prove(kernel, program, dts=(1, 0, 2, 5)).transitions > 100


def test_no_state_of_a_dual_ring_of_eight_phases_is_unsafe():
    walked = prove(kernel, dual_ring())
    assert len(walked.states) > 300
    assert walked.transitions > 80_000


@pytest.mark.parametrize("name", sorted(KERNEL))
def test_a_mutant_of_the_kernel_is_caught(name):
    mutant = mutant_of(kernel, *KERNEL[name])
    with pytest.raises(PlanError, match="unsafe"):
        prove_all(mutant)


def prove_all(module):
    for program in (CROSSING, TRIANGLE):
        prove(module, program, dts=(1, 2))


def test_the_source_without_mutation_passes_the_same_proof():
    prove_all(kernel)


def test_a_program_in_steps_is_never_shorter():
    program = in_steps(Program(("a",), (GroupTimes(250, 100, 199),), frozenset()), 100)
    assert program.times == ((3, 1, 2),)


def test_time_that_runs_backward_counts_as_none():
    state = kernel.start(CROSSING)
    assert kernel.step(CROSSING, state, (), -5) == state


def test_a_green_that_is_still_wished_stays_and_its_count_is_bounded():
    state = kernel.start(CROSSING)
    for _ in range(50):
        state = kernel.step(CROSSING, state, {"a"}, 1)
    assert state[0] == (Phase.GREEN, 3)
