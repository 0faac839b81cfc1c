"""Rings serve everybody within a bound, whatever comes; their vocabulary means what it says."""

from itertools import combinations

import pytest

from scm.errors import PlanError
from scm.maps.load import load_map
from scm.maps.route import Roads
from scm.traffic.signals import kernel, rings
from scm.traffic.signals.kernel import GroupTimes, Program
from scm.traffic.signals.program import program_of
from scm.traffic.signals.proof.ring_proof import after, prove_service, small_times
from scm.traffic.signals.rings import Inputs, PhaseTimes, Recall, green_in, layout_of
from tests.unit.traffic.signals.mutants import RINGS, mutant_of


def pairs(*names):
    return frozenset(frozenset(pair) for pair in names)


def program(names, *conflicts):
    return Program(tuple(names), (GroupTimes(2, 1, 2),) * len(names), pairs(*conflicts))


def dual_ring():
    halves = (("12", "56"), ("34", "78"))
    together = {(one, other) for ring1, ring2 in halves for one in ring1 for other in ring2}
    return program(
        "12345678", *(pair for pair in combinations("12345678", 2) if pair not in together)
    )


CROSSING = program("ab", "ab")
TRIANGLE = program("abc", "ab", "bc")
HALF = program("1256", "12", "56")
CHAIN = program("abcd", "ab", "bc", "cd")
BARRIER = program("abc", "ab", "ac")
SIDE = program("abcd", "ab", "da", "db", "dc")
THREE = program("abcde", "ac", "ad", "bc", "bd", "ea", "eb", "ec", "ed")
SHAPES = {
    "crossing": CROSSING,
    "triangle": TRIANGLE,
    "half": HALF,
    "chain": CHAIN,
    "one": BARRIER,
    "side": SIDE,
    "three": THREE,
}


def phases_of(shape, **changed):
    phases = small_times(shape)[1]
    return tuple(phase._replace(**changed) for phase in phases)


def test_a_textbook_crossing_becomes_two_rings_and_a_barrier():
    layout = layout_of(dual_ring(), (PhaseTimes(2, 1, 3, 4),) * 8)
    assert layout.sections == (((0, 1), (4, 5)), ((2, 3), (6, 7)))


def test_approaches_that_all_conflict_become_one_ring():
    four = program("abcd", *combinations("abcd", 2))
    assert layout_of(four, phases_of(four)).sections == (((0, 1, 2, 3),),)


def test_conflicts_that_are_no_rings_are_cut_into_stages():
    assert layout_of(CHAIN, phases_of(CHAIN)).sections == (((0,), (2,)), ((1,), (3,)))


@pytest.mark.parametrize("name", SHAPES)
def test_each_call_is_served_within_a_bound_however_others_call(name):
    small, phases = small_times(SHAPES[name])
    served = prove_service(rings, small, phases)
    assert served.states > 20
    total = sum(sum(times) + phase.max2 for times, phase in zip(small.times, phases, strict=True))
    assert all(0 < wait <= 2 * total for wait in served.worst_wait)


@pytest.mark.parametrize("map_name", ["driving_school", "grid:3x3"])
def test_each_call_at_each_shape_of_a_shipped_junction_is_served(map_name):
    city_map = load_map(map_name)
    roads = Roads(city_map)
    shapes = {
        (len(p.groups), p.conflicts) for p in (program_of(j, roads) for j in city_map.junctions)
    }
    for junction in city_map.junctions:
        shape = program_of(junction, roads)
        if (len(shape.groups), shape.conflicts) in shapes:
            shapes.discard((len(shape.groups), shape.conflicts))
            assert prove_service(rings, *small_times(shape)).worst_wait


def test_a_bound_that_is_too_tight_is_refused_with_the_group():
    with pytest.raises(PlanError, match=r"group '.' may wait \d+ steps, expected at most 3"):
        prove_service(rings, *small_times(CROSSING), bound=3)


WORST = {
    "crossing": (6, 7),
    "triangle": (6, 9, 7),
    "half": (6, 7, 6, 7),
    "chain": (7, 11, 9, 9),
    "one": (8, 8, 8),
    "side": (13, 13, 8, 14),
    "three": (15, 16, 16, 15, 16),
}


def prove_all(module):
    """Prove service at all shapes, and that the worst waits are those that are known."""
    for name, shape in SHAPES.items():
        served = prove_service(module, *small_times(shape))
        if served.worst_wait != WORST[name]:
            raise PlanError(f"unsafe: {name}: worst waits {served.worst_wait}, not {WORST[name]}")


def test_the_source_without_mutation_passes():
    prove_all(rings)


@pytest.mark.parametrize("name", sorted(RINGS))
def test_a_mutant_of_the_rings_is_caught(name):
    with pytest.raises((PlanError, StopIteration)):
        prove_all(mutant_of(rings, *RINGS[name]))


class Junction:
    """Rings over the kernel, to be stepped by hand."""

    def __init__(self, shape, phases=None):
        self.program = shape
        self.layout = layout_of(shape, phases or phases_of(shape))
        self.node = (kernel.start(shape), rings.start(self.layout))

    def run(self, steps=1, **inputs):
        inputs = Inputs(**{k: frozenset(v) if isinstance(v, set) else v for k, v in inputs.items()})
        shown = []
        for _ in range(steps):
            self.node = after(rings, self.program, self.layout, self.node, inputs)
            shown.append(green_in(self.node[0]))
        return shown


def test_it_rests_in_green_while_nobody_else_calls():
    junction = Junction(CROSSING)
    assert junction.run(10, calls={0})[-1] == {0}
    assert set(junction.run(30)) == {frozenset({0})}


def test_a_green_gaps_out_when_its_vehicles_are_gone_and_maxes_out_when_not():
    phases = (PhaseTimes(2, 3, 20, 30),) * 2
    gone, busy, long = (Junction(CROSSING, phases) for _ in range(3))
    for junction in (gone, busy, long):
        junction.run(10, calls={0})
    gaps = gone.run(40, calls={1}).index(frozenset())
    maxed = busy.run(40, calls={0, 1}).index(frozenset())
    longer = long.run(60, calls={0, 1}, max2={0}).index(frozenset())
    assert (gaps, maxed, longer) == (2, 19, 29)


def test_a_hold_keeps_a_green_and_a_force_off_ends_it_after_its_least_time():
    phases = (PhaseTimes(4, 1, 20, 30),) * 2
    junction = Junction(CROSSING, phases)
    junction.run(10, calls={0})
    assert set(junction.run(60, calls={0, 1}, hold={0})) == {frozenset({0})}
    forced = Junction(CROSSING, phases)
    forced.run(5, calls={0})
    assert forced.run(8, calls={0, 1}, force_off={0}).index(frozenset()) <= 5


def test_an_omitted_phase_is_not_begun():
    junction = Junction(CROSSING)
    assert not any(1 in green for green in junction.run(60, calls={0, 1}, omit={1}))
    assert any(1 in green for green in junction.run(20, calls={0, 1}))


def test_a_phase_whose_turn_is_omitted_before_it_began_is_passed_over():
    junction = Junction(CROSSING)
    junction.run(1, calls={1})
    assert not any(1 in green for green in junction.run(20, omit={1}))


def test_recalls_call_without_a_vehicle():
    for recall in (Recall.MIN, Recall.MAX, Recall.SOFT):
        phases = (PhaseTimes(2, 1, 6, 8, recall=recall), PhaseTimes(2, 1, 6, 8))
        assert {0} in Junction(CROSSING, phases).run(10)


def test_max_recall_stays_for_all_of_max_and_min_recall_for_the_least_green():
    def green_for(recall):
        phases = (PhaseTimes(2, 1, 9, 12, recall=recall), PhaseTimes(2, 1, 9, 12))
        shown = Junction(CROSSING, phases).run(40, calls={1})
        first = shown.index({0})
        return next(n for n, green in enumerate(shown[first:]) if 0 not in green)

    assert green_for(Recall.MAX) == 9
    assert green_for(Recall.MIN) == 2


def test_soft_recall_waits_until_nobody_calls():
    phases = (PhaseTimes(2, 1, 6, 8, recall=Recall.SOFT), PhaseTimes(2, 1, 6, 8))
    junction = Junction(CROSSING, phases)
    assert not any(0 in green for green in junction.run(20, calls={1}))
    assert {0} in junction.run(30)


def test_a_locked_call_is_kept_although_the_car_has_gone():
    locking = (PhaseTimes(2, 1, 6, 8, locking=True),) * 2
    for phases, current in ((locking, True), (phases_of(CROSSING), False)):
        junction = Junction(CROSSING, phases)
        junction.run(8, calls={0})
        junction.run(1, calls={0, 1}, hold={0})
        assert any(1 in green for green in junction.run(20)) is current


def test_a_preempted_phase_comes_next_out_of_order_and_stays():
    four = program("abcd", *combinations("abcd", 2))
    junction = Junction(four)
    junction.run(7, calls={0, 1, 2, 3})
    shown = junction.run(30, calls={0, 1, 2, 3}, preempt=3)
    assert {green for green in shown if green} <= {frozenset({0}), frozenset({3})}
    assert shown[-1] == {3}
    assert {0} in junction.run(30, calls={0, 1, 2, 3})


def test_two_rings_cross_the_barrier_together():
    junction = Junction(dual_ring(), (PhaseTimes(2, 1, 6, 8),) * 8)
    shown = junction.run(80, calls=set(range(8)))
    sides = [bool(green & {0, 1, 4, 5}) - bool(green & {2, 3, 6, 7}) for green in shown if green]
    assert {1, -1} == set(sides)
    assert set().union(*shown) == set(range(8))
