"""One junction of the traffic part: its controller, its detectors, and pending messages."""

from collections.abc import Mapping
from typing import Literal

from msgspec.structs import replace

from scm.clock import NS_PER_MS
from scm.records.city_map import Junction
from scm.store.records import PlanRecord
from scm.traffic.signals.controller import Controller
from scm.traffic.signals.controller_state import Observations, Timing
from scm.traffic.signals.custom_plans import (
    check_plan_name,
    table_of,
    wave_of,
)
from scm.traffic.signals.detectors import Detector, JunctionDetectors
from scm.traffic.signals.operator_overrides import NEED_RINGS, Override
from scm.traffic.signals.plan import FLASH
from scm.traffic.signals.policy import FIXED, policy_names
from scm.traffic.signals.priority_requests import PriorityRequests
from scm.traffic.signals.status_reports import StatusReports, is_due, override_records
from scm.v2x.etsi.convert import roadside_station, spatem_of
from scm.v2x.etsi.mapem import MapemBody
from scm.v2x.etsi.topology import mapem_at
from scm.v2x.exchange import Outgoing
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.mapem import MapemTx
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.plan_request import PlanReply, PlanRequest
from scm.v2x.messages.signal_request import SignalReply, SignalRequest
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.spatem import SpatemTx

MONITOR_SILENT_NS = 3_000 * NS_PER_MS  # six of its reports in a row
SPATEM_EVERY_NS = 500 * NS_PER_MS
MAPEM_EVERY_NS = 1_000 * NS_PER_MS
ENDS = {
    "monitor": "the monitor reports no fault any more",
    "silence": "the monitor is back",
}
"""Why a junction stops flashing, by what made it flash; a person gives their own reason."""

Severity = Literal["info", "warning"]


class JunctionSignals:
    """Steps one controller; handles the monitor, operators and vehicles for it."""

    def __init__(
        self,
        junction: Junction,
        controller: Controller,
        detectors: JunctionDetectors,
        priority_requests: PriorityRequests,
        mapem: MapemBody,
        reports: StatusReports,
    ) -> None:
        self.junction = junction
        self._station = roadside_station(junction.name)
        self._reports = reports
        self._names = {*(plan.plan for plan in reports.site.plans), *policy_names()}
        self._mapem = mapem
        self._mapem_ns: int | None = None
        self.record = PlanRecord(plan="")
        self.priority_requests = priority_requests
        self.controller = controller
        self.detectors = detectors
        self._reported = (controller.mode, controller.running, "")
        self._plan_reason = "as the map says"
        self._accepted = ""
        self._why_flash = ""
        self._why_restart = ""
        self._monitor_ns: int | None = None
        self._sent_ns: int | None = None
        self._known_overrides = controller.overrides
        self._events: list[Outgoing] = []
        self._by_group: Mapping[str, Detector] = {}
        self._timing: Timing | None = None

    def request_timing(self, timing: Timing) -> None:
        """Request other least times, from the next safe moment on."""
        self._timing = timing
        self.controller.request_timing(timing)

    def receive_monitor(self, status: MonitorStatus, arrived_ns: int) -> None:
        """Flash while the monitor reports a fault."""
        self._monitor_ns = arrived_ns
        why = f"the monitor reports {status.fault}: {status.detail}"
        self._flash("monitor", why, on=status.fault is not None)

    def restore(self, record: PlanRecord) -> None:
        """Apply what was requested in an earlier run, as if it were requested now.

        Raises:
            PlanError: when there is no such plan any more.
        """
        request = PlanRequest(junction=self.junction.name, plan=record.plan, by=record.by)
        if record.plan:
            self.serve_plan(replace(request, stages=record.stages, offset_s=record.offset_s))
        if record.flash:
            self.serve_plan(replace(request, plan=FLASH))

    def serve_plan(self, request: PlanRequest) -> PlanReply:
        """Apply a request for a plan, or for flash; `record` is what should outlive the process.

        Raises:
            PlanError: when there is no such plan, or one that came with it is not as it must be.
        """
        controller = self.controller
        who = f"{request.by} asked" + (f": {request.reason}" if request.reason else "")
        if request.plan == FLASH:
            self._flash("person", who, on=True)
            self.record = replace(self.record, flash=True, by=request.by)
            return PlanReply(junction=request.junction, plan=FLASH)
        if not request.plan:
            return self._end_flash(who)
        if request.stages:
            check_plan_name(request.plan, self._names)
            table = table_of(request.plan, request.stages, self._reports.program)
            controller.request_custom_plan(table, wave_of(table, request.offset_s))
            self._accepted = f"takes plan {request.plan} ({who})"
        else:
            controller.request_plan(request.plan)
        self.record = PlanRecord(
            plan=request.plan, by=request.by, stages=request.stages, offset_s=request.offset_s
        )
        self._plan_reason = self._why_restart = who
        self._flash("person", who, on=False)
        return self._runs()

    def serve_override(self, request: SignalRequest, now_ns: int) -> SignalReply:
        """Apply an override of groups, or of the policy.

        Raises:
            PlanError: saying why it cannot be taken.
        """
        controller = self.controller
        controller.apply_override(request, now_ns)
        self._known_overrides = controller.overrides
        why = f": {request.reason}" if request.reason else ""
        text = f"{request.by} asked{why}"
        if request.verb in ("policy", "clear"):
            self._plan_reason = text
        if controller.is_flashing and not self._why_flash:
            self._why_flash = text
        self._log_event(
            "info", "signal_wish", f"{_what(request)} ({text}){_how_long(request)}", now_ns
        )
        return SignalReply(
            junction=request.junction,
            policy=controller.policy,
            pending=controller.pending,
            wishes=override_records(controller.overrides),
        )

    def step(self, now_ns: int) -> list[Outgoing]:
        """Advance to `now_ns`; return what the city and the radio receive."""
        controller = self.controller
        if self._monitor_ns is not None:
            silent = now_ns - self._monitor_ns > MONITOR_SILENT_NS
            self._flash("silence", "the monitor fell silent", on=silent)
        controller.step(now_ns, self._observations(now_ns))
        if self._timing is not None and controller.program is self._timing.program:
            self._reports = StatusReports(
                self.junction.name, self._timing.program, self._timing.tables
            )
            self.detectors.extend_to(self._timing.program)
            self._timing = None
        spat = controller.spat(now_ns)
        self._report_expired(now_ns)
        self._report_changes(now_ns)
        events, self._events = self._events, []
        messages = self._reports.due(controller, self._by_group, now_ns)
        answers = self.priority_requests.due_ssem(controller.priority, now_ns)
        return [spat, *self._on_air(spat), *answers, *messages, *events]

    def _observations(self, now_ns: int) -> Observations:
        calls = self.priority_requests.calls(now_ns)
        if not self.controller.needs_detectors:
            self._by_group = {}
            return Observations({}, priority=calls)
        detectors = self.detectors
        self._by_group = detectors.by_group(detectors.read(now_ns))
        return Observations(self._by_group, detectors.sees(now_ns), calls)

    def _end_flash(self, who: str) -> PlanReply:
        """Return to the requested plan, which a flash has not changed."""
        plan = self.controller.plan if self.controller.end_flash() else self.record.plan
        self._why_restart = who
        self._flash("person", who, on=False)
        self.record = replace(self.record, plan=plan, flash=False)
        return self._runs()

    def _runs(self) -> PlanReply:
        controller = self.controller
        plan = FLASH if controller.is_flashing else controller.running
        return PlanReply(junction=self.junction.name, plan=plan, pending=controller.pending)

    def _flash(self, reason: str, why: str, *, on: bool) -> None:
        if on and not self.controller.is_flashing:
            self._why_flash, self._why_restart = why, ""
        was_flashing = self.controller.is_flashing
        self.controller.flash(reason, on=on)
        if was_flashing and not self.controller.is_flashing:
            self._why_restart = ENDS.get(reason, self._why_restart)

    def _on_air(self, spat: Spat) -> list[Outgoing]:
        station, now_ns = self._station, spat.t_ns
        sent: list[Outgoing] = []
        if self.controller.changed or is_due(self._sent_ns, now_ns, SPATEM_EVERY_NS):
            self._sent_ns = now_ns
            body = spatem_of(spat, self.junction)
            sent.append(SpatemTx(station=station, t_ns=now_ns, body=body))
        if is_due(self._mapem_ns, now_ns, MAPEM_EVERY_NS):
            self._mapem_ns = now_ns
            lanes = mapem_at(self._mapem, now_ns)
            sent.append(MapemTx(station=station, t_ns=now_ns, body=lanes))
        return sent

    def _report_expired(self, now_ns: int) -> None:
        """Report overrides that expired."""
        active = self.controller.overrides
        if active == self._known_overrides:
            return
        for one in self._known_overrides:
            if one.until_ns <= now_ns and one not in active:
                text = f"{_what(one)} of {one.by} lapsed"
                self._log_event("info", "signal_wish_lapsed", text, now_ns)
        self._known_overrides = active

    def _report_changes(self, now_ns: int) -> None:
        """Report what changed since the last call."""
        controller = self.controller
        mode, running, failure = self._reported
        now = self._reported = (controller.mode, controller.running, controller.failure)
        if self._accepted:
            self._log_event("info", "plan_taken", self._accepted, now_ns)
            self._accepted = ""
        if running != now[1]:
            what = "plan" if controller.policy == FIXED else "policy"
            text = f"runs {what} {now[1]}, before {running} ({self._why_runs()})"
            self._log_event("info", "plan_changed", text, now_ns)
        if now[2] and failure != now[2]:
            text = f"falls back to fixed time: {now[2]}"
            self._log_event("warning", "policy_failed", text, now_ns)
        if mode != FLASH and now[0] == FLASH:
            self._log_event("warning", "signals_flash", f"flashes red: {self._why_flash}", now_ns)
        if mode == FLASH and now[0] != FLASH:
            why = f" ({self._why_restart})" if self._why_restart else ""
            self._why_flash = self._why_restart = ""
            self._log_event("info", "signals_restart", f"restarts all red{why}", now_ns)
        if mode != "preempt" and now[0] == "preempt":
            self._log_event("info", "signals_preempted", "is pre-empted", now_ns)

    def _why_runs(self) -> str:
        """Return the reason for what runs now: its request, or overrides that need rings."""
        if self.controller.policy == FIXED:
            return self._plan_reason
        overrides = [one for one in self.controller.overrides if one.verb in NEED_RINGS]
        return ", ".join(f"{one.verb} of {one.by}" for one in overrides) or self._plan_reason

    def _log_event(self, severity: Severity, name: str, what: str, now_ns: int) -> None:
        text = f"junction {self.junction.name} {what}"
        self._events.append(
            CityEvent(severity=severity, source="traffic", t_ns=now_ns, name=name, text=text)
        )


def _what(override: SignalRequest | Override) -> str:
    """Return what an override does, for the log."""
    if isinstance(override, SignalRequest) and override.verb == "clear":
        of = " ".join(filter(None, (override.clears, *override.groups)))
        return f"takes back {of or 'all wishes'}"
    return " ".join(filter(None, (override.verb, override.policy, *override.groups)))


def _how_long(request: SignalRequest) -> str:
    return "" if request.verb == "clear" else f", {request.expires_s:g} s"
