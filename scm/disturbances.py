"""Disturbances: what makes a measurement in the city void, from when to when.

    flash        a junction's signals flash
    monitor      a junction's monitor reports a fault
    silent       a junction's controller sends nothing any more
    part_lost    a part of the city is gone
    late         the computer is too slow: the world simulates less time than passes

Scripts, the server and `scm up` each keep their own record: the part that is lost may be any.
"""

import threading
from collections import deque

import msgspec

from scm.clock import NS_PER_S, seconds
from scm.records.disturbances import Disturbance, Kind
from scm.v2x.exchange import Incoming
from scm.v2x.message import Message
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.presence import Presence
from scm.v2x.messages.spat import Spat

MESSAGE_KINDS: tuple[type[Message], ...] = (Spat, MonitorStatus, PartStatus, Presence)
SILENT_NS = NS_PER_S  # no car takes a green that is older
LATE_SHARE = 0.05  # of the time between two reports of the world: more lost time means late
LATE_AFTER_REPORTS, RECOVERED_AFTER_REPORTS = 3, 5  # in a row, one per second
VOID_SHARE = 0.01  # of a trip's time
REQUIRED_PARTS = ("world", "traffic", "monitor")
MAX_STORED = 1000
OVERLOAD = "overload"  # the monitor's name for a computer that is too busy
RESET = "A person resets the monitor, on the signals page."
OPTIONAL_PARTS = ("eye", "camera", "record")  # the costliest first


class Disturbances:
    """Tracks disturbances from the messages of a city; safe from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._news: deque[Disturbance] = deque(maxlen=MAX_STORED)
        self._open: dict[tuple[Kind, str], Disturbance] = {}
        self._over: deque[Disturbance] = deque(maxlen=MAX_STORED)
        self._spat_ns: dict[str, int] = {}
        self._sessions: dict[str, set[str]] = {}
        self._lost: deque[tuple[int, int, int]] = deque(
            maxlen=MAX_STORED
        )  # from, to, how much [ns]
        self._reported: PartStatus | None = None
        self._undisturbed_since_ns = 0  # all that is over ended before
        self._in_a_row = 0  # reports that contradict whether the world is late
        self._since_ns = 0

    def receive(self, item: Incoming) -> None:
        """Process a message of one of `MESSAGE_KINDS`."""
        with self._lock:
            match item.message:
                case Spat() as spat:
                    self._receive_spat(spat, item.t_ns)
                case MonitorStatus() as status:
                    self._receive_monitor(status)
                case PartStatus(station="world") as status:
                    self._receive_world(status)
                case Presence() as presence:
                    self._receive_presence(presence, item.t_ns)

    def check_silence(self, now_ns: int) -> None:
        """Check which signals have been silent for too long."""
        with self._lock:
            for junction, received_ns in self._spat_ns.items():
                self._judge_silence(junction, received_ns, now_ns)

    def now(self) -> tuple[Disturbance, ...]:
        """Return those that are active, the oldest first."""
        with self._lock:
            return tuple(sorted(self._open.values(), key=lambda one: one.start_ns))

    def recent(self, since_ns: int) -> tuple[Disturbance, ...]:
        """Return those that were active at any time since then, the oldest first."""
        with self._lock:
            over = [one for one in self._over if one.end_ns is None or one.end_ns >= since_ns]
            return tuple(sorted((*over, *self._open.values()), key=lambda one: one.start_ns))

    def news(self) -> list[Disturbance]:
        """Return what began or ended since the last call."""
        with self._lock:
            news = list(self._news)
            self._news.clear()
            return news

    def void_reasons(self, start_ns: int, end_ns: int) -> tuple[str, ...]:
        """Return why a measurement over a span is void; empty if it is valid."""
        if start_ns >= self._undisturbed_since_ns and not self._open:
            return ()
        span = f"of {seconds(end_ns - start_ns):.1f} s"
        lasted: dict[str, int] = {}
        with self._lock:
            for one in (*self._over, *self._open.values()):
                if one.kind != "late":
                    one_end_ns = end_ns if one.end_ns is None else one.end_ns
                    within_ns = _overlap_ns(one.start_ns, one_end_ns, start_ns, end_ns)
                    lasted[one.text] = lasted.get(one.text, 0) + within_ns
            lost_ns = sum(
                lost_ns * _overlap_ns(first_ns, last_ns, start_ns, end_ns) // (last_ns - first_ns)
                for first_ns, last_ns, lost_ns in self._lost
            )
        reasons = [f"{text} for {seconds(ns):.1f} {span}" for text, ns in lasted.items() if ns]
        if lost_ns > VOID_SHARE * (end_ns - start_ns):
            reasons.append(f"this computer did not simulate {seconds(lost_ns):.1f} {span}")
        return tuple(reasons)

    def _receive_spat(self, spat: Spat, arrived_ns: int) -> None:
        before_ns = self._spat_ns.get(spat.junction, arrived_ns)
        self._judge_silence(spat.junction, before_ns, arrived_ns)
        self._end("silent", spat.junction, arrived_ns)
        self._spat_ns[spat.junction] = arrived_ns
        if spat.mode == "flash":
            self._begin("flash", spat.junction, spat.t_ns, f"the signals of {spat.junction} flash")
        else:
            self._end("flash", spat.junction, spat.t_ns)

    def _judge_silence(self, junction: str, received_ns: int, now_ns: int) -> None:
        if now_ns - received_ns > SILENT_NS:
            self._begin("silent", junction, received_ns, f"the signals of {junction} are silent")

    def _receive_monitor(self, status: MonitorStatus) -> None:
        if status.fault is None:
            self._end("monitor", status.junction, status.t_ns)
        else:
            why = f"{status.fault}: {status.detail}"
            text = f"the monitor of {status.junction} reports {why}"
            advice = _for_a_slow_computer() if status.fault == OVERLOAD else RESET
            self._begin("monitor", status.junction, status.since_ns, text, advice)

    def _receive_world(self, status: PartStatus) -> None:
        """Note how much time the world did not simulate since its last report."""
        before, self._reported = self._reported, status
        if before is None or status.t_ns <= before.t_ns or not status.lost_s >= before.lost_s:
            return  # the first report, or one of another world
        passed_ns = status.t_ns - before.t_ns
        lost_ns = round(min(1.0, (status.lost_s - before.lost_s) / seconds(passed_ns)) * passed_ns)
        if lost_ns:
            self._lost.append((before.t_ns, status.t_ns, lost_ns))
            self._undisturbed_since_ns = max(self._undisturbed_since_ns, status.t_ns)
        is_known = ("late", "world") in self._open
        if (lost_ns > LATE_SHARE * passed_ns) == is_known:
            self._in_a_row = 0
            return
        self._since_ns = self._since_ns if self._in_a_row else before.t_ns
        self._in_a_row += 1
        if is_known and self._in_a_row >= RECOVERED_AFTER_REPORTS:
            self._in_a_row = 0
            self._end("late", "world", self._since_ns)
        elif not is_known and self._in_a_row >= LATE_AFTER_REPORTS:
            self._in_a_row = 0
            share = 1.0 - lost_ns / passed_ns
            cars = f"{status.cars} cars" if status.cars != 1 else "1 car"
            text = (
                f"this computer is too slow for {cars}: it simulates {share:.2f} s of each second"
            )
            self._begin(
                "late",
                "world",
                self._since_ns,
                text,
                _for_a_slow_computer(int(share * status.cars)),
            )

    def _receive_presence(self, presence: Presence, arrived_ns: int) -> None:
        station = presence.station
        if presence.role != "part" or not (station in REQUIRED_PARTS or station.startswith("eye")):
            return
        sessions = self._sessions.setdefault(station, set())
        if presence.alive:
            sessions.add(presence.session)
        else:
            sessions.discard(presence.session)
        if sessions:
            self._end("part_lost", station, arrived_ns)
        else:
            self._begin("part_lost", station, arrived_ns, f"the part {station} is gone")

    def _begin(self, kind: Kind, source: str, start_ns: int, text: str, advice: str = "") -> None:
        if (kind, source) not in self._open:
            one = Disturbance(kind=kind, source=source, start_ns=start_ns, text=text, advice=advice)
            self._open[kind, source] = one
            self._news.append(one)

    def _end(self, kind: Kind, source: str, end_ns: int) -> None:
        one = self._open.pop((kind, source), None)
        if one is not None:
            over = msgspec.structs.replace(one, end_ns=max(one.start_ns, end_ns))
            self._over.append(over)
            self._undisturbed_since_ns = max(self._undisturbed_since_ns, end_ns)
            self._news.append(over)


def _for_a_slow_computer(cars: int = 0) -> str:
    """Return what to do on a slow computer; `cars`: how many it may manage, 0: unknown."""
    fewer = f"with at most {cars} cars" if cars else "with fewer cars"
    parts = f"without parts that cost much (`scm up --without {','.join(OPTIONAL_PARTS)}`)"
    return f"Start the city again {fewer} (`--hosted`, `--agents`), or {parts}."


def _overlap_ns(first_ns: int, last_ns: int, start_ns: int, end_ns: int) -> int:
    return max(0, min(last_ns, end_ns) - max(first_ns, start_ns))
