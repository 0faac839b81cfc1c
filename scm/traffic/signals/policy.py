"""The contract of a policy: from a view of one junction to requests for green.

A policy is one file of `policies/` with a constant `POLICY`. It keeps a memory that only it reads
and that is never changed, only replaced. Whatever it answers, the kernel decides the colours and
the controller keeps published guarantees; so a policy can be slow or wrong, never unsafe.
"""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

from scm import registry
from scm.errors import PlanError, nearest
from scm.traffic.signals.detectors import Detector
from scm.traffic.signals.guaranteed_time import GREEN_NOTICE_NS
from scm.traffic.signals.kernel import GroupTimes, Program, State
from scm.traffic.signals.operator_overrides import Override
from scm.traffic.signals.plan import FLASH
from scm.traffic.signals.rings import Layout, PhaseTimes, layout_of
from scm.traffic.signals.timing import NIGEL, CarFacts, headway_s

PACKAGE = "scm.traffic.signals.policies"
FIXED = "fixed"

PASSAGE_NS = 200_000_000  # detectors already look ahead, so the gap itself is short
MAX1_GREENS, MAX2_GREENS = 3, 5  # least greens that make max 1 and max 2

Mode = Literal["adaptive", "priority", "preempt"]
Status = Literal["requested", "processing", "granted", "rejected"]


class PriorityCall(NamedTuple):
    """A vehicle's request for its green.

    Attributes:
        key: (station, request id).
        group: The signal group of its way; empty: no such way here.
        eta_ns: When it expects to be at the stop line; None: not given.
        role: `emergency` pre-empts, `transit` is helped; others are rejected.
        until_ns: When the request expires.
    """

    key: tuple[int, int]
    group: str
    eta_ns: int | None
    role: str
    until_ns: int


@dataclass(frozen=True, slots=True)
class Site:
    """The constant facts of a policy's junction.

    Attributes:
        layout: Its rings and barriers.
        headway_s: Between cars that leave a queue.
    """

    junction: str
    program: Program
    layout: Layout
    headway_s: float
    learned: Callable[[Any], Any] | None = None


@dataclass(frozen=True, slots=True)
class JunctionView:
    """What a policy is shown at one step.

    Attributes:
        dt_ns: Since the last step.
        state: Of the kernel, in the order of the program's groups.
        detectors: By group.
        sees: Whether detectors received any car lately; if not, they are not reliable.
        overrides: Of operators and scripts, in force.
        priority: Requests of vehicles in force.
        timetabled: What the timetable of the plan in force requests now.
    """

    now_ns: int
    dt_ns: int
    state: State
    detectors: Mapping[str, Detector] = field(default_factory=dict)
    sees: bool = False
    overrides: tuple[Override, ...] = ()
    priority: tuple[PriorityCall, ...] = ()
    timetabled: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True)
class Answer:
    """What a policy requests.

    Attributes:
        groups: That would like green now.
        priority: What became of each vehicle's request, by its key.
        mode: As in `Spat`: `adaptive`, `priority` or `preempt`.
    """

    groups: frozenset[str]
    priority: Mapping[tuple[int, int], Status] = field(default_factory=dict)
    mode: Mode = "adaptive"


class Turn(NamedTuple):
    """What a policy foresees: groups that are green together, and for how long.

    Attributes:
        groups: Without conflict.
        green_s: From now, of groups that are green; else from their begin. None: unlimited, or
            unknown.
    """

    groups: frozenset[str]
    green_s: float | None


def foresees_nothing(site: Site, memory: Any, view: JunctionView) -> tuple[Turn, ...]:
    """Return the outlook of a policy that has none."""
    del site, memory, view
    return ()


@dataclass(frozen=True, slots=True)
class Policy:
    """A plug-in: what it is for, in one sentence, and what it does.

    Attributes:
        start: Makes its memory.
        step: From memory and view to the next memory and an answer.
        foresee: From the memory after a step and its view to the turns to come, the present green
            first, as if no further cars appeared. SPaT publishes them as likely ends.
        is_timed: Whether it follows the timetable, so that Spat can guarantee its times.
        is_flash: Whether it is flashing red.
        needs_detectors: Whether it needs the cars' positions.
    """

    about: str
    start: Callable[[Site], Any]
    step: Callable[[Site, Any, JunctionView], tuple[Any, Answer]]
    is_timed: bool = False
    is_flash: bool = False
    needs_detectors: bool = True
    foresee: Callable[[Site, Any, JunctionView], tuple[Turn, ...]] = foresees_nothing


def policy_names() -> list[str]:
    """Return the names of all policies that can be requested."""
    return registry.names(PACKAGE)


def load_policy(name: str) -> Policy:
    """Return a policy by name.

    Raises:
        PlanError: when there is none.
    """
    return registry.load(PACKAGE, name, "POLICY", Policy, error=PlanError)


def known_plan(junction: str, plan: str, plans: Collection[str]) -> str:
    """Return the name of a plan.

    Raises:
        PlanError: when it is none of those that a junction has.
    """
    if plan not in plans:
        names = [*plans, *policy_names(), FLASH]
        msg = f"junction {junction}: no plan {plan!r}{nearest(plan, names)}, only {names}"
        raise PlanError(msg)
    return plan


def check_groups(answer: Answer, program: Program) -> None:
    """Refuse an answer of a policy that names other groups than the junction's.

    Raises:
        PlanError: naming them.
    """
    unknown = [group for group in answer.groups if group not in program.groups]
    if unknown:
        msg = f"wishes {unknown}, expected groups of {list(program.groups)}"
        raise PlanError(msg)


def site_of(
    junction: str,
    program: Program,
    learned: Callable[[Any], Any] | None = None,
    car: CarFacts = NIGEL,
) -> Site:
    """Return the site of a junction; max 1 is three least greens, max 2 is five, as shown."""
    phases = tuple(
        PhaseTimes(t.min_green, PASSAGE_NS, _most_ns(t, MAX1_GREENS), _most_ns(t, MAX2_GREENS))
        for t in program.times
    )
    return Site(junction, program, layout_of(program, phases), headway_s(car), learned)


def _most_ns(times: GroupTimes, greens: int) -> int:
    """Return when the end of a green is decided at the latest, before its guaranteed notice."""
    return max(times.min_green, greens * times.min_green - GREEN_NOTICE_NS)


def nothing(site: Site) -> None:
    """Return the memory of a policy that has none."""
    del site
