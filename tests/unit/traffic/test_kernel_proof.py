"""Proof by exhaustion: every reachable state of the kernel under every wish, judged by an observer.

The observer sees what people see, colours and time, and keeps its own small memory of them. The
search walks the product of kernel and observer until nothing new is found. The same search must
find a fault in every mutant of the kernel's source.
"""

import itertools
import types
from pathlib import Path

import pytest

from scm.traffic import kernel
from scm.traffic.kernel import GroupTimes, Phase, Program

COLOUR = {
    "RED": "red",
    "CLEARANCE": "red",
    "GREEN": "green",
    "YELLOW": "yellow",
    "FLASH": "flash",
}
GOING = ("green", "yellow", "flash")


def pairs(*names):
    return frozenset(frozenset(pair) for pair in names)


CROSSING = Program(("a", "b"), (GroupTimes(3, 2, 4), GroupTimes(2, 3, 2)), pairs("ab"))
TRIANGLE = Program(
    ("a", "b", "c"),
    (GroupTimes(2, 1, 2), GroupTimes(1, 2, 3), GroupTimes(2, 2, 1)),
    pairs("ab", "bc"),
)


def dual_ring():
    """NEMA's eight phases: two rings, a barrier between 1 2 5 6 and 3 4 7 8."""
    together = {(ring1, ring2) for half in ("12", "34") for ring1 in half for ring2 in _other(half)}
    names = tuple("12345678")
    conflicts = pairs(*(p for p in itertools.combinations(names, 2) if p not in together))
    return Program(names, (GroupTimes(3, 2, 2),) * 8, conflicts)


def _other(half):
    return {"12": "56", "34": "78"}[half]


class UnsafeError(AssertionError):
    """What the observer objects to."""


class Observer:
    """Judges what is shown; per group: colour, for how long, and since when nobody goes on it."""

    def __init__(self, program):
        self.program = program

    def begin(self, state):
        return tuple((COLOUR[group.phase.name], 0, 0) for group in state)

    def watch(self, memory, state, wishes, dt):
        shown = [colour for colour, _, _ in memory]
        after = []
        for (before, age, quiet), group in zip(memory, state, strict=True):
            now = COLOUR[group.phase.name]
            went = before in GOING
            after.append((now, age + dt if now == before else 0, 0 if went else quiet + dt))
        for index, before in enumerate(shown):
            self._judge(index, before, memory[index][1] + dt, after, wishes)
        return tuple(map(self._forget, after, self.program.times))

    @staticmethod
    def _forget(item, times):
        """Count no further than anybody asks: that keeps the search finite."""
        colour, age, quiet = item
        if colour in GOING:
            return colour, min(age, max(times.min_green, times.yellow)), 0
        return colour, 0, min(quiet, times.clearance)

    def _judge(self, index, before, shown, after, wishes):
        name, times = self.program.groups[index], self.program.times[index]
        now = after[index][0]
        match before, now:
            case ("green", "yellow") if shown < times.min_green:
                raise UnsafeError(f"{name}: short green")
            case ("yellow", "red") if shown < times.yellow:
                raise UnsafeError(f"{name}: short yellow")
            case ("red", "green") if name not in wishes:
                raise UnsafeError(f"{name}: nobody wished it")
            case ("red", "green"):
                self._judge_start(name, after)
            case _ if (before, now) not in ALLOWED:
                raise UnsafeError(f"{name}: {before} to {now}")

    def _judge_start(self, name, after):
        for other, times, (colour, _, quiet) in zip(
            self.program.groups, self.program.times, after, strict=True
        ):
            if frozenset((name, other)) not in self.program.conflicts:
                continue
            if colour in GOING:
                raise UnsafeError(f"{name} starts against {other} {colour}")
            if quiet < times.clearance:
                raise UnsafeError(f"{name} starts {quiet} after {other}")


ALLOWED = {(c, c) for c in ("red", "green", "yellow", "flash")}
ALLOWED |= {(c, "flash") for c in ("red", "green", "yellow")}
ALLOWED |= {("green", "yellow"), ("yellow", "red"), ("flash", "red")}


def search(module, program, dts=(1,)):
    """Return (kernel states, transitions) after walking everything; raise on a fault."""
    observer = Observer(program)
    first = module.start(program)
    todo = [(first, observer.begin(first))]
    seen, transitions = set(todo), 0
    all_wishes = [
        frozenset(wish)
        for n in range(len(program.groups) + 1)
        for wish in itertools.combinations(program.groups, n)
    ]
    while todo:
        state, memory = todo.pop()
        moves = [(wishes, dt, False) for wishes in all_wishes for dt in dts]
        for wishes, dt, flash in [*moves, (frozenset(), dts[0], True)]:
            after = module.step(program, state, wishes, dt, flash=flash)
            node = after, observer.watch(memory, after, wishes, dt)
            transitions += 1
            if node not in seen:
                seen.add(node)
                todo.append(node)
    return {state for state, _ in seen}, transitions


def check_everybody_is_served(module, program, states):
    """From every state, a wish that is held alone is granted in bounded time."""
    bound = 2 * sum(sum(times) for times in program.times) + 10
    for state in states:
        for index, name in enumerate(program.groups):
            now = state
            for _ in range(bound):
                if now[index].phase.name == "GREEN":
                    break
                now = module.step(program, now, {name}, 1)
            else:
                raise UnsafeError(f"{name} is never served from {state}")


@pytest.mark.parametrize("program", [CROSSING, TRIANGLE], ids=["crossing", "triangle"])
def test_no_state_of_a_small_junction_is_unsafe_however_steps_fall(program):
    states, _ = search(kernel, program, dts=(1, 0, 2, 5))
    check_everybody_is_served(kernel, program, states)


def test_no_state_of_a_dual_ring_of_eight_phases_is_unsafe():
    states, transitions = search(kernel, dual_ring())
    assert len(states) > 500
    assert transitions > 140_000


MUTANTS = {
    "all-red left out": (
        "return GroupState(Phase.CLEARANCE)\n        case Phase.CLEARANCE",
        "return GroupState(Phase.RED)\n        case Phase.CLEARANCE",
    ),
    "all-red too short": ("elapsed >= times.clearance", "True"),
    "all-red does not guard": (
        "_ACTIVE = (Phase.GREEN, Phase.YELLOW, Phase.CLEARANCE)",
        "_ACTIVE = (Phase.GREEN, Phase.YELLOW)",
    ),
    "yellow does not guard": (
        "_ACTIVE = (Phase.GREEN, Phase.YELLOW, Phase.CLEARANCE)",
        "_ACTIVE = (Phase.GREEN, Phase.CLEARANCE)",
    ),
    "green does not guard": (
        "_ACTIVE = (Phase.GREEN, Phase.YELLOW, Phase.CLEARANCE)",
        "_ACTIVE = (Phase.YELLOW, Phase.CLEARANCE)",
    ),
    "min green ignored": ("elapsed >= times.min_green:", "True:"),
    "yellow too short": ("elapsed >= times.yellow", "True"),
    "yellow as short as all-red": ("elapsed >= times.yellow", "elapsed >= times.clearance"),
    "yellow skipped": ("else GroupState(Phase.YELLOW)", "else GroupState(Phase.CLEARANCE)"),
    "conflicts ignored": ("in program.conflicts", "in ()"),
    "two start at once": ("_is_free(program, after, name)", "_is_free(program, list(state), name)"),
    "flash ends without clearing": (
        "case Phase.FLASH:\n            return GroupState(Phase.CLEARANCE)",
        "case Phase.FLASH:\n            return GroupState(Phase.RED)",
    ),
    "power-on without clearing": (
        "return tuple(GroupState(Phase.CLEARANCE) for _",
        "return tuple(GroupState(Phase.RED) for _",
    ),
    "green that nobody wished": ("is Phase.RED and name in wishes and", "is Phase.RED and"),
    "never green": (
        "is Phase.RED and name in wishes",
        "is Phase.RED and name not in program.groups",
    ),
    "flash ignored": ("if flash:", "if flash and not state:"),
    "time not counted": (
        "else GroupState(group.phase, elapsed)",
        "else GroupState(group.phase, group.elapsed)",
    ),
    "a green never ends": ("times.min_green) if wished", "times.min_green) if True"),
}


@pytest.mark.parametrize("name", sorted(MUTANTS))
def test_a_mutant_of_the_kernel_is_caught(name):
    old, new = MUTANTS[name]
    source = Path(kernel.__file__).read_text(encoding="utf-8")
    assert source.count(old) == 1
    mutant = types.ModuleType("mutant")
    exec(compile(source.replace(old, new), "mutant", "exec"), mutant.__dict__)
    with pytest.raises(UnsafeError):
        check_all(mutant)


def check_all(module):
    for program in (CROSSING, TRIANGLE):
        states, _ = search(module, program, dts=(1, 2))
        check_everybody_is_served(module, program, states)
        check_flash_shows(module, program)


def check_flash_shows(module, program):
    state = module.step(program, module.start(program), (), 1, flash=True)
    if any(group.phase.name != "FLASH" for group in state):
        raise UnsafeError("flash is not shown")


def test_the_unmutated_source_passes_the_same_checks():
    check_all(kernel)


def test_time_that_runs_backward_counts_as_none():
    state = kernel.start(CROSSING)
    assert kernel.step(CROSSING, state, (), -5) == state


def test_a_green_that_is_still_wished_stays_and_its_count_is_bounded():
    state = kernel.start(CROSSING)
    for _ in range(50):
        state = kernel.step(CROSSING, state, {"a"}, 1)
    assert state[0] == (Phase.GREEN, 3)
