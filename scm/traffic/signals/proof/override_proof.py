"""Proof that overrides of people and vehicles take effect, and starve nobody once they end.

As `ring_proof.py`, but the rings get all possible inputs: any calls together with any hold, omit,
force-off, max 2, or pre-emption; one kind at a time, which may change at every step, so all
mixtures occur one after the other. In every reachable state:

    requested phases never conflict, and are never none while a phase that may begin is called
    a held green stays requested, an omitted phase does not begin, the pre-empted phase is
        requested, and no phase begins without a call
    a called phase is served within a bound, while it is not omitted, no phase in its way is held,
        and no other phase pre-empts; so it is served once earlier overrides end
"""

from collections.abc import Iterable
from functools import cache
from itertools import chain, combinations

from scm.errors import PlanError
from scm.traffic.signals import kernel, rings
from scm.traffic.signals.kernel import Program, State
from scm.traffic.signals.proof.ring_proof import (
    Explored,
    Node,
    RingLogic,
    Served,
    explore,
    longest_wait,
    small_times,
)
from scm.traffic.signals.rings import Inputs, Layout, PhaseTimes, green_in

MANY_GROUPS = 5
Numbers = frozenset[int]


def prove_overrides(
    logic: RingLogic, program: Program, phases: tuple[PhaseTimes, ...], *, most: int = 99
) -> Served:
    """Walk through everything.

    Args:
        logic: The rings.
        program: Of the junction, its times in steps.
        phases: How each is run, in steps; without recall or locking.
        most: Groups that one override names at most, and that call at a time, but for all at once.

    Raises:
        PlanError: saying which override has no effect, or who waits for ever.
    """
    layout = logic.layout_of(program, phases)
    letters = _letters(program, most)

    @cache
    def show(state: State, requested: Numbers) -> State:
        return kernel.step(program, state, {program.groups[i] for i in requested}, 1)

    def follow(node: Node, inputs: Inputs) -> Node:
        state, before = node
        then = logic.step(layout, before, inputs, green_in(state), 1)
        requested = logic.requested(then)
        _check_meaning(program, node, inputs, requested)
        return show(state, requested), then

    explored = explore((logic, program, layout), letters, follow)
    return _all_served(explored, letters, program, layout)


@cache
def check_ring_shape(groups: int, conflicts: frozenset[tuple[int, int]]) -> Served | None:
    """Prove the rings of a junction, given by its conflicts alone, with short times.

    Each override names one group, and nobody, one, or all call. None: so many groups take too long.

    Raises:
        PlanError: saying which override has no effect, or who waits for ever.
    """
    if groups > MANY_GROUPS:
        return None
    names = tuple(str(number) for number in range(groups))
    named = frozenset(frozenset((names[i], names[j])) for i, j in conflicts)
    return prove_overrides(rings, *small_times(Program(names, (), named)), most=1)


def check_rings(junction: str, program: Program) -> None:
    """Prove the rings of a junction; those that look alike are proven once.

    Raises:
        PlanError: naming the junction, and what is wrong.
    """
    number = {name: at for at, name in enumerate(program.groups)}
    pairs = (sorted(number[name] for name in pair) for pair in program.conflicts)
    try:
        check_ring_shape(len(number), frozenset((pair[0], pair[1]) for pair in pairs))
    except PlanError as wrong:
        raise PlanError(f"junction {junction}: rings of {program.groups}: {wrong}") from wrong


def _sets(everyone: Iterable[int], least: int, most: int) -> list[Numbers]:
    numbers = sorted(everyone)
    sizes = range(least, min(most, len(numbers)) + 1)
    return [frozenset(c) for c in chain(*(combinations(numbers, n) for n in sizes))]


def _letters(program: Program, most: int) -> list[Inputs]:
    """Return all inputs that the rings may get at one step; nobody holds two that conflict."""
    everyone = range(len(program.groups))
    some = _sets(everyone, 1, most)
    holds = [held for held in some if not any(_clash(program, i, j) for i in held for j in held)]
    omits = [left for left in some if len(left) < len(everyone)]
    requested = [
        Inputs(),
        Inputs(max2=frozenset(everyone)),
        *(Inputs(hold=held) for held in holds),
        *(Inputs(omit=left) for left in omits),
        *(Inputs(force_off=forced) for forced in some),
        *(Inputs(preempt=phase) for phase in everyone),
    ]
    calls = dict.fromkeys([*_sets(everyone, 0, most), frozenset(everyone)])
    return [each._replace(calls=called) for called in calls for each in requested]


def _clash(program: Program, one: int, other: int) -> bool:
    return frozenset((program.groups[one], program.groups[other])) in program.conflicts


def _check_meaning(program: Program, before: Node, inputs: Inputs, requested: Numbers) -> None:
    """Refuse overrides without effect.

    Raises:
        PlanError: saying which.
    """
    green = green_in(before[0])
    was_requested = rings.requested(before[1])
    clash = next(
        ((i, j) for i, j in combinations(sorted(requested), 2) if _clash(program, i, j)), ()
    )
    if clash:
        wrong, problem = set(clash), "and another in conflict are wished for at once"
    elif inputs.preempt is not None and inputs.preempt not in requested:
        wrong, problem = {inputs.preempt}, "pre-empts and is not wished for"
    elif inputs.calls - inputs.omit and not requested:
        wrong, problem = set(inputs.calls - inputs.omit), "is called, and nobody is wished for"
    elif inputs.preempt is None and inputs.hold & green & was_requested - requested:
        wrong, problem = set(inputs.hold - requested), "is held and no longer wished for"
    elif inputs.preempt is None and inputs.omit & requested - green:
        wrong, problem = set(inputs.omit & requested - green), "is omitted and wished for"
    else:
        called = inputs.calls | was_requested | {inputs.preempt}
        wrong, problem = set(requested - called), "is wished for, and nobody called it"
    if wrong:
        raise PlanError(f"unsafe: group {program.groups[min(wrong)]!r} {problem}")


def _all_served(
    explored: Explored, letters: list[Inputs], program: Program, layout: Layout
) -> Served:
    worst = []
    for phase in range(len(program.groups)):
        waiting = [
            number
            for number, inputs in enumerate(letters)
            if phase in inputs.calls
            and phase not in inputs.omit
            and inputs.preempt in (None, phase)
            and not inputs.hold & _in_the_way(program, layout, phase)
        ]
        worst.append(longest_wait(explored, phase, waiting, program))
    return Served(len(explored.nodes), len(explored.nodes) * len(letters), tuple(worst))


def _in_the_way(program: Program, layout: Layout, phase: int) -> Numbers:
    """Return the phases that keep this one waiting while held."""
    here = next(s for s in layout.sections if any(phase in sequence for sequence in s))
    beside = {i for sequence in here for i in sequence if not _clash(program, i, phase)}
    return frozenset(range(len(program.groups))) - beside - {phase}
