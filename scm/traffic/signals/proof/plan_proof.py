"""Proof by exhaustion that a plan does what it says at a junction, whatever its step times are.

Two searches. First `kernel_proof.py`: every state of the kernel that any requests can reach is
safe, and without requests all of them end in red and clear, where a cycle begins. Then the plan
over the kernel: from the start of its cycle through every pair of kernel state and cycle position,
with steps of one or two tenths of a second in any order, as on a busy computer. The observer of the
first search checks every step, and:

    whenever a green is requested, the group is green at that very step; between two stages that
    both name a group it is requested, so it stays green
    a cycle begins with any groups of its first stage already green, and ends with any of its last
    one still green, as the plans before and after it may want; all others are red and clear

So a cycle ends as any other may begin: plans that are proven alone may follow one another.
"""

from collections.abc import Collection, Iterator
from itertools import chain, combinations
from typing import NamedTuple

from scm.errors import PlanError
from scm.traffic.signals.kernel import Phase, Program, State
from scm.traffic.signals.plan import Timetable
from scm.traffic.signals.program import STEP_NS
from scm.traffic.signals.proof.kernel_proof import (
    Kernel,
    Memory,
    first_memory,
    in_steps,
    prove,
    watch,
)

MAX_STEP_TENTHS = 2  # what a timetable leaves room for at each change

MAX_NODES = 3_000_000  # more would take too long and too much memory


class Proven(NamedTuple):
    """What was walked through without finding fault.

    Attributes:
        states, transitions: Of the kernel, under any requests.
        plan_states, plan_transitions: Of the kernel under this plan.
    """

    states: int
    transitions: int
    plan_states: int
    plan_transitions: int


class _Node(NamedTuple):
    """A place in the cycle [steps], what the kernel does there, what was seen of it.

    Attributes:
        going_on: Once the last stage is over: who stays green into the next cycle.
    """

    at: int
    state: State
    memory: Memory
    going_on: frozenset[str]


def prove_plan(kernel: Kernel, program: Program, table: Timetable) -> Proven:
    """Walk through everything.

    Args:
        kernel: `scm.traffic.signals.kernel`, or a mutant of it.
        program: Of the junction, in nanoseconds.
        table: Of the plan.

    Raises:
        PlanError: saying what is unsafe, or what the plan says and the junction does not do.
    """
    small = in_steps(program, STEP_NS)
    walked = prove(kernel, small)
    cleared = _all_come_to_rest(kernel, small, walked.states)
    for stage in table.timed_stages:
        if stage.end_ns - stage.start_ns < MAX_STEP_TENTHS * STEP_NS:
            where = f"plan {table.plan!r}: stage {sorted(stage.groups)}"
            least_s = MAX_STEP_TENTHS * STEP_NS / 1e9
            raise PlanError(f"{where}: too short for late steps, expected {least_s:g} s at least")
    nodes, transitions = _walk(kernel, small, table, cleared)
    return Proven(len(walked.states), walked.transitions, nodes, transitions)


def _all_come_to_rest(kernel: Kernel, program: Program, states: frozenset[State]) -> State:
    """Return the state that all others end in without requests."""
    longest = max(sum(times) for times in program.times) + 2
    passed, ends = set[State](), set[State]()
    for begun in states:
        state, way = begun, set[State]()
        while state not in passed and state not in way and len(way) <= longest:
            way.add(state)
            state = kernel.step(program, state, (), 1)
        if state not in passed:
            ends.add(state)
        passed |= way
    if len(ends) != 1 or any(group.phase is not Phase.RED for group in next(iter(ends))):
        raise PlanError("unsafe: not all come to red when nobody wishes anything")
    return ends.pop()


def _walk(kernel: Kernel, program: Program, table: Timetable, cleared: State) -> tuple[int, int]:
    first, last = table.timed_stages[0].groups, table.timed_stages[-1].groups
    rests = {
        green: _resting(kernel, program, cleared, green)
        for green in {*_some_of(first), *_some_of(last)}
    }
    begin = table.length_ns // STEP_NS - MAX_STEP_TENTHS
    todo = [_Node(begin, *rests[green], green) for green in _some_of(first)]
    seen, transitions = set(todo), 0
    while todo:
        node = todo.pop()
        for dt, at, going_on in _onward(table, node):
            if at < node.at:
                _check_end(kernel, program, table, node, dt, rests[node.going_on])
                if not node.going_on <= first:
                    continue  # a cycle of another plan follows
            requested = table.requested(at * STEP_NS, going_on)
            state = kernel.step(program, node.state, requested, dt)
            after = _Node(at, state, watch(program, node.memory, state, requested, dt), going_on)
            _check_green(program, table, after, requested)
            transitions += 1
            if after not in seen:
                seen.add(after)
                todo.append(after)
        if len(seen) > MAX_NODES:
            msg = f"plan {table.plan!r}: more than {MAX_NODES} states: too many to prove"
            raise PlanError(f"{msg}; expected fewer stages or a shorter cycle")
    return len(seen), transitions


def _some_of(groups: Collection[str]) -> Iterator[frozenset[str]]:
    """Return all sets of some, all or none of these groups."""
    names = sorted(groups)
    sets = chain.from_iterable(combinations(names, n) for n in range(len(names) + 1))
    return map(frozenset, sets)


def _resting(
    kernel: Kernel, program: Program, cleared: State, green: frozenset[str]
) -> tuple[State, Memory]:
    """Return what a cycle begins with, and what was seen of it: some green, all others clear."""
    longest = max(max(times) for times in program.times) + 1
    state, memory = cleared, first_memory(cleared)
    for requested in (frozenset[str](), green):
        for _ in range(longest):
            state = kernel.step(program, state, requested, 1)
            memory = watch(program, memory, state, requested, 1)
    return state, memory


def _onward(table: Timetable, node: _Node) -> Iterator[tuple[int, int, frozenset[str]]]:
    """Yield each next step: how long it takes, where it leads to, and who goes on from there."""
    length, last = table.length_ns // STEP_NS, table.timed_stages[-1]
    for dt in range(1, MAX_STEP_TENTHS + 1):
        at = node.at + dt
        if at >= length:
            yield dt, at - length, frozenset()
        elif node.at * STEP_NS < last.end_ns <= at * STEP_NS:
            for going_on in _some_of(last.groups):
                yield dt, at, going_on
        else:
            yield dt, at, node.going_on


def _check_end(
    kernel: Kernel,
    program: Program,
    table: Timetable,
    node: _Node,
    dt: int,
    rest: tuple[State, Memory],
) -> None:
    """Refuse a cycle at whose end somebody is not as the next one may find it."""
    state = kernel.step(program, node.state, node.going_on, dt)
    if (state, watch(program, node.memory, state, node.going_on, dt)) != rest:
        msg = f"plan {table.plan!r}: its cycle ends before all who went last are clear"
        raise PlanError(msg)


def _check_green(
    program: Program, table: Timetable, node: _Node, requested: frozenset[str]
) -> None:
    """Refuse a requested group that is not green."""
    for name, group in zip(program.groups, node.state, strict=True):
        if name in requested and group.phase is not Phase.GREEN:
            at_s = node.at * STEP_NS / 1e9
            msg = f"group {name!r} is {group.phase.value} at {at_s:g} s, where its green should be"
            raise PlanError(f"plan {table.plan!r}: {msg}")
