"""Actuated: rings and barriers, green as long as vehicles come, none where nobody is.

A phase is called by a vehicle before its stop line or by an operator; one that has been red for
`UNSEEN_NS` is called anyway, for cars that the detectors do not see. Max 2 is in force where a
queue is longer than max 1 can clear. When detectors receive nothing at all, every phase has max
recall: then it runs like fixed time.

Vocabulary and rules: NEMA TS 2 and NTCIP 1202, as far as `scm.traffic.signals.rings` says.
"""

from dataclasses import dataclass
from typing import NamedTuple

from scm.clock import NS_PER_S
from scm.traffic.signals import rings
from scm.traffic.signals.green_extension import (
    GUARANTEED_S,
    green_s,
    is_worth_waiting,
    worth_until_s,
)
from scm.traffic.signals.guaranteed_time import GREEN_NOTICE_NS
from scm.traffic.signals.kernel import Phase
from scm.traffic.signals.operator_overrides import NEED_RINGS, groups_of
from scm.traffic.signals.policy import Answer, JunctionView, Mode, Policy, Site, Turn
from scm.traffic.signals.rings import Inputs, Recall, Ring, Rings

UNSEEN_NS = 120 * NS_PER_S  # red for so long is a call: a car may be invisible to detectors
LONG_QUEUE = 4  # cars; max 1 lets no more of them go


class Memory(NamedTuple):
    """The rings, and since when each phase has not been green [ns]."""

    rings: Rings
    not_green_ns: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class RingInputs:
    """The inputs of the rings, and whether the detectors are reliable."""

    inputs: Inputs
    sees: bool


def start(site: Site) -> Memory:
    """Begin with nothing served."""
    return Memory(rings.start(site.layout), (0,) * len(site.program.groups))


def step(site: Site, memory: Memory, view: JunctionView) -> tuple[Memory, Answer]:
    """Step the rings."""
    memory = ride(site, memory, view, inputs_of(site, memory, view))
    mode: Mode = "preempt" if groups_of(view.overrides, "preempt") else "adaptive"
    return memory, Answer(named(site, rings.requested(memory.rings)), mode=mode)


def ride(site: Site, memory: Memory, view: JunctionView, ring_inputs: RingInputs) -> Memory:
    """Return the memory a step later."""
    green = rings.green_in(view.state)
    layout = site.layout
    if not ring_inputs.sees:
        blind = tuple(phase._replace(recall=Recall.MAX) for phase in layout.phases)
        layout = layout._replace(phases=blind)
    after = rings.step(layout, memory.rings, ring_inputs.inputs, green, view.dt_ns)
    waits = tuple(
        0 if i in green else wait + view.dt_ns for i, wait in enumerate(memory.not_green_ns)
    )
    return Memory(after, waits)


def inputs_of(site: Site, memory: Memory, view: JunctionView) -> RingInputs:
    """Return the inputs of the rings from detectors and operators."""
    groups = site.program.groups
    calls = {i for i, wait in enumerate(memory.not_green_ns) if wait >= UNSEEN_NS}
    long = set()
    for i, name in enumerate(groups):
        detector = view.detectors.get(name)
        is_green = view.state[i].phase is Phase.GREEN
        if detector is None:
            continue
        if is_worth_waiting(site, i, view) if is_green else detector.call:
            calls.add(i)
        if detector.queue > LONG_QUEUE:
            long.add(i)
    preempt = sorted(numbers(site, groups_of(view.overrides, "preempt")))
    inputs = Inputs(
        calls=frozenset(calls) | numbers(site, groups_of(view.overrides, "call")),
        hold=numbers(site, groups_of(view.overrides, "hold")),
        force_off=numbers(site, groups_of(view.overrides, "force_off")),
        omit=numbers(site, groups_of(view.overrides, "omit")),
        preempt=preempt[0] if preempt else None,
        max2=frozenset(long),
    )
    return RingInputs(inputs, view.sees)


def numbers(site: Site, groups: frozenset[str]) -> frozenset[int]:
    """Return groups as numbers of phases."""
    return frozenset(site.program.groups.index(group) for group in groups)


def foresee(site: Site, memory: Memory, view: JunctionView) -> tuple[Turn, ...]:
    """Return the turns of the rings as they are called now; none under overrides."""
    if any(one.verb in NEED_RINGS for one in view.overrides):
        return ()
    inputs = inputs_of(site, memory, view).inputs
    layout, state = site.layout, memory.rings
    called = inputs.calls if view.sees else frozenset(range(len(layout.phases)))
    left_s = {
        ring.phase: _left_s(site, ring, inputs, view)
        for ring in state.rings
        if ring.phase is not None
    }
    queue = rings.order_of(layout, state, called)
    if len(queue) == 1:
        return (Turn(named(site, queue[0]), None),)
    turns, before = [], frozenset[int]()
    for phases in queue:
        lasts_s = (left_s.pop(i, _green_s(site, i, view)) for i in phases - before)
        turns.append(Turn(named(site, phases), max(lasts_s, default=0.0)))
        before = phases
    return tuple(turns)


def _left_s(site: Site, ring: Ring, inputs: Inputs, view: JunctionView) -> float:
    """Return for how long a ring's phase stays green while others are called [s]."""
    if ring.phase is None:
        return 0.0
    if view.state[ring.phase].phase is not Phase.GREEN:
        return _green_s(site, ring.phase, view)
    times = site.layout.phases[ring.phase]
    most_ns = times.max2 if ring.phase in inputs.max2 else times.max1
    over_s = (most_ns - ring.waited) / NS_PER_S
    least_s = (times.min_green - ring.green) / NS_PER_S
    if not view.sees:
        return max(least_s, over_s) + GUARANTEED_S
    from_s, passage_s = max(0.0, least_s), times.passage / NS_PER_S
    until_s = worth_until_s(site, ring.phase, view, from_s)
    is_alone = until_s == from_s  # the gap runs already
    gap_s = (times.passage - ring.gap) / NS_PER_S if is_alone else until_s + passage_s
    return max(from_s, min(gap_s, over_s)) + GUARANTEED_S


def _green_s(site: Site, phase: int, view: JunctionView) -> float:
    """Return how long a green that is to come takes [s]."""
    times = site.layout.phases[phase]
    detector = view.detectors.get(site.program.groups[phase])
    if not view.sees or detector is None:
        return (times.max1 + GREEN_NOTICE_NS) / NS_PER_S
    needed_s = min(green_s(site, phase, detector), times.max1 / NS_PER_S)
    return max(needed_s, times.min_green / NS_PER_S + GUARANTEED_S)


def named(site: Site, phases: frozenset[int]) -> frozenset[str]:
    """Return phases as names of groups."""
    return frozenset(site.program.groups[phase] for phase in phases)


POLICY = Policy(
    "actuated: green for whoever is there, as long as they come",
    start,
    step,
    foresee=foresee,
)
