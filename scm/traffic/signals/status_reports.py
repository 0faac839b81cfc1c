"""Reports on a junction beside its colours: its program, what runs, and requests in force."""

from collections.abc import Collection, Iterable, Mapping

from msgspec.structs import replace

from scm import registry
from scm.clock import NS_PER_S
from scm.errors import PlanError
from scm.records.signal_plans import SignalPhase, SignalPlan, SignalPolicy, StageInterval
from scm.records.signals import SignalDetector, SignalOverride, SignalTurn
from scm.traffic.signals.controller import Controller
from scm.traffic.signals.custom_plans import OWN, stages_of
from scm.traffic.signals.detectors import Detector
from scm.traffic.signals.green_wave import Wave
from scm.traffic.signals.kernel import Program
from scm.traffic.signals.operator_overrides import Override
from scm.traffic.signals.plan import PACKAGE, Plan, Timetable
from scm.traffic.signals.policy import load_policy, policy_names, site_of
from scm.traffic.signals.program import STEP_NS
from scm.traffic.signals.timetables import Tables
from scm.v2x.exchange import Outgoing
from scm.v2x.messages.signal_site import SignalSite
from scm.v2x.messages.signal_status import SignalStatus

SITE_EVERY_NS = 10 * NS_PER_S
STATUS_EVERY_NS = NS_PER_S
EARLY_NS = STEP_NS // 2


class StatusReports:
    """Makes one junction's `SignalSite` and `SignalStatus` when they are due.

    Attributes:
        program: Of its kernel.
        site: What it is, as of the time 0.
    """

    def __init__(self, junction: str, program: Program, tables: Tables) -> None:
        self.program = program
        self.site = _site(junction, program, tables)
        self._site_ns: int | None = None
        self._status_ns: int | None = None
        self._before: tuple[object, ...] = ()

    def due(
        self, controller: Controller, detectors: Mapping[str, Detector], now_ns: int
    ) -> list[Outgoing]:
        """Return what is due at a step that was just made."""
        messages: list[Outgoing] = []
        if is_due(self._site_ns, now_ns, SITE_EVERY_NS):
            self._site_ns = now_ns
            messages.append(replace(self.site, t_ns=now_ns))
        what = (controller.policy, controller.plan, controller.pending, controller.overrides)
        if what != self._before or is_due(self._status_ns, now_ns, STATUS_EVERY_NS):
            self._before, self._status_ns = what, now_ns
            messages.append(self._status(controller, detectors, now_ns))
        return messages

    def _status(
        self, controller: Controller, detectors: Mapping[str, Detector], now_ns: int
    ) -> SignalStatus:
        table, wave = controller.custom_plan or (None, None)
        return SignalStatus(
            junction=self.site.junction,
            t_ns=now_ns,
            policy=controller.policy,
            plan=controller.plan,
            pending=controller.pending,
            wishes=override_records(controller.overrides),
            detectors=tuple(
                SignalDetector(group=name, call=one.call, queue=one.queue)
                for name, one in detectors.items()
            ),
            turns=tuple(
                SignalTurn(
                    groups=self._in_order(turn.groups), start_ns=turn.start_ns, end_ns=turn.end_ns
                )
                for turn in controller.outlook(now_ns)
            ),
            failure=controller.failure,
            stages=() if table is None else stages_of(table, self.program),
            offset_s=None if wave is None else wave.offset_ns / NS_PER_S,
        )

    def _in_order(self, groups: Collection[str]) -> tuple[str, ...]:
        return tuple(name for name in self.program.groups if name in groups)


def override_records(overrides: Iterable[Override]) -> tuple[SignalOverride, ...]:
    """Return the overrides in force as they are published."""
    return tuple(
        SignalOverride(
            verb=one.verb,
            groups=one.groups,
            by=one.by,
            reason=one.reason,
            ends_ns=one.until_ns,
            policy=one.policy,
        )
        for one in overrides
    )


def is_due(sent_ns: int | None, now_ns: int, every_ns: int) -> bool:
    """Return whether something is to be sent again, at the step nearest to its time."""
    return sent_ns is None or now_ns - sent_ns >= every_ns - EARLY_NS


def _site(junction: str, program: Program, tables: Tables) -> SignalSite:
    layout = site_of(junction, program).layout
    names = program.groups
    phases = zip(names, program.times, layout.phases, strict=True)
    policies = ((name, load_policy(name)) for name in policy_names())
    return SignalSite(
        junction=junction,
        t_ns=0,
        phases=tuple(
            SignalPhase(
                group=name,
                min_green_s=times.min_green / NS_PER_S,
                yellow_s=times.yellow / NS_PER_S,
                red_clear_s=times.clearance / NS_PER_S,
                passage_s=phase.passage / NS_PER_S,
                max1_s=phase.max1 / NS_PER_S,
                max2_s=phase.max2 / NS_PER_S,
            )
            for name, times, phase in phases
        ),
        conflicts=tuple(
            (one, other)
            for at, one in enumerate(names)
            for other in names[at + 1 :]
            if frozenset((one, other)) in program.conflicts
        ),
        rings=tuple(
            tuple(tuple(names[i] for i in sequence) for sequence in section)
            for section in layout.sections
        ),
        plans=tuple(_plan(table, program, wave) for table, wave in tables.values()),
        policies=tuple(
            SignalPolicy(policy=name, about=one.about, has_detectors=one.needs_detectors)
            for name, one in policies
        ),
    )


def _plan(table: Timetable, program: Program, wave: Wave | None) -> SignalPlan:
    if table.plan == OWN:
        about = "the stages of the map"
    else:
        about = registry.load(PACKAGE, table.plan, "PLAN", Plan, error=PlanError).about
    return SignalPlan(
        plan=table.plan,
        about=about,
        cycle_s=table.length_ns / NS_PER_S,
        stages=stages_of(table, program),
        slots=tuple(
            StageInterval(
                groups=tuple(name for name in program.groups if name in timed.groups),
                start_s=timed.start_ns / NS_PER_S,
                end_s=timed.end_ns / NS_PER_S,
            )
            for timed in table.timed_stages
        ),
        in_step=wave is not None,
        offset_s=None if wave is None else wave.offset_ns / NS_PER_S,
    )
