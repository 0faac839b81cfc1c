"""NEMA rings above the kernel: which phases request green now. Pure, immutable, no clock.

A phase is a signal group, given by its number in the program. A ring is a sequence of phases that
all conflict; rings of one section run side by side because no phase of one conflicts with any of
the others; between two sections is a barrier that all rings cross together. `layout_of` derives all
of it from the groups and conflicts of a junction: eight phases of a textbook crossing become two
rings and two sections, four approaches that all conflict become one ring.

    a green ends after min green when somebody in conflict is called, and it gaps out (no vehicle
    for `passage`), maxes out (others have waited for max 1 or max 2), or is forced off; never
    while it is held. Then comes the next called phase of the ring, or all rings cross the barrier.
    With nobody in conflict called it rests in green.

The output is a set of phases without conflict: requests to the kernel, which alone decides colours,
yellow and red clear. Times are whole numbers of any unit, as the kernel's.
"""

from collections.abc import Iterable
from enum import Enum
from typing import NamedTuple

from scm.traffic.signals.kernel import Phase, Program, State


class Recall(Enum):
    """A call without a vehicle: for a least green, for all of max, or when nobody else calls."""

    NONE = "none"
    MIN = "min"
    MAX = "max"
    SOFT = "soft"


class PhaseTimes(NamedTuple):
    """How one phase is run; `locking` keeps a call until it is served, though the car has gone."""

    min_green: int
    passage: int
    max1: int
    max2: int
    recall: Recall = Recall.NONE
    locking: bool = False


class Layout(NamedTuple):
    """Phases by their number, and `sections[s][r]`, the sequence of ring r between two barriers."""

    phases: tuple[PhaseTimes, ...]
    sections: tuple[tuple[tuple[int, ...], ...], ...]


class Inputs(NamedTuple):
    """The inputs of the rings, as numbers of phases.

    Attributes:
        calls: A vehicle is there: calls a red phase, extends a green one.
        hold: Stay green, once green.
        force_off: End when the least green is over and others are called, vehicles or not.
        omit: Do not begin.
        preempt: Go to this phase without regard to order, and stay.
        max2: Where max 2 is in force instead of max 1.
    """

    calls: frozenset[int] = frozenset()
    hold: frozenset[int] = frozenset()
    force_off: frozenset[int] = frozenset()
    omit: frozenset[int] = frozenset()
    preempt: int | None = None
    max2: frozenset[int] = frozenset()


class Ring(NamedTuple):
    """One ring: the phase it serves or waits for, and its timers, counted no further than needed.

    Attributes:
        phase: None: nothing of this section was called in this ring.
        green: How long it has been green.
        gap: Since the last vehicle.
        waited: For how long somebody in conflict has been called; max 1 and max 2 end it.
        passed: With no phase: the one that was left out when its turn came; the ring goes on
            behind it.
    """

    phase: int | None = None
    green: int = 0
    gap: int = 0
    waited: int = 0
    passed: int | None = None


class Rings(NamedTuple):
    """Between which barriers we are, the rings there, and calls kept by locking memory."""

    section: int
    rings: tuple[Ring, ...]
    calls: frozenset[int] = frozenset()


def layout_of(program: Program, phases: tuple[PhaseTimes, ...]) -> Layout:
    """Return rings and barriers for a junction.

    Groups that could ever share a green stand in one section. Where the conflicts inside it do not
    fall into rings, it is cut into stages, with a barrier between each two.
    """
    numbers = range(len(program.groups))
    conflicting = {
        i: {
            j for j in numbers if frozenset((program.groups[i], program.groups[j]))
            in program.conflicts and i != j
        }
        for i in numbers
    }  # fmt: skip
    friends = {i: {j for j in numbers if j not in conflicting[i] and j != i} for i in numbers}
    sections: list[tuple[tuple[int, ...], ...]] = []
    alone = tuple(i for i in numbers if not friends[i])
    if alone:
        sections.append((alone,))
    for members in _components([i for i in numbers if i not in alone], friends):
        rings = _components(members, conflicting)
        if all(j in conflicting[i] for ring in rings for i in ring for j in ring if i != j):
            sections.append(rings)
        else:
            sections += [tuple((i,) for i in stage) for stage in _stages(members, conflicting)]
    return Layout(phases, tuple(sections))


def _components(numbers: Iterable[int], edges: dict[int, set[int]]) -> tuple[tuple[int, ...], ...]:
    """Return the connected components, in the order of their first members."""
    left, found = list(numbers), []
    while left:
        reached, todo = set[int](), [left[0]]
        while todo:
            at = todo.pop()
            reached.add(at)
            todo += [to for to in edges[at] if to in left and to not in reached]
        found.append(tuple(i for i in left if i in reached))
        left = [i for i in left if i not in reached]
    return tuple(found)


def _stages(numbers: Iterable[int], conflicting: dict[int, set[int]]) -> list[list[int]]:
    stages: list[list[int]] = []
    for number in numbers:
        fitting = (stage for stage in stages if not conflicting[number] & set(stage))
        stage = next(fitting, None)
        if stage is None:
            stages.append([number])
        else:
            stage.append(number)
    return stages


def start(layout: Layout) -> Rings:
    """Return the state after power-on: nothing served, before the first section."""
    return Rings(0, tuple(Ring() for _ in layout.sections[0]))


def requested(state: Rings) -> frozenset[int]:
    """Return the phases that request green now."""
    return frozenset(ring.phase for ring in state.rings if ring.phase is not None)


def green_in(state: State) -> frozenset[int]:
    """Return the numbers of the phases that the kernel shows green."""
    return frozenset(i for i, group in enumerate(state) if group.phase is Phase.GREEN)


def step(layout: Layout, state: Rings, inputs: Inputs, green: frozenset[int], dt: int) -> Rings:
    """Return the state `dt` later, with `green` the phases that the kernel shows green."""
    called = _called(layout, state, inputs)
    locked = {i for i in inputs.calls if layout.phases[i].locking}
    calls = frozenset((state.calls | locked) - green)
    rings = tuple(
        _count(layout, state, ring, inputs, called, green, dt) for ring in state.rings
    )  # fmt: skip
    state = Rings(state.section, rings, calls)
    if inputs.preempt is not None:
        return _preempt(layout, state, inputs.preempt)
    return _go_on(layout, state, inputs, called)


def order_of(layout: Layout, state: Rings, called: frozenset[int]) -> list[frozenset[int]]:
    """Return which phases request green together, one set after the other, the present one first.

    It is the order of `step` while these stay called, each until it has been served once.
    """
    order = [requested(state)]
    left = called - order[0]
    while left:
        sequences = layout.sections[state.section]
        wraps = left <= {i for sequence in sequences for i in sequence}
        after = tuple(
            _advance(sequence, ring, left, wraps=wraps)
            for sequence, ring in zip(sequences, state.rings, strict=True)
        )
        is_last = after == state.rings
        state = _cross(layout, state, left) if is_last else state._replace(rings=after)
        order.append(requested(state))
        left -= order[-1]
    return [phases for phases in order if phases]


def _called(layout: Layout, state: Rings, inputs: Inputs) -> frozenset[int]:
    """Return who is called: by vehicles, by memory, by recall; not who is omitted."""
    always = {i for i, p in enumerate(layout.phases) if p.recall in (Recall.MIN, Recall.MAX)}
    called = (inputs.calls | state.calls | always) - inputs.omit
    if not called:
        soft = {i for i, p in enumerate(layout.phases) if p.recall is Recall.SOFT}
        called |= soft - inputs.omit
    return frozenset(called)


def _count(
    layout: Layout,
    state: Rings,
    ring: Ring,
    inputs: Inputs,
    called: frozenset[int],
    green: frozenset[int],
    dt: int,
) -> Ring:
    """Return a ring with its timers run on; they run while its phase is green."""
    if ring.phase is None:
        return ring
    if ring.phase not in green:
        is_left_out = ring.phase in inputs.omit
        return Ring(None, passed=ring.phase) if is_left_out else Ring(ring.phase)
    times = layout.phases[ring.phase]
    is_there = ring.phase in inputs.calls or times.recall is Recall.MAX
    return Ring(
        ring.phase,
        green=min(ring.green + dt, times.min_green),
        gap=0 if is_there else min(ring.gap + dt, times.passage),
        waited=min(ring.waited + dt, _most(times, ring.phase, inputs))
        if _is_wanted_by_others(layout, state, ring.phase, called)
        else 0,
    )


def _most(times: PhaseTimes, phase: int, inputs: Inputs) -> int:
    return times.max2 if phase in inputs.max2 else times.max1


def _is_wanted_by_others(
    layout: Layout, state: Rings, phase: int, called: frozenset[int]
) -> bool:  # fmt: skip
    """Return whether a phase in conflict with this one is called: of its ring, or elsewhere."""
    conflicting = set(called)
    for ring in layout.sections[state.section]:
        if phase not in ring:
            conflicting -= set(ring)
    return bool(conflicting - {phase})


def _is_ready(layout: Layout, ring: Ring, inputs: Inputs) -> bool:
    """Return whether a ring may leave its phase."""
    if ring.phase is None:
        return True
    times = layout.phases[ring.phase]
    is_over = (
        ring.gap >= times.passage
        or ring.waited >= _most(times, ring.phase, inputs)
        or ring.phase in inputs.force_off
    )
    return ring.green >= times.min_green and is_over and ring.phase not in inputs.hold


def _go_on(layout: Layout, state: Rings, inputs: Inputs, called: frozenset[int]) -> Rings:
    """Advance rings, or move all of them across the barrier."""
    here = {i for ring in layout.sections[state.section] for i in ring}
    others = called - here
    ready = [_is_ready(layout, ring, inputs) for ring in state.rings]
    if others:
        after = [
            _next_in(sequence, ring, called)
            for sequence, ring in zip(layout.sections[state.section], state.rings, strict=True)
        ]
        is_last = [
            _place(ring) is None or following is None
            for ring, following in zip(state.rings, after, strict=True)
        ]
        is_begun = any(_place(ring) is not None for ring in state.rings)
        if all(ready) and all(is_last) and (is_begun or not any(i in called for i in here)):
            return _cross(layout, state, called)
    is_shut = any(ring.phase in inputs.hold for ring in state.rings)
    rings = tuple(
        _advance(sequence, ring, called, wraps=is_shut or not others) if may else ring
        for sequence, ring, may in zip(
            layout.sections[state.section], state.rings, ready, strict=True
        )
    )
    return state._replace(rings=rings)


def _place(ring: Ring) -> int | None:
    """Return the phase where a ring is, though it was left out; None: before the first."""
    return ring.passed if ring.phase is None else ring.phase


def _next_in(sequence: tuple[int, ...], ring: Ring, called: frozenset[int]) -> int | None:
    """Return the next called phase of a ring before the barrier; None: there is none."""
    place = _place(ring)
    at = -1 if place is None else sequence.index(place)
    return next((i for i in sequence[at + 1 :] if i in called), None)


def _advance(
    sequence: tuple[int, ...], ring: Ring, called: frozenset[int], *, wraps: bool
) -> Ring:  # fmt: skip
    """Return a ring at its next called phase.

    It may begin again where nobody waits elsewhere, or a hold keeps the barrier shut anyway.
    """
    following = _next_in(sequence, ring, called)
    if following is None and wraps:
        following = next((i for i in sequence if i in called and i != ring.phase), None)
    return ring if following is None else Ring(following)


def _cross(layout: Layout, state: Rings, called: frozenset[int]) -> Rings:
    """Return the state behind the barrier, in the next section where anybody is called."""
    count = len(layout.sections)
    section = next(
        section
        for section in ((state.section + ahead) % count for ahead in range(1, count))
        if any(i in called for ring in layout.sections[section] for i in ring)
    )
    firsts = (_next_in(ring, Ring(), called) for ring in layout.sections[section])
    return state._replace(section=section, rings=tuple(Ring(first) for first in firsts))


def _preempt(layout: Layout, state: Rings, phase: int) -> Rings:
    """Return the state that goes to a phase now; rings beside it may stay as they are."""
    section = next(
        s for s, rings in enumerate(layout.sections) if any(phase in ring for ring in rings)
    )
    sequences = layout.sections[section]
    current = state.rings if section == state.section else tuple(Ring() for _ in sequences)
    rings = tuple(
        (ring if ring.phase == phase else Ring(phase)) if phase in sequence else ring
        for sequence, ring in zip(sequences, current, strict=True)
    )
    return Rings(section, rings, state.calls)
