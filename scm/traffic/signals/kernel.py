"""The signal kernel: the only place that decides a colour. Pure, immutable, no clock, no bus.

    red -> green (at least min_green) -> yellow -> clearance (shows red) -> red

A group starts only when no group in conflict with it is green, yellow or in clearance. Its inputs
are requests: which groups should be green now. A request that is not safe waits; a green that is no
longer requested ends. Flash overrides everything at once; the way back leads through a clearance of
all groups.

Every phase lasts at least one step and at least its time, however long a step is. Times are whole
numbers of any unit (nanoseconds live, small numbers in the proof, which walks through every state
that can be reached under every set of requests: `tests/unit/traffic/signals/test_kernel_proof.py`).
"""

from collections.abc import Collection
from enum import Enum
from typing import NamedTuple


class Phase(Enum):
    """Where a group stands; clearance shows red but still protects those who went last."""

    RED = "red"
    GREEN = "green"
    YELLOW = "yellow"
    CLEARANCE = "clearance"
    FLASH = "flash"

    __hash__ = object.__hash__  # that of `Enum` is written in Python, and proofs hash millions


class GroupTimes(NamedTuple):
    """The least times of one group, in the unit of `step`'s `dt`."""

    min_green: int
    yellow: int
    clearance: int


class Program(NamedTuple):
    """What a junction's kernel is built for; `conflicts` holds pairs of group names."""

    groups: tuple[str, ...]
    times: tuple[GroupTimes, ...]
    conflicts: frozenset[frozenset[str]]


class GroupState(NamedTuple):
    """Phase of one group, and for how long; counted no further than the phase must last."""

    phase: Phase
    elapsed: int = 0


State = tuple[GroupState, ...]

_ACTIVE = (Phase.GREEN, Phase.YELLOW, Phase.CLEARANCE)


def start(program: Program) -> State:
    """Return the state after power-on: everybody red and clearing, as if all had just gone."""
    return tuple(GroupState(Phase.CLEARANCE) for _ in program.groups)


def step(
    program: Program, state: State, requested: Collection[str], dt: int, *, flash: bool = False
) -> State:
    """Return the state `dt` later, with `requested` the names of groups that request green."""
    if flash:
        return tuple(GroupState(Phase.FLASH) for _ in program.groups)
    after = [
        _advance(group, times, is_requested=name in requested, dt=max(dt, 0))
        for name, times, group in zip(program.groups, program.times, state, strict=True)
    ]
    for index, name in enumerate(program.groups):
        if after[index].phase is Phase.RED and name in requested and _is_free(program, after, name):
            after[index] = GroupState(Phase.GREEN)
    return tuple(after)


def is_all_red(state: State) -> bool:
    """Return whether every group is red, and nobody who went last is still protected."""
    return all(group.phase is Phase.RED for group in state)


def _advance(group: GroupState, times: GroupTimes, *, is_requested: bool, dt: int) -> GroupState:
    """Return a group's state `dt` later as far as it depends on nobody else."""
    elapsed = group.elapsed + dt
    match group.phase:
        case Phase.GREEN if elapsed >= times.min_green:
            stays = GroupState(Phase.GREEN, times.min_green)
            return stays if is_requested else GroupState(Phase.YELLOW)
        case Phase.YELLOW if elapsed >= times.yellow:
            return GroupState(Phase.CLEARANCE)
        case Phase.CLEARANCE if elapsed >= times.clearance:
            return GroupState(Phase.RED)
        case Phase.FLASH:
            return GroupState(Phase.CLEARANCE)
    return group if group.phase is Phase.RED else GroupState(group.phase, elapsed)


def _is_free(program: Program, state: list[GroupState], name: str) -> bool:
    """Return whether no group in conflict with this one is active."""
    return not any(
        group.phase in _ACTIVE and frozenset((name, other)) in program.conflicts
        for other, group in zip(program.groups, state, strict=True)
    )
