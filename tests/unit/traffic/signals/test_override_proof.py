"""Holds, omits, force-offs and pre-emption keep their meaning and starve nobody once they end."""

from itertools import combinations

import pytest

from scm.errors import PlanError
from scm.traffic.signals import rings
from scm.traffic.signals.kernel import GroupTimes, Program
from scm.traffic.signals.plan import Stage, Timetable, timetable
from scm.traffic.signals.policy import Answer, Policy, nothing
from scm.traffic.signals.program import STEP_NS
from scm.traffic.signals.proof.load_checks import (
    check_called_groups_are_served,
    check_junction,
    check_table,
)
from scm.traffic.signals.proof.override_proof import check_ring_shape, prove_overrides
from scm.traffic.signals.proof.ring_proof import small_times
from tests.unit.traffic.signals.mutants import RINGS_WITH_INPUTS, mutant_of
from tests.unit.traffic.signals.test_rings import CROSSING, SHAPES, SIDE, THREE, Junction, program

IN_TURN = program("abc", "ab", "ac", "bc")
REAL = Program(
    ("a", "b"), (GroupTimes(29 * STEP_NS, 6 * STEP_NS, 46 * STEP_NS),) * 2, CROSSING.conflicts
)


def test_every_override_of_any_groups_keeps_its_meaning_at_a_crossing():
    served = prove_overrides(rings, *small_times(CROSSING))
    assert served.transitions > 1000
    assert max(served.worst_wait) < 12


@pytest.mark.parametrize("name", ["triangle", "one", "side", "chain"])
def test_every_override_of_a_group_keeps_its_meaning_at_a_shape(name):
    assert prove_overrides(rings, *small_times(SHAPES[name]), most=1).states > 100


SHOWN_BY = {"omit opens the barrier": (SIDE,)}  # the other proofs take seconds and do not show it
QUICK_FIRST = CROSSING, IN_TURN, SHAPES["one"], THREE, SIDE


def prove_all(module, shapes):
    for shape in shapes:
        prove_overrides(module, *small_times(shape), most=1)


@pytest.mark.parametrize("name", sorted(RINGS_WITH_INPUTS))
def test_a_mutant_of_the_rings_that_breaks_an_override_is_caught(name):
    mutant = mutant_of(rings, *RINGS_WITH_INPUTS[name])
    with pytest.raises(PlanError):
        prove_all(mutant, SHOWN_BY.get(name, QUICK_FIRST))


def test_junctions_of_one_shape_are_proven_once_and_very_large_ones_not_at_all():
    pairs = frozenset(combinations(range(3), 2))
    assert check_ring_shape(3, pairs) is check_ring_shape(3, pairs)
    assert check_ring_shape(8, frozenset()) is None


def test_a_hold_beside_leaves_the_other_ring_free_to_go_on():
    half = Junction(SHAPES["side"])
    half.run(20, calls={2})
    shown = half.run(60, calls={0, 1, 2, 3}, hold={2})
    assert {0, 1} <= set().union(*shown)
    assert not any(3 in green for green in shown)


def test_a_policy_that_serves_only_one_is_refused_with_the_others_name():
    lazy = Policy("a alone", nothing, lambda site, memory, view: (memory, Answer(frozenset("a"))))
    check_called_groups_are_served("lazy", lazy, REAL, frozenset("a"))
    with pytest.raises(PlanError, match=r"policy 'lazy': \['b'\] called and not green within"):
        check_called_groups_are_served("lazy", lazy, REAL, frozenset("ab"))


def test_a_timetable_whose_greens_never_come_is_refused_with_the_group():
    good = timetable("good", (Stage(("a",), 3 * 10**9), Stage(("b",), 3 * 10**9)), REAL)
    check_table(good, REAL)
    check_junction("x", REAL, [good])
    bad = Timetable("bad", good.timed_stages[:1], good.length_ns)
    with pytest.raises(
        PlanError, match=r"junction x: plan 'bad': \['b'\] not green in every cycle"
    ):
        check_junction("x", REAL, [bad])
