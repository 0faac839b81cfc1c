"""Proof by exhaustion that rings over the kernel serve everybody, however vehicles come.

The search walks through every state that rings and kernel can reach together under every set of
calls. Then, for each phase: a call for it stays, all others come and go as unkindly as they can.
Among the states in which it still waits there must be no way round in a circle; the longest way
through them is the worst wait. That every green is safe is the kernel's own proof, which holds for
any requests; here it is only checked that the rings' requests do not conflict.
"""

from collections.abc import Callable
from itertools import chain, combinations
from typing import NamedTuple, Protocol

from scm.errors import PlanError
from scm.traffic.signals import kernel
from scm.traffic.signals.kernel import GroupTimes, Phase, Program, State
from scm.traffic.signals.rings import Inputs, Layout, PhaseTimes, Rings, green_in

MAX_STATES = 20_000  # more would take too long where a junction is loaded


class RingLogic(Protocol):
    """What is proven: `scm.traffic.signals.rings`, or a mutant of it."""

    def layout_of(self, program: Program, phases: tuple[PhaseTimes, ...]) -> Layout:
        """See `scm.traffic.signals.rings.layout_of`."""
        ...

    def start(self, layout: Layout) -> Rings:
        """See `scm.traffic.signals.rings.start`."""
        ...

    def requested(self, state: Rings) -> frozenset[int]:
        """See `scm.traffic.signals.rings.requested`."""
        ...

    def step(
        self, layout: Layout, state: Rings, inputs: Inputs, green: frozenset[int], dt: int
    ) -> Rings:
        """See `scm.traffic.signals.rings.step`."""
        ...


class Served(NamedTuple):
    """What a search found: how much it saw, and each phase's worst wait in steps."""

    states: int
    transitions: int
    worst_wait: tuple[int, ...]


Node = tuple[State, Rings]


class Explored(NamedTuple):
    """All that can be reached: its nodes, and what follows each for each of the inputs."""

    nodes: list[Node]
    ways: list[tuple[int, ...]]


def small_times(program: Program) -> tuple[Program, tuple[PhaseTimes, ...]]:
    """Return a junction of the same conflicts whose times are so short that all can be searched."""
    groups = len(program.groups)
    times = (GroupTimes(2, 1, 2), GroupTimes(1, 1, 1), GroupTimes(2, 1, 1), GroupTimes(1, 1, 2))
    least = tuple(times[i % 4] for i in range(groups))
    phases = tuple(PhaseTimes(t.min_green, 1, t.min_green + 1, t.min_green + 2) for t in least)
    return program._replace(times=least), phases


def prove_service(
    logic: RingLogic, program: Program, phases: tuple[PhaseTimes, ...], bound: int | None = None
) -> Served:
    """Walk through everything.

    Args:
        logic: The rings.
        program: Of the junction, its times in steps.
        phases: How each is run, in steps.
        bound: The longest wait allowed in steps; None: any, as long as it ends.

    Raises:
        PlanError: saying who conflicts, or waits for ever or too long.
    """
    layout = logic.layout_of(program, phases)
    everyone = frozenset(range(len(program.groups)))
    sets = [frozenset(c) for c in chain(*(combinations(everyone, n) for n in range(9)))]

    def follow(node: Node, inputs: Inputs) -> Node:
        return after(logic, program, layout, node, inputs)

    explored = explore((logic, program, layout), [Inputs(calls=calls) for calls in sets], follow)
    worst = []
    for phase in sorted(everyone):
        waiting = [number for number, inputs in enumerate(sets) if phase in inputs]
        worst.append(longest_wait(explored, phase, waiting, program))
    if bound is not None and max(worst) > bound:
        late = program.groups[worst.index(max(worst))]
        msg = f"unsafe: group {late!r} may wait {max(worst)} steps, expected at most {bound}"
        raise PlanError(msg)
    return Served(len(explored.nodes), len(explored.nodes) * len(sets), tuple(worst))


def after(
    logic: RingLogic, program: Program, layout: Layout, node: Node, inputs: Inputs, dt: int = 1
) -> Node:
    """Return kernel and rings a step later.

    Raises:
        PlanError: when the rings wish for two groups that conflict.
    """
    state, rings = node
    rings = logic.step(layout, rings, inputs, green_in(state), dt)
    requested = [program.groups[i] for i in logic.requested(rings)]
    clash = next((p for p in combinations(requested, 2) if frozenset(p) in program.conflicts), None)
    if clash:
        msg = f"unsafe: the rings wish for {clash[0]!r} and {clash[1]!r} at once"
        raise PlanError(msg)
    return kernel.step(program, state, requested, dt), rings


def explore(
    of: tuple[RingLogic, Program, Layout],
    letters: list[Inputs],
    follow: Callable[[Node, Inputs], Node],
) -> Explored:
    """Return what follows each state that can be reached, for each of the inputs.

    Raises:
        PlanError: when there are more than `MAX_STATES`.
    """
    logic, program, layout = of
    nodes = [(kernel.start(program), logic.start(layout))]
    number = {nodes[0]: 0}
    ways: list[tuple[int, ...]] = []
    for node in nodes:  # grows while it is walked through
        following = []
        for inputs in letters:
            then = follow(node, inputs)
            if then not in number:
                number[then] = len(nodes)
                nodes.append(then)
            following.append(number[then])
        ways.append(tuple(following))
        if len(nodes) > MAX_STATES:
            raise PlanError(f"unsafe: more than {MAX_STATES} states, so nothing is proven")
    return Explored(nodes, ways)


def longest_wait(explored: Explored, phase: int, waiting: list[int], program: Program) -> int:
    """Return the longest way through states in which a phase is called and not green.

    Raises:
        PlanError: when there is a circle: it may wait for ever.
    """
    is_red = [node[0][phase].phase is not Phase.GREEN for node in explored.nodes]
    hungry = [
        {n for k in waiting if is_red[n := following[k]]} if red else set()
        for following, red in zip(explored.ways, is_red, strict=True)
    ]
    known: dict[int, int | None] = {}  # None: we are on the way through it
    for first in range(len(hungry)):
        stack = [] if first in known else [(first, iter(hungry[first]))]
        known.setdefault(first, None)
        while stack:
            node, rest = stack[-1]
            following = next(rest, None)
            if following is None:
                stack.pop()
                known[node] = 1 + max((known[n] or 0 for n in hungry[node]), default=0)
            elif following not in known:
                known[following] = None
                stack.append((following, iter(hungry[following])))
            elif known[following] is None:
                raise PlanError(f"unsafe: group {program.groups[phase]!r} may wait for ever")
    return max(length or 0 for length in known.values()) - 1
