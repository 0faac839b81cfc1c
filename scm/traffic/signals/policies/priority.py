"""Priority: actuated, and help for vehicles that ask for it on the air (SREM in, SSEM out).

    emergency   pre-emption: its phase comes next, out of order, and stays until it has passed
    transit     green extension while its phase is green, up to EXTEND_NS beyond max; early green
                while it is red: others end at their least green, the order stays
    any other   rejected

One pre-emption at a time, the first that asked; the others are processed after it. A request for no
way of this junction is rejected. It is granted once its phase is green and will stay so. Help
begins `LEAD_NS` before a vehicle's estimated arrival, and ends `LATE_NS` after it.

Pattern: NTCIP 1211 and SAE J2735 request and status messages.
"""

from collections.abc import Iterable
from typing import NamedTuple

from scm.clock import NS_PER_S
from scm.traffic.signals import rings
from scm.traffic.signals.kernel import Phase
from scm.traffic.signals.operator_overrides import groups_of
from scm.traffic.signals.policies import actuated
from scm.traffic.signals.policies.actuated import RingInputs, inputs_of, named, numbers
from scm.traffic.signals.policy import (
    Answer,
    JunctionView,
    Mode,
    Policy,
    PriorityCall,
    Site,
    Status,
    Turn,
)

LEAD_NS = 20 * NS_PER_S  # before an arrival help begins
LATE_NS = 10 * NS_PER_S  # after an estimated arrival it ends: a vehicle may be late
EXTEND_NS = 8 * NS_PER_S  # of green beyond max, for one vehicle


class Memory(NamedTuple):
    """Of the rings, and for how long each phase's green has been helped [ns]."""

    actuated: actuated.Memory
    helped_ns: tuple[int, ...]


def start(site: Site) -> Memory:
    """Begin with nobody helped."""
    return Memory(actuated.start(site), (0,) * len(site.program.groups))


def step(site: Site, memory: Memory, view: JunctionView) -> tuple[Memory, Answer]:
    """Step the rings, with the priority requests among their inputs."""
    ring_inputs = inputs_of(site, memory.actuated, view)
    near = [one for one in view.priority if _is_due(one, view.now_ns)]
    urgent = _of_role(near, "emergency", site)
    preempt = urgent[0].group if urgent else None
    if preempt and not groups_of(view.overrides, "preempt"):
        (phase,) = numbers(site, frozenset((preempt,)))
        ring_inputs = RingInputs(ring_inputs.inputs._replace(preempt=phase), ring_inputs.sees)
    elif not urgent:
        ring_inputs = _helped(site, memory, view, ring_inputs, _of_role(near, "transit", site))
    after = actuated.ride(site, memory.actuated, view, ring_inputs)
    requested = named(site, rings.requested(after.rings))
    status = {one.key: _status(one, site, view, requested, preempt) for one in view.priority}
    is_preempted = ring_inputs.inputs.preempt is not None
    mode: Mode = "preempt" if is_preempted else "priority" if near else "adaptive"
    return Memory(after, _count(site, memory, view, near)), Answer(requested, status, mode)


def foresee(site: Site, memory: Memory, view: JunctionView) -> tuple[Turn, ...]:
    """Return the turns of the rings, as long as nobody is to be helped."""
    if any(_is_due(one, view.now_ns) for one in view.priority):
        return ()
    return actuated.foresee(site, memory.actuated, view)


def _is_due(one: PriorityCall, now_ns: int) -> bool:
    return one.eta_ns is None or one.eta_ns - LEAD_NS <= now_ns <= one.eta_ns + LATE_NS


def _of_role(near: Iterable[PriorityCall], role: str, site: Site) -> list[PriorityCall]:
    return [one for one in near if one.role == role and one.group in site.program.groups]


def _helped(
    site: Site,
    memory: Memory,
    view: JunctionView,
    ring_inputs: RingInputs,
    transit: list[PriorityCall],
) -> RingInputs:
    """Return the inputs of the rings with green extensions and early greens."""
    wanted = numbers(site, frozenset(one.group for one in transit))
    green = rings.green_in(view.state)
    extended = {i for i in wanted & green if memory.helped_ns[i] < EXTEND_NS}
    conflicting = {
        i
        for i in green - wanted
        for red in wanted - green
        if frozenset((site.program.groups[i], site.program.groups[red])) in site.program.conflicts
    }
    inputs = ring_inputs.inputs._replace(
        calls=ring_inputs.inputs.calls | wanted,
        hold=ring_inputs.inputs.hold | extended,
        force_off=(ring_inputs.inputs.force_off | conflicting) - extended,
    )
    return RingInputs(inputs, ring_inputs.sees)


def _count(
    site: Site, memory: Memory, view: JunctionView, near: list[PriorityCall]
) -> tuple[int, ...]:
    """Return for how long each green has been helped; a new green counts anew."""
    wanted = {one.group for one in _of_role(near, "transit", site)}
    return tuple(
        helped + (view.dt_ns if name in wanted else 0) if group.phase is Phase.GREEN else 0
        for name, group, helped in zip(
            site.program.groups, view.state, memory.helped_ns, strict=True
        )
    )


def _status(
    one: PriorityCall,
    site: Site,
    view: JunctionView,
    requested: frozenset[str],
    preempt: str | None,
) -> Status:
    if one.group not in site.program.groups or one.role not in ("emergency", "transit"):
        return "rejected"
    if not _is_due(one, view.now_ns):
        return "requested"
    is_green = view.state[site.program.groups.index(one.group)].phase is Phase.GREEN
    is_first = preempt is None or one.group == preempt
    return "granted" if is_green and one.group in requested and is_first else "processing"


POLICY = Policy(
    "priority: actuated, and help for buses and emergency vehicles",
    start,
    step,
    foresee=foresee,
)
