"""One junction's controller: kernel, policy and overrides in force, and their SPaT.

It starts all red. Under a timetable it runs cycles of a plan and changes to another plan, or
another policy, when a cycle ends and no red has a guaranteed end any more; from any other policy it
returns to the timetable through a clearance. A gate between policy and kernel ensures that no
request begins or ends a colour against a time guaranteed in SPaT. While there is a reason to flash
it flashes red; then it restarts through all red.
"""

from collections.abc import Callable, Mapping
from typing import Any

from scm.errors import PlanError, nearest
from scm.records.signal_plans import SignalStage
from scm.records.signals import Colour, SignalGroup
from scm.traffic.signals import kernel, operator_overrides
from scm.traffic.signals.controller_state import (
    COLOUR_OF,
    NO_OBSERVATIONS,
    LastShown,
    Observations,
    Outlook,
    PolicyState,
    ShownColour,
    ShownColours,
    StepTimes,
    Timing,
)
from scm.traffic.signals.custom_plans import retimed, stages_of
from scm.traffic.signals.forecast import Coming, forecasts, schedule
from scm.traffic.signals.green_wave import Wave
from scm.traffic.signals.guaranteed_time import (
    GuaranteedTime,
    earliest_green,
    end_after,
    red_end,
    requested_green,
    still_ns,
)
from scm.traffic.signals.kernel import Program
from scm.traffic.signals.operator_overrides import NEED_RINGS, Override
from scm.traffic.signals.plan import FLASH, Timetable, load_timetable, plan_names
from scm.traffic.signals.policy import (
    FIXED,
    JunctionView,
    Status,
    check_groups,
    known_plan,
    load_policy,
    policy_names,
    site_of,
)
from scm.traffic.signals.program import STEP_NS
from scm.traffic.signals.timetables import Tables, Timetables
from scm.traffic.signals.timing import NIGEL, CarFacts
from scm.v2x.messages.signal_request import SignalRequest
from scm.v2x.messages.spat import Spat

LATE_STEP_NS = 3 * STEP_NS  # a longer step puts the cycle off
FORECAST_EVERY_NS = 5 * STEP_NS
POLICY_FOR_OVERRIDES = "actuated"  # a timetable cannot hold or omit a group


class Controller:
    """The signals of one junction; the time comes with every step.

    Attributes:
        mode: `start`, `plan`, `flash`, or the policy's: `adaptive`, `priority`, `preempt`.
        policy: In force, also while flashing.
        overrides: Of operators and scripts, in force.
        priority: The status of each vehicle's request, by its key.
        failure: Why a policy was replaced by fixed time; empty: none was.
        changed: Whether the last step changed a colour.
        late_steps: How many steps were so late that they put the cycle off.
        program: Of the kernel, in force.
    """

    def __init__(
        self,
        junction: str,
        program: Program,
        plan: str,
        revision: int = 1,
        *,
        policy: str = FIXED,
        tables: Tables | None = None,
        learned: Callable[[Any], Any] | None = None,
        car: CarFacts = NIGEL,
    ) -> None:
        """Set up a junction.

        Args:
            junction: Its name.
            program: Of its kernel.
            plan: Of the timetable to begin with.
            revision: Of the map.
            policy: To run while nobody requests another one.
            tables: Timetables by plan, in step with the neighbours; None: all plans, alone.
            learned: For the policy `learned`.
            car: As bad as the worst of the fleet: how fast a queue leaves.

        Raises:
            PlanError: when there is no such plan or policy, or a plan is not safe.
        """
        self.junction = junction
        self.program = program
        self._revision = revision
        tables = tables or {name: (load_timetable(name, program), None) for name in plan_names()}
        self._timetables = Timetables(tables, known_plan(junction, plan, tables))
        self._site = site_of(junction, program, learned, car)
        self._policies = {name: load_policy(name) for name in policy_names()}
        self._policy_state = PolicyState(self._checked_policy(policy))
        self.policy = FIXED
        self.overrides: tuple[Override, ...] = ()
        self.priority: Mapping[tuple[int, int], Status] = {}
        self.failure = ""
        self.mode = "start"
        self.changed = False
        self.late_steps = 0
        self._next_timing: Timing | None = None
        self._custom_stages = dict[str, tuple[SignalStage, ...]]()
        self._flash_reasons: set[str] = set()
        self._state = kernel.start(program)
        self._shown = ShownColours(program)
        self._requested: frozenset[str] = frozenset()
        self._times = StepTimes()
        self._seq = 0
        self._outlook = Outlook()
        self._last = LastShown()
        self._restart_ns = max(times.clearance for times in program.times) + STEP_NS

    @property
    def plan(self) -> str:
        """The plan in force, also while flashing or under another policy."""
        return self._timetables.plan

    @property
    def custom_plan(self) -> tuple[Timetable, Wave | None] | None:
        """The plan in force if it is a custom one; None: it is one of the junction's own."""
        return self._timetables.custom_plan

    @property
    def running(self) -> str:
        """What is in force, in one word: the plan of a timetable, or the policy."""
        return self.plan if self._policies[self.policy].is_timed else self.policy

    @property
    def pending(self) -> str:
        """What was requested and comes at the next safe moment; empty: nothing."""
        target = self._target_policy()
        if target == self.policy:
            return self._timetables.pending if target == FIXED else ""
        return (self._timetables.pending or self.plan) if target == FIXED else target

    @property
    def is_flashing(self) -> bool:
        """Whether there is a reason to flash, from the next step on."""
        return bool(self._flash_reasons) or self._policies[self._target_policy()].is_flash

    @property
    def needs_detectors(self) -> bool:
        """Whether what runs, or what is to come, needs the cars' positions."""
        running, coming = self._policies[self.policy], self._policies[self._target_policy()]
        return running.needs_detectors or coming.needs_detectors

    def request_plan(self, plan: str) -> None:
        """Request a plan, and with it fixed time, or a policy, until further notice.

        Raises:
            PlanError: when there is no such plan or policy.
        """
        plans = self._timetables.names
        if plan not in plans and plan in self._policies:
            self._policy_state.default = plan
        else:
            self._timetables.request(known_plan(self.junction, plan, plans))
            self._policy_state.default = FIXED
        self.failure = self._policy_state.failed = ""

    def end_flash(self) -> bool:
        """Make the timetable the default if flashing was; return whether it was."""
        was_default = self._policies[self._policy_state.default].is_flash
        if was_default:
            self._policy_state.default = FIXED
        return was_default

    def request_custom_plan(self, table: Timetable, wave: Wave | None = None) -> None:
        """Request a custom plan; it comes once every guaranteed time allows for it."""
        self._timetables.offer_custom_plan(table, wave)
        self._custom_stages[table.plan] = stages_of(table, self.program)
        self._policy_state.default = FIXED
        self.failure = self._policy_state.failed = ""

    def request_timing(self, timing: Timing) -> None:
        """Request other least times; they come when all is red and no time is guaranteed."""
        self._next_timing = None if timing.program is self.program else timing

    def outlook(self, now_ns: int) -> tuple[Coming, ...]:
        """Return the greens to come, as the timetable says or the policy foresees."""
        if self.mode == FLASH:
            return ()
        return self._timetables.outlook(now_ns) if self.policy == FIXED else self._outlook.coming

    def apply_override(self, request: SignalRequest, now_ns: int) -> None:
        """Apply an override of an operator or a script.

        Raises:
            PlanError: saying why it is refused.
        """
        self.overrides = operator_overrides.apply(
            self.overrides, request, self.program, self._policies, now_ns
        )
        if request.verb == "policy":
            self.failure = self._policy_state.failed = ""

    def flash(self, reason: str, *, on: bool) -> None:
        """Add or remove a reason to flash; flashing ends with the last reason."""
        if on:
            self._flash_reasons.add(reason)
        else:
            self._flash_reasons.discard(reason)

    def step(self, now_ns: int, observations: Observations = NO_OBSERVATIONS) -> None:
        """Advance to `now_ns`."""
        dt_ns = self._elapsed_ns(now_ns)
        if self.overrides:
            self.overrides = operator_overrides.expire(
                self.overrides, now_ns, *self._shown.changed_at(self._times.shown_ns)
            )
        if self.is_flashing:
            self._use_timing(now_ns)
            self.mode = FLASH
            self.priority = {one.key: "rejected" for one in observations.priority}
            requested: frozenset[str] = frozenset()
        else:
            self._requested = self._next_requests(now_ns, dt_ns, observations)
            requested = self._shown.gate(self._requested, now_ns)
        self._state = kernel.step(
            self.program, self._state, requested, dt_ns, flash=self.mode == FLASH
        )
        self._show(now_ns)
        if self.changed or now_ns - self._outlook.updated_ns >= FORECAST_EVERY_NS:
            self._foresee(now_ns, observations)

    def spat(self, now_ns: int) -> Spat:
        """Return what is shown, for the step that was just made."""
        self._seq += 1
        return Spat(
            junction=self.junction,
            t_ns=now_ns,
            seq=self._seq,
            mode=self.mode,
            plan=self.running,
            groups=self._signal_groups(now_ns),
            revision=self._revision,
        )

    def _checked_policy(self, policy: str) -> str:
        if policy not in self._policies:
            names = list(self._policies)
            hint = nearest(policy, names)
            msg = f"junction {self.junction}: no policy {policy!r}{hint}, only {names}"
            raise PlanError(msg)
        return policy

    def _target_policy(self) -> str:
        """Return the policy that should run: requested, default, or one that overrides need."""
        target = self._policy_state.default
        if self.overrides:
            requested = (one.policy for one in self.overrides if one.verb == "policy")
            target = next(requested, target)
        policy = FIXED if target == self._policy_state.failed else target
        if not self.overrides:
            return policy
        needs_rings = any(one.verb in NEED_RINGS for one in self.overrides)
        needs_override_policy = (
            needs_rings
            and self._policies[policy].is_timed
            and self._policy_state.failed != POLICY_FOR_OVERRIDES
        )
        return POLICY_FOR_OVERRIDES if needs_override_policy else policy

    def _elapsed_ns(self, now_ns: int) -> int:
        """Return the time since the last step; a late step puts the cycle off."""
        if self._times.last_ns is None:
            self._times.last_ns = now_ns
            self._restart_cycle(now_ns)
        dt_ns = now_ns - self._times.last_ns
        self._times.last_ns = now_ns
        self._times.is_late = dt_ns > LATE_STEP_NS
        if self._times.is_late:
            self.late_steps += 1
            self._timetables.put_off(dt_ns - STEP_NS)
        return dt_ns

    def _restart_cycle(self, now_ns: int) -> None:
        self.mode = "start"
        self.policy = FIXED
        self._timetables.clear(now_ns, now_ns + self._restart_ns)

    def _next_requests(self, now_ns: int, dt_ns: int, observations: Observations) -> frozenset[str]:
        """Return what timetable or policy requests now; change between them if it is due."""
        if self.mode == FLASH:
            self._restart_cycle(now_ns)
        target = self._target_policy()
        if self.policy != FIXED:
            if target == FIXED or (self._next_timing is not None and self.mode != "preempt"):
                self._return_to_timetable(now_ns)
            elif target != self.policy:
                self._begin_policy(target)
        elif now_ns >= self._timetables.cycle.ends_ns:
            self._end_cycle(target, now_ns)
        if self.policy == FIXED:
            self.priority = {one.key: "rejected" for one in observations.priority}
            self._timetables.commit_next(now_ns, goes_on=self._goes_on())
            return self._timetables.requested(now_ns)
        return self._step_policy(now_ns, dt_ns, observations)

    def _end_cycle(self, target: str, now_ns: int) -> None:
        """Begin what follows a cycle of the timetable: other times, a policy, or the next cycle."""
        if not self._shown.has_guaranteed_red_end():
            if self._next_timing is not None and kernel.is_all_red(self._state):
                self._use_timing(now_ns)
                self._state = kernel.start(self.program)
                self.mode = "start"
                return
            if target != FIXED and self._next_timing is None:
                self._begin_policy(target)
                return
        self._timetables.next_cycle()
        self.mode = "plan"

    def _goes_on(self) -> bool:
        """Return whether another cycle of the timetable follows this one."""
        return self._target_policy() == FIXED and self._next_timing is None

    def _use_timing(self, now_ns: int) -> None:
        """Use the times that were requested, if any; all groups are red or flash."""
        if (timing := self._next_timing) is None:
            return
        self.program, self._next_timing = timing.program, None
        self._site = site_of(self.junction, timing.program, self._site.learned, timing.car)
        custom = {
            name: (retimed(name, self._custom_stages[name], timing.program), wave)
            for name, (_, wave) in self._timetables.custom_plans.items()
        }
        self._timetables.retime(timing.tables, custom)
        self._restart_ns = max(times.clearance for times in timing.program.times) + STEP_NS
        self._timetables.clear(now_ns, now_ns + self._restart_ns)

    def _begin_policy(self, name: str) -> None:
        self.policy = name
        self._policy_state.memory = self._policies[name].start(self._site)

    def _return_to_timetable(self, now_ns: int) -> None:
        """Clear the junction, then begin a cycle."""
        self.mode, self.policy = "start", FIXED
        ends = self._shown.guarantees()
        left = [
            still_ns(self._state, i, times, ends[i], now_ns)
            for i, times in enumerate(self.program.times)
        ]
        self._timetables.clear(now_ns, now_ns + max(left) + 3 * STEP_NS)

    def _step_policy(self, now_ns: int, dt_ns: int, observations: Observations) -> frozenset[str]:
        view = self._view(now_ns, dt_ns, observations)
        try:
            self._policy_state.memory, answer = self._policies[self.policy].step(
                self._site, self._policy_state.memory, view
            )
            check_groups(answer, self.program)
        except Exception as cause:  # noqa: BLE001 a policy is a plug-in: signals go on whatever it does
            self._fail(cause)
            self._return_to_timetable(now_ns)
            return frozenset()
        self.mode, self.priority = answer.mode, answer.priority
        return operator_overrides.applied(
            self.overrides, answer.groups, self._shown.green(), holds=self.mode != "preempt"
        )

    def _fail(self, cause: Exception) -> None:
        self._policy_state.failed = self.policy
        self.failure = f"policy {self.policy}: {type(cause).__name__}: {cause}"

    def _view(self, now_ns: int, dt_ns: int, observations: Observations) -> JunctionView:
        return JunctionView(
            now_ns, dt_ns, self._state, observations.detectors, observations.sees, self.overrides,
            observations.priority, self._timetables.requested(now_ns),
        )  # fmt: skip

    def _foresee(self, now_ns: int, observations: Observations) -> None:
        """Update when the present colours will likely end, by timetable or policy."""
        self._outlook.updated_ns = now_ns
        self._outlook.ends, self._outlook.coming = {}, ()
        self._last.groups = None
        if self.mode == FLASH:
            return
        if self.policy == FIXED:
            if self._goes_on():
                self._outlook.ends = {
                    name: self._timetables.likely_end_ns(name, now_ns, red=shown.colour == "red")
                    for name, shown in self._shown.items()
                    if not shown.guaranteed.is_exact
                }
            return
        view, guarantees = self._view(now_ns, 0, observations), self._shown.guarantees()
        try:
            turns = self._policies[self.policy].foresee(self._site, self._policy_state.memory, view)
            self._outlook.coming = tuple(
                schedule(self.program, self._state, guarantees, turns, now_ns)
            )
            self._outlook.ends = forecasts(self.program, self._state, self._outlook.coming)
        except Exception as cause:  # noqa: BLE001 as above; the next step replaces it
            self._fail(cause)

    def _show(self, now_ns: int) -> None:
        """Show the kernel's phases, and guarantee when they end."""
        self.changed = False
        self._times.shown_ns = now_ns
        if self._is_as_shown(now_ns):
            return
        before = self._shown.guarantees()
        for index, name in enumerate(self.program.groups):
            colour = COLOUR_OF[self._state[index].phase]
            shown = self._shown.get(name)
            if shown is None or shown.colour != colour:
                self.changed = True
                guaranteed = self._guarantee_of(index, colour, now_ns, before)
                self._shown[name] = ShownColour(colour, now_ns, guaranteed)
            elif colour == "red":
                guaranteed = self._guarantee_of(index, colour, now_ns, before)
                shown.guaranteed = (
                    guaranteed if self._times.is_late else shown.guaranteed.narrowed(guaranteed)
                )
            elif colour == "green" and not shown.guaranteed.is_exact:
                shown.guaranteed = self._of_green(index, shown, now_ns)

    def _is_as_shown(self, now_ns: int) -> bool:
        """Return whether all that guaranteed times follow from is as at the last step.

        A timetable gives them until its next stage begins or ends; another policy may change them
        at every step.
        """
        last, timetables = self._last, self._timetables
        basis = (
            [group.phase for group in self._state],
            self._target_policy(),
            self._next_timing is None,
            timetables.cycle,
            timetables.staying_green,
        )
        is_timed = self.policy == FIXED and not self._times.is_late
        if is_timed and now_ns < last.until_ns and basis == last.basis:
            return True
        last.basis, last.groups = basis, None
        last.until_ns = timetables.cycle.next_change_ns(now_ns) if is_timed else now_ns
        return False

    def _of_green(self, index: int, shown: ShownColour, now_ns: int) -> GuaranteedTime:
        """Return the guaranteed time of a green whose end was not known."""
        name, least_ns = self.program.groups[index], self.program.times[index].min_green
        if self.policy != FIXED or self._timetables.cycle.timetable is None:
            return requested_green(
                shown.guaranteed, now_ns, least_ns, requested=name in self._requested
            )
        guaranteed = self._timetables.green_end(name, now_ns, shown.since_ns + least_ns)
        return guaranteed if self._times.is_late else shown.guaranteed.narrowed(guaranteed)

    def _guarantee_of(
        self, index: int, colour: Colour, now_ns: int, before: list[GuaranteedTime | None]
    ) -> GuaranteedTime:
        name, times = self.program.groups[index], self.program.times[index]
        is_timed = self.policy == FIXED
        match colour:
            case "red" if is_timed:
                plans = self._timetables.coming if self._goes_on() else ()
                return red_end(name, self._timetables.cycle, now_ns, plans)
            case "red":
                return earliest_green(self.program, self._state, index, before, now_ns)
            case "green" if is_timed:
                return self._timetables.green_end(name, now_ns, now_ns + times.min_green)
            case "green":
                return requested_green(None, now_ns, times.min_green, requested=True)
            case "yellow":
                return end_after(now_ns + times.yellow)
            case _:
                return GuaranteedTime(now_ns, None)

    def _signal_groups(self, now_ns: int) -> tuple[SignalGroup, ...]:
        """Return what all groups show; at most steps that is as before."""
        last = self._last
        if last.groups is None or now_ns > last.groups_until_ns:
            planned = None if self.mode == FLASH else self.policy == FIXED
            last.groups = tuple(
                shown.as_published(name, self._outlook.ends.get(name), now_ns, planned=planned)
                for name, shown in self._shown.items()
            )
            ends = [one.likely_end_ns for one in last.groups if one.likely_end_ns is not None]
            last.groups_until_ns = min(ends, default=last.until_ns)
        return last.groups
