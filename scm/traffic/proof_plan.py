"""Proof by exhaustion that a plan does at a junction what it says, whenever its steps come.

Two searches. First `scm.traffic.proof`: every state of the kernel that any wishes can reach is
safe, and from each of them, when nobody wishes anything, all come to red and clear, which is where
a cycle begins. Then the plan over the kernel: from the begin of its cycle through every pair of
kernel state and place in the cycle, with steps of one or two tenths of a second in any order, as a
busy computer makes them. The observer of the first search looks on, and:

    whenever a stage's green is wished, all its groups are green at that very step
    every group is green in every stage that names it, in every cycle
"""

from typing import NamedTuple

from scm.errors import PlanError
from scm.traffic.kernel import Phase, Program, State
from scm.traffic.plan import Timetable
from scm.traffic.program import STEP_NS
from scm.traffic.proof import Kernel, Memory, first_memory, in_steps, prove, watch

LATEST = 2
"""Tenths of a second that a step may take: what a timetable leaves room for at each change."""

MOST_NODES = 3_000_000


class Proven(NamedTuple):
    """What was walked through without finding fault.

    Attributes:
        states, transitions: Of the kernel, under any wishes.
        plan_states, plan_transitions: Of the kernel under this plan.
    """

    states: int
    transitions: int
    plan_states: int
    plan_transitions: int


class _Node(NamedTuple):
    """A place in the cycle [steps], what the kernel does there, what was seen of it."""

    at: int
    state: State
    memory: Memory


def prove_plan(kernel: Kernel, program: Program, table: Timetable) -> Proven:
    """Walk through everything.

    Args:
        kernel: `scm.traffic.kernel`, or a mutant of it.
        program: Of the junction, in nanoseconds.
        table: Of the plan.

    Raises:
        PlanError: saying what is unsafe, or what the plan says and the junction does not do.
    """
    small = in_steps(program, STEP_NS)
    walked = prove(kernel, small)
    cleared = _all_come_to_rest(kernel, small, walked.states)
    for slot in table.slots:
        if slot.end_ns - slot.start_ns < LATEST * STEP_NS:
            where = f"plan {table.plan!r}: stage {sorted(slot.groups)}"
            least_s = LATEST * STEP_NS / 1e9
            raise PlanError(f"{where}: too short for late steps, expected {least_s:g} s at least")
    nodes, transitions = _walk(kernel, small, table, cleared)
    return Proven(len(walked.states), walked.transitions, nodes, transitions)


def _all_come_to_rest(kernel: Kernel, program: Program, states: frozenset[State]) -> State:
    """Return the state that all others end in when nobody wishes anything."""
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
    length = table.length_ns // STEP_NS
    memory = first_memory(cleared)
    for _ in range(max(times.clearance for times in program.times)):
        memory = watch(program, memory, cleared, (), 1)
    first = _Node(length - 1, cleared, memory)
    todo, seen, transitions = [first], {first}, 0
    while todo:
        node = todo.pop()
        for dt in range(1, LATEST + 1):
            at = (node.at + dt) % length
            wishes = table.wishes(at * STEP_NS)
            state = kernel.step(program, node.state, wishes, dt)
            after = _Node(at, state, watch(program, node.memory, state, wishes, dt))
            _check_stage(program, table, after)
            transitions += 1
            if after not in seen:
                seen.add(after)
                todo.append(after)
        if len(seen) > MOST_NODES:
            msg = f"plan {table.plan!r}: more than {MOST_NODES} states: too many to prove"
            raise PlanError(f"{msg}; expected fewer stages or a shorter cycle")
    return len(seen), transitions


def _check_stage(program: Program, table: Timetable, node: _Node) -> None:
    """Refuse a wished group that is not green."""
    wished = table.wishes(node.at * STEP_NS)
    for name, group in zip(program.groups, node.state, strict=True):
        if name in wished and group.phase is not Phase.GREEN:
            at_s = node.at * STEP_NS / 1e9
            msg = f"group {name!r} is {group.phase.value} at {at_s:g} s, where its green should be"
            raise PlanError(f"plan {table.plan!r}: {msg}")
