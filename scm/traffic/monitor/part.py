"""The monitor part: a second channel in its own process that sees nothing but the shown signals.

Its verdict goes out twice a second and at once when it changes. A fault is latched until a person
resets it and says why.
"""

import logging
from collections.abc import Callable, Mapping, Sequence
from typing import Literal

from scm.clock import NS_PER_MS
from scm.errors import nearest
from scm.log import event
from scm.records.city_map import CityMap
from scm.runtime.part import BasePart, Service, Subscription
from scm.store.records import FaultRecord
from scm.traffic.monitor.checks import OVERLOAD, Monitor
from scm.traffic.monitor.conflict_table import conflict_table_of, table_hash
from scm.v2x.exchange import Answer, Incoming, Outgoing, PersistedState
from scm.v2x.message import Message, Refused
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.monitor_reset import MonitorReset
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.spat import Spat

STATUS_EVERY_NS = 500 * NS_PER_MS
PERIOD_NS = 50 * NS_PER_MS

Severity = Literal["info", "warning", "error"]

_log = logging.getLogger(__name__)


class MonitorPart(BasePart):
    """Watches all junctions of a map; see `scm.runtime.part.Part`.

    Args:
        faults: By junction, what a monitor before this one had latched.
        waited_ns: Returns how long this process has waited for a processor so far [ns].
    """

    def __init__(
        self,
        city_map: CityMap,
        faults: Mapping[str, str] | None = None,
        waited_ns: Callable[[], int] = lambda: 0,
    ) -> None:
        self.name = "monitor"
        self.role = "part"
        self.period_ns = PERIOD_NS
        self.subscriptions = (Subscription(Spat),)
        self.services = (Service(MonitorReset),)
        self._tables = [conflict_table_of(city_map, junction) for junction in city_map.junctions]
        self._watches: dict[str, _Watch] = {}
        self._faults = dict(faults or {})
        self._waited_ns = waited_ns

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Judge what arrived and what did not, answer resets, tell verdicts."""
        if not self._watches:
            self._watches = {
                table.junction: _Watch(
                    Monitor(table, now_ns, self._waited_ns),
                    self._faults.get(table.junction),
                    now_ns,
                )
                for table in self._tables
            }
        outbox: list[Outgoing] = []
        for item in inbox:
            if isinstance(item.message, Spat):
                self._see(item.message, item.t_ns)
            elif isinstance(item.message, MonitorReset):
                outbox += self._reset(item, item.message, now_ns)
        for watch in self._watches.values():
            outbox += watch.due(now_ns)
        return outbox

    def finish(self, now_ns: int) -> list[Outgoing]:
        """Fall silent: the controller takes a lost monitor for a fault."""
        event(_log, "monitor_finished", t_ns=now_ns, junctions=len(self._watches))
        return []

    def _see(self, spat: Spat, arrived_ns: int) -> None:
        watch = self._watches.get(spat.junction)
        if watch:
            watch.monitor.see(spat, arrived_ns)

    def _reset(self, item: Incoming, request: MonitorReset, now_ns: int) -> list[Outgoing]:
        watch = self._watches.get(request.junction)
        if watch is None:
            known = list(self._watches)
            hint = nearest(request.junction, known)
            detail = f"no junction {request.junction!r}{hint}, only {known}"
            return [Answer(item, Refused(code="not_found", detail=detail))]
        if not request.by.strip() or not request.reason.strip():
            detail = "by, reason: got nothing, expected who resets the monitor and why"
            return [Answer(item, Refused(code="invalid", detail=detail))]
        return [*watch.reset(request, now_ns), Answer(item, watch.status(now_ns))]


class _Watch:
    """One junction's monitor and what was last told of it."""

    def __init__(self, monitor: Monitor, fault: str | None, now_ns: int) -> None:
        table, self.monitor = monitor.table, monitor
        if fault is not None:
            self.monitor.keep(fault, now_ns)
        self._hash = table_hash(table)
        self._published: str | None = None
        self._published_ns: int | None = None
        event(_log, "monitor_watches", junction=table.junction, table=self._hash)

    def status(self, now_ns: int) -> MonitorStatus:
        monitor = self.monitor
        return MonitorStatus(
            junction=monitor.table.junction,
            t_ns=now_ns,
            fault=monitor.fault,
            detail=monitor.detail or f"card {self._hash}",
            since_ns=monitor.since_ns,
        )

    def reset(self, request: MonitorReset, now_ns: int) -> list[Message]:
        was = self.monitor.fault
        if was is None:  # to forget what was seen would only excuse what comes next
            return []
        self.monitor.reset(now_ns)
        text = f"{request.by} reset the monitor of {request.junction} ({was}): {request.reason}"
        return [_event("warning", "monitor_reset", text, now_ns)]

    def due(self, now_ns: int) -> list[Outgoing]:
        self.monitor.tick(now_ns)
        news: list[Outgoing] = []
        fault = self.monitor.fault
        if fault != self._published:
            ends_by_itself = fault in (None, OVERLOAD)
            record = None if ends_by_itself else FaultRecord(fault=str(fault))
            news.append(PersistedState("latches", self.monitor.table.junction, record))
            news += self._event_of(fault, now_ns)
        due = (
            self._published_ns is None
            or now_ns - self._published_ns >= STATUS_EVERY_NS - PERIOD_NS // 2
        )
        if not due and fault == self._published:
            return news
        self._published, self._published_ns = fault, now_ns
        return [self.status(now_ns), *news]

    def _event_of(self, fault: str | None, now_ns: int) -> list[Message]:
        where = f"junction {self.monitor.table.junction}"
        if fault is None:
            return [_event("info", "monitor_clear", f"{where}: signals are believed", now_ns)]
        text = f"{where}: {fault}, {self.monitor.detail}"
        severity: Severity = "warning" if fault == OVERLOAD else "error"
        return [_event(severity, "monitor_fault", text, now_ns)]


def _event(severity: Severity, name: str, text: str, t_ns: int) -> Message:
    return CityEvent(severity=severity, source="monitor", t_ns=t_ns, name=name, text=text)
