"""Random requests for thousands of junctions at once: the kernel as arrays, and an observer.

`KernelArrays` transcribes the kernel's step; `differences` proves it equal to the kernel state by
state, so a hundred million steps of the one count for the other. The observer sees colours alone:
two conflicting groups that go at once, or a start before the others' clearance.
"""

from collections.abc import Iterable
from itertools import chain, combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scm.traffic.signals import kernel
from scm.traffic.signals.kernel import GroupState, Phase, Program, State

Array = NDArray[np.int16]
Flags = NDArray[np.bool_]

PHASES = (Phase.RED, Phase.GREEN, Phase.YELLOW, Phase.CLEARANCE, Phase.FLASH)
RED, GREEN, YELLOW, CLEARANCE, FLASH = range(5)


class Judged(NamedTuple):
    """Steps made, greens begun, and what was found wrong."""

    steps: int
    greens: int
    conflicts: int
    short_clearances: int


class KernelArrays:
    """So many junctions of one program; times in steps.

    Attributes:
        phase: (groups, junctions) places in `PHASES`.
        elapsed: (groups, junctions) steps, as the kernel counts them.
    """

    def __init__(self, program: Program, junctions: int) -> None:
        shape = (len(program.groups), junctions)
        self.phase = np.full(shape, CLEARANCE, np.int16)
        self.elapsed = np.zeros(shape, np.int16)
        self._times = program.times
        numbers = range(len(program.groups))
        self.conflicting = [
            [
                j
                for j in numbers
                if frozenset((program.groups[i], program.groups[j])) in program.conflicts
            ]
            for i in numbers
        ]

    def step(self, requested: Flags, flash: Flags, dt: int = 1) -> None:
        """Go on; `requested` is (groups, junctions), `flash` is (junctions,)."""
        for i, times in enumerate(self._times):
            self._advance(self.phase[i], self.elapsed[i], times, requested[i], dt)
        for i in range(len(self._times)):
            free = (self.phase[i] == RED) & requested[i]
            for j in self.conflicting[i]:
                free &= (self.phase[j] == RED) | (self.phase[j] == FLASH)
            self.phase[i][free] = GREEN
        self.phase[:, flash] = FLASH
        self.elapsed[:, flash] = 0

    @staticmethod
    def _advance(
        phase: Array, elapsed: Array, times: kernel.GroupTimes, requested: Flags, dt: int
    ) -> None:
        """Advance one group of all junctions in place."""
        elapsed += np.int16(dt)
        green, yellow = phase == GREEN, phase == YELLOW
        clearance, flash = phase == CLEARANCE, phase == FLASH
        is_over = green & (elapsed >= times.min_green)
        stays = is_over & requested
        to_yellow = is_over & ~requested
        to_clearance = (yellow & (elapsed >= times.yellow)) | flash
        to_red = clearance & (elapsed >= times.clearance)
        phase[to_yellow] = YELLOW
        phase[to_clearance] = CLEARANCE
        phase[to_red] = RED
        elapsed[to_yellow | to_clearance | to_red | (phase == RED)] = 0
        elapsed[stays] = times.min_green


def differences(program: Program, states: Iterable[State], dts: Iterable[int] = (1,)) -> int:
    """Return in how many of (states x requests x step lengths) arrays and kernel differ."""
    found = list(states)
    sizes = range(len(program.groups) + 1)
    sets = list(chain(*(combinations(program.groups, n) for n in sizes)))
    wrong = 0
    for dt in dts:
        for requested in sets:
            for flash in (False, True):
                wrong += _differ(program, found, requested, dt, flash=flash)
    return wrong


def _differ(
    program: Program, states: list[State], requested: tuple[str, ...], dt: int, *, flash: bool
) -> int:
    arrays = KernelArrays(program, len(states))
    arrays.phase[:] = np.array([[PHASES.index(g.phase) for g in state] for state in states]).T
    arrays.elapsed[:] = np.array([[g.elapsed for g in state] for state in states]).T
    flags = np.array([[name in requested] * len(states) for name in program.groups])
    arrays.step(flags, np.full(len(states), flash), dt)
    wrong = 0
    for k, state in enumerate(states):
        got = tuple(
            GroupState(PHASES[int(p)], int(e))
            for p, e in zip(arrays.phase[:, k], arrays.elapsed[:, k], strict=True)
        )
        wrong += got != kernel.step(program, state, requested, dt, flash=flash)
    return wrong


def run_random_requests(program: Program, junctions: int, steps: int, seed: int) -> Judged:
    """Request at random, in bursts of random length, and check every step.

    Args:
        program: Of the junction, times in steps.
        junctions: Beside each other.
        steps: Of each.
        seed: Of the requests.
    """
    dice = np.random.default_rng(seed)
    city = KernelArrays(program, junctions)
    shape = city.phase.shape
    requested = np.zeros(shape, np.bool_)
    quiet = np.zeros(shape, np.int16)
    was_green = np.zeros(shape, np.bool_)
    greens = conflicts = short = 0
    for _ in range(steps):
        changes = dice.integers(0, 256, shape, np.uint8) < 16
        requested ^= changes
        flash = dice.integers(0, 4096, junctions, np.uint16) == 0
        city.step(requested, flash)
        going = (city.phase == GREEN) | (city.phase == YELLOW)
        quiet += 1
        quiet[going | (city.phase == FLASH)] = 0
        np.minimum(quiet, 30_000, out=quiet)
        green = city.phase == GREEN
        begins = green & ~was_green
        greens += int(begins.sum())
        for i, conflicting in enumerate(city.conflicting):
            for j in conflicting:
                conflicts += int((going[i] & going[j]).sum()) if i < j else 0
                least = program.times[j].clearance
                short += int((begins[i] & (quiet[j] < least) & ~going[j]).sum())
        was_green = green
    return Judged(steps * junctions, greens, conflicts, short)
