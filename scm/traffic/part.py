"""The traffic part: every junction of the map under its controller, and what the city hears of it.

It serves wishes for plans and hears the monitor. A fault that the monitor reports, or a monitor
that was there and fell silent, makes the junction flash red until the monitor says that all is
well. What the controller shows goes out as `Spat` at every step, and over the roadside station's
antenna as SPATEM twice a second and at once when a colour changes.
"""

import logging
from collections.abc import Sequence
from typing import Literal

from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import PlanError, nearest
from scm.log import event
from scm.maps.model import CityMap, Junction
from scm.maps.route import Roads
from scm.part import Hears, Serves
from scm.traffic.controller import Controller
from scm.traffic.plan import FLASH
from scm.traffic.program import STEP_NS, program_of
from scm.v2x.etsi_convert import roadside_station, spatem_of
from scm.v2x.exchange import Answer, Incoming, Outgoing
from scm.v2x.message import Message, Refused
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.plan_request import PlanReply, PlanRequest
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.spatem_tx import SpatemTx

MONITOR_SILENT_NS = 3 * NS_PER_S
SPATEM_EVERY_NS = 500 * NS_PER_MS
_EARLY_NS = STEP_NS // 2

_log = logging.getLogger(__name__)


class TrafficPart:
    """Controls the signals of all junctions of a map; see `scm.part.Part`."""

    def __init__(self, city_map: CityMap, plan: str | None = None) -> None:
        """Take the map; `plan` replaces the plans that the map names.

        Raises:
            PlanError: when a plan is unknown, or not safe for a junction.
        """
        self.name = "traffic"
        self.role = "part"
        self.period_ns = STEP_NS
        self.hears = (Hears(MonitorStatus),)
        self.serves = (Serves(PlanRequest),)
        roads = Roads(city_map)
        self._junctions = {
            junction.name: _Signals(junction, roads, plan) for junction in city_map.junctions
        }

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Hear wishes and the monitor, step every junction, tell what it shows."""
        outbox: list[Outgoing] = []
        for item in inbox:
            if isinstance(item.message, MonitorStatus):
                self._hear_monitor(item.message, item.t_ns)
            elif isinstance(item.message, PlanRequest):
                outbox.append(Answer(item, self._serve(item.message)))
        for signals in self._junctions.values():
            outbox += signals.step(now_ns)
        return outbox

    def finish(self, now_ns: int) -> list[Outgoing]:
        """Fall silent: cars take no green that is older than a second."""
        event(_log, "traffic_finished", t_ns=now_ns, junctions=len(self._junctions))
        return []

    def _hear_monitor(self, status: MonitorStatus, arrived_ns: int) -> None:
        signals = self._junctions.get(status.junction)
        if signals:
            signals.hear_monitor(status, arrived_ns)

    def _serve(self, request: PlanRequest) -> Message:
        signals = self._junctions.get(request.junction)
        if signals is None:
            known = list(self._junctions)
            hint = nearest(request.junction, known)
            detail = f"no junction {request.junction!r}{hint}, only {known}"
            return Refused(code="not_found", detail=detail)
        try:
            return signals.serve(request)
        except PlanError as unknown:
            return Refused(code="not_found", detail=str(unknown))


class _Signals:
    """One junction: its controller, what the monitor said of it, and what is still to be told."""

    def __init__(self, junction: Junction, roads: Roads, plan: str | None) -> None:
        self._junction = junction
        self._controller = Controller(
            junction.name,
            program_of(junction, roads),
            plan or junction.plan,
            roads.city_map.revision,
        )
        self._told = (self._controller.mode, self._controller.plan)
        self._asked = ""
        self._why_flash = ""
        self._monitor_ns: int | None = None
        self._sent_ns: int | None = None

    def hear_monitor(self, status: MonitorStatus, arrived_ns: int) -> None:
        self._monitor_ns = arrived_ns
        self._flash(
            "monitor",
            f"the monitor reports {status.fault}: {status.detail}",
            on=status.fault is not None,
        )

    def serve(self, request: PlanRequest) -> PlanReply:
        controller = self._controller
        who = f"{request.by} asked" + (f": {request.reason}" if request.reason else "")
        if request.plan == FLASH:
            self._flash("person", who, on=True)
            return PlanReply(junction=request.junction, plan=FLASH)
        controller.ask(request.plan)
        self._asked = who
        self._flash("person", who, on=False)
        plan = FLASH if controller.is_flashing else controller.plan
        return PlanReply(junction=request.junction, plan=plan, pending=controller.pending)

    def step(self, now_ns: int) -> list[Outgoing]:
        controller = self._controller
        if self._monitor_ns is not None:
            silent = now_ns - self._monitor_ns > MONITOR_SILENT_NS
            self._flash("silence", "the monitor fell silent", on=silent)
        controller.step(now_ns)
        spat = controller.spat(now_ns)
        return [spat, *self._on_air(spat), *self._news(now_ns)]

    def _flash(self, reason: str, why: str, *, on: bool) -> None:
        if on and not self._controller.is_flashing:
            self._why_flash = why
        self._controller.flash(reason, on=on)

    def _on_air(self, spat: Spat) -> list[Outgoing]:
        due = self._sent_ns is None or spat.t_ns - self._sent_ns >= SPATEM_EVERY_NS - _EARLY_NS
        if not due and not self._controller.changed:
            return []
        self._sent_ns = spat.t_ns
        body = spatem_of(spat, self._junction)
        return [SpatemTx(station=roadside_station(spat.junction), t_ns=spat.t_ns, body=body)]

    def _news(self, now_ns: int) -> list[Outgoing]:
        """Return events for what changed since they were last asked for."""
        (mode, plan), now = self._told, (self._controller.mode, self._controller.plan)
        self._told = now
        where = f"junction {self._junction.name}"
        news: list[Outgoing] = []
        if plan != now[1]:
            text = f"{where} runs plan {now[1]}, before {plan} ({self._asked})"
            news.append(_event("info", "plan_changed", text, now_ns))
        if mode != FLASH and now[0] == FLASH:
            text = f"{where} flashes red: {self._why_flash}"
            news.append(_event("warning", "signals_flash", text, now_ns))
        if mode == FLASH and now[0] != FLASH:
            news.append(_event("info", "signals_restart", f"{where} restarts all red", now_ns))
        return news


def _event(severity: Literal["info", "warning"], name: str, text: str, now_ns: int) -> CityEvent:
    return CityEvent(severity=severity, source="traffic", t_ns=now_ns, name=name, text=text)
