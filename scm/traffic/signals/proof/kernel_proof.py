"""Proof by exhaustion that a kernel is safe for a program: every reachable state, every request.

An observer sees what people see, colours and time, and keeps a small memory of its own. The search
walks the product of kernel and observer until it finds nothing new. Unsafe is: a green, yellow or
all-red shorter than its least time, a colour that may not follow the last one, a start against a
group in conflict that still goes or clears, or a green that was not requested. At last, from every
state, a group that alone is requested must get its green.
"""

import math
from collections.abc import Collection, Sequence
from functools import cache
from itertools import chain, combinations
from typing import NamedTuple, Protocol

from scm.errors import PlanError
from scm.traffic.signals.kernel import GroupTimes, Phase, Program, State


class Kernel(Protocol):
    """What is proven: `scm.traffic.signals.kernel`, or a mutant of it."""

    def start(self, program: Program) -> State:
        """See `scm.traffic.signals.kernel.start`."""
        ...

    def step(
        self,
        program: Program,
        state: State,
        requested: Collection[str],
        dt: int,
        *,
        flash: bool = False,
    ) -> State:
        """See `scm.traffic.signals.kernel.step`."""
        ...


class Walked(NamedTuple):
    """What a search went through without finding fault."""

    states: frozenset[State]
    transitions: int


class _Seen(NamedTuple):
    """Memory of one group: its colour, for how long, and since when nobody goes."""

    colour: str
    age: int
    quiet: int


Memory = tuple[_Seen, ...]

_COLOUR = {
    Phase.RED.name: "red",
    Phase.CLEARANCE.name: "red",
    Phase.GREEN.name: "green",
    Phase.YELLOW.name: "yellow",
    Phase.FLASH.name: "flash",
}
_GOING = ("green", "yellow", "flash")
_MAY_FOLLOW = {
    "red": ("red", "green", "flash"),
    "green": ("green", "yellow", "flash"),
    "yellow": ("yellow", "red", "flash"),
    "flash": ("flash", "red"),
}


def in_steps(program: Program, step: int) -> Program:
    """Return a program with its times in whole steps, rounded up."""
    times = tuple(GroupTimes(*(math.ceil(t / step) for t in group)) for group in program.times)
    return program._replace(times=times)


def prove(kernel: Kernel, program: Program, dts: Sequence[int] = (1,)) -> Walked:
    """Walk through everything, with steps of all lengths of `dts`.

    Raises:
        PlanError: saying what is unsafe.
    """
    walked = _walk(kernel, program, dts)
    for index in range(len(program.groups)):
        _must_serve(kernel, program, walked.states, index)
    return walked


def _walk(kernel: Kernel, program: Program, dts: Sequence[int]) -> Walked:
    first = kernel.start(program)
    todo: list[tuple[State, Memory]] = [(first, first_memory(first))]
    seen, transitions = set(todo), 0
    sizes = range(len(program.groups) + 1)
    subsets = [frozenset(w) for w in chain(*(combinations(program.groups, n) for n in sizes))]
    moves = [(requested, dt, False) for requested in subsets for dt in dts]
    moves.append((frozenset(), dts[0], True))
    while todo:
        state, memory = todo.pop()
        for requested, dt, flash in moves:
            after = kernel.step(program, state, requested, dt, flash=flash)
            node = after, watch(program, memory, after, requested, dt)
            if flash and any(seen.colour != "flash" for seen in node[1]):
                raise PlanError("unsafe: flash is asked for and not shown")
            transitions += 1
            if node not in seen:
                seen.add(node)
                todo.append(node)
    return Walked(frozenset(state for state, _ in seen), transitions)


def first_memory(state: State) -> Memory:
    """Return what an observer knows who sees a junction for the first time."""
    return tuple(_Seen(_of(group), 0, 0) for group in state)


def _of(group: tuple[Phase, int]) -> str:
    return _shown(group[0])


@cache
def _shown(phase: Phase) -> str:
    return _COLOUR[phase.name]


def watch(
    program: Program, memory: Memory, state: State, requested: Collection[str], dt: int
) -> Memory:
    """Return the observer's memory after a step that it finds no fault with."""
    after = [_look(before, _of(group), dt) for before, group in zip(memory, state, strict=True)]
    for index, before in enumerate(memory):
        if after[index].colour != before.colour:
            _judge(program, index, before, after, requested, before.age + dt)
    return tuple(map(_forget, after, program.times))


@cache
def _look(before: _Seen, colour: str, dt: int) -> _Seen:
    return _Seen(
        colour,
        before.age + dt if colour == before.colour else 0,
        0 if before.colour in _GOING else before.quiet + dt,
    )


@cache
def _forget(seen: _Seen, times: GroupTimes) -> _Seen:
    """Count no further than any rule needs: that keeps the search finite."""
    if seen.colour in _GOING:
        return _Seen(seen.colour, min(seen.age, max(times.min_green, times.yellow)), 0)
    return _Seen(seen.colour, 0, min(seen.quiet, times.clearance))


def _judge(
    program: Program,
    index: int,
    before: _Seen,
    after: Sequence[_Seen],
    requested: Collection[str],
    shown: int,
) -> None:
    name, times, colour = program.groups[index], program.times[index], after[index].colour
    wrong = ""
    match before.colour, colour:
        case ("green", "yellow") if shown < times.min_green:
            wrong = f"green for {shown}"
        case ("yellow", "red") if shown < times.yellow:
            wrong = f"yellow for {shown}"
        case ("red", "green"):
            wrong = _wrong_start(program, name, after) if name in requested else "green unwished"
        case _ if colour not in _MAY_FOLLOW[before.colour]:
            wrong = f"{colour} after {before.colour}"
    if wrong:
        raise PlanError(f"unsafe: group {name!r}: {wrong}")


def _wrong_start(program: Program, name: str, after: Sequence[_Seen]) -> str:
    for other, times, seen in zip(program.groups, program.times, after, strict=True):
        if frozenset((name, other)) in program.conflicts:
            if seen.colour in _GOING:
                return f"starts against {other!r} {seen.colour}"
            if seen.quiet < times.clearance:
                return f"starts {seen.quiet} after {other!r}"
    return ""


def _must_serve(kernel: Kernel, program: Program, states: Collection[State], index: int) -> None:
    """Go on from each state under one request until its green, or where that is known to come."""
    requested = {program.groups[index]}
    longest = 2 * sum(map(sum, program.times)) + 10
    served = {state for state in states if _of(state[index]) == "green"}
    for begun in states:
        state, way = begun, set[State]()
        while state not in served and _of(state[index]) != "green":
            if state in way or len(way) > longest:
                raise PlanError(f"unsafe: group {program.groups[index]!r} is never served")
            way.add(state)
            state = kernel.step(program, state, requested, 1)
        served |= way
