"""Checks of a junction when it is loaded: its rings, and that policies and plans serve everybody.

The rings are proven for the junction's shape (`override_proof.py`). Each policy, and each plan's
timetable, runs over the kernel at the junction's real times: with all groups called, and with each
one called alone, every called group is green within a bound. Junctions with equal programs are
checked once per process.
"""

from collections.abc import Iterable
from functools import cache

from scm.errors import PlanError
from scm.traffic.signals import kernel
from scm.traffic.signals.detectors import Detector
from scm.traffic.signals.kernel import Phase, Program
from scm.traffic.signals.plan import Timetable
from scm.traffic.signals.policies.max_pressure import STARVED_NS
from scm.traffic.signals.policy import JunctionView, Policy, load_policy, policy_names, site_of
from scm.traffic.signals.program import STEP_NS
from scm.traffic.signals.proof.override_proof import check_rings

COARSE_NS = 5 * STEP_NS
THERE = Detector(call=True, extend=True, presence=True, near=3, queue=3)
NOBODY = Detector()


def check_junction(junction: str, program: Program, tables: Iterable[Timetable]) -> None:
    """Check everything that may run at a junction.

    Raises:
        PlanError: naming the junction, and who is not served under what.
    """
    check_rings(junction, program)
    try:
        for name in policy_names():
            _check_policy(name, program)
        for table in tables:
            check_table(table, program)
    except PlanError as wrong:
        raise PlanError(f"junction {junction}: {wrong}") from wrong


def check_table(table: Timetable, program: Program) -> None:
    """Run a timetable twice over the kernel.

    Raises:
        PlanError: naming a group that is not green in every cycle.
    """
    state = kernel.start(program)
    for cycle in range(2):
        shown = set[str]()
        for at_ns in range(0, table.length_ns, STEP_NS):
            requested = table.requested(at_ns, table.into(table))
            state = kernel.step(program, state, requested, STEP_NS)
            shown |= _green(program, state)
        if cycle and shown != set(program.groups):
            late = sorted(set(program.groups) - shown)
            raise PlanError(f"plan {table.plan!r}: {late} not green in every cycle")


@cache
def _check_policy(name: str, program: Program) -> None:
    policy = load_policy(name)
    if policy.is_timed or policy.is_flash or name == "learned":
        return
    for called in (frozenset(program.groups), *(frozenset((one,)) for one in program.groups)):
        check_called_groups_are_served(name, policy, program, called)


def check_called_groups_are_served(
    name: str, policy: Policy, program: Program, called: frozenset[str]
) -> None:
    """Run a policy over the kernel while these groups are called all the time.

    Raises:
        PlanError: naming a called group that is not green within the bound.
    """
    site = site_of("", program)
    memory, state, now_ns = policy.start(site), kernel.start(program), 0
    cars = {group: THERE if group in called else NOBODY for group in program.groups}
    missing = set(called)
    for now_ns in range(0, bound_ns(program), COARSE_NS):
        view = JunctionView(now_ns, COARSE_NS, state, cars, sees=True)
        memory, answer = policy.step(site, memory, view)
        state = kernel.step(program, state, answer.groups, COARSE_NS)
        missing -= _green(program, state)
        if not missing:
            return
    text = f"{sorted(missing)} called and not green within {now_ns / 1e9:g} s"
    raise PlanError(f"policy {name!r}: {text}")


def bound_ns(program: Program) -> int:
    """Return how long a called group may wait at the most while all are called [ns]."""
    phases = site_of("", program).layout.phases
    rounds = (p.max2 + sum(t) for p, t in zip(phases, program.times, strict=True))
    return 2 * sum(rounds) + len(phases) * STARVED_NS


def _green(program: Program, state: kernel.State) -> set[str]:
    pairs = zip(program.groups, state, strict=True)
    return {name for name, group in pairs if group.phase is Phase.GREEN}
