"""Supervise the processes of a city: start them, watch their presence, restart what dies.

A member is up when its presence appears. A member that dies is restarted, after a pause that
doubles with each death in a row, up to half a minute, for as long as the city runs: the cause (a
full disk) may be repaired. A member that exits with code 0, or at its first start with code 2 (bad
input), is not restarted. Nothing here prints: messages for a person go through `print_line`.
"""

import os
import signal
import subprocess
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from scm.clock import NS_PER_MS, NS_PER_S, Clock, seconds
from scm.runtime.parent_watch import with_parent
from scm.v2x.messages.presence import Presence

FIRST_PAUSE_NS = 250 * NS_PER_MS
LONGEST_PAUSE_NS = 30 * NS_PER_S
STEADY_NS = 60 * NS_PER_S  # a member that ran this long starts a new row of deaths
MANY_DEATHS = 5  # in a row: the city counts as ready without that member
STOP_NS = 1500 * NS_PER_MS
LAST_STOP_NS = 1000 * NS_PER_MS
SLOW_NS, SLOW_AGAIN_NS = 4 * NS_PER_S, 15 * NS_PER_S
SILENT_NS = 500 * NS_PER_MS
BAD_INPUT = 2

PrintLine = Callable[[str], None]


@dataclass(frozen=True)
class Job:
    """A process to keep alive.

    Attributes:
        name: Its station on the bus; `role` its role there.
        what: What it does, in a few words for a person.
        command: Returns program and arguments, anew for each start.
        after: Start only when the member of this name is up; empty: at once.
        last: Stop it after all others, so that it sees them go.
    """

    name: str
    role: str
    what: str
    command: Callable[[], Sequence[str]]
    after: str = ""
    last: bool = False


@dataclass
class Member:
    """A job and the process that does it now; `deaths` counts those in a row."""

    job: Job
    process: subprocess.Popen[bytes] | None = None
    sessions: set[str] = field(default_factory=set)
    started_ns: int = 0
    due_ns: int | None = 0
    deaths: int = 0
    silent_ns: int | None = None
    was_up: bool = False
    reported_gone: bool = False

    @property
    def is_up(self) -> bool:
        """Whether its process runs and is present on the bus."""
        return self.process is not None and bool(self.sessions)

    @property
    def is_done(self) -> bool:
        """Whether it is neither running nor going to be."""
        return self.process is None and self.due_ns is None


class Supervisor:
    """All processes of a city. Use it from one thread that lives as long as the process."""

    def __init__(self, jobs: Sequence[Job], clock: Clock, print_line: PrintLine) -> None:
        self.members = {job.name: Member(job) for job in jobs}
        self._clock = clock
        self._print = print_line
        self._slow_reported_ns = -SLOW_AGAIN_NS

    @property
    def is_ready(self) -> bool:
        """Whether every member is up, done, or dies again and again."""
        return all(m.is_up or m.is_done or m.deaths > MANY_DEATHS for m in self.members.values())

    def receive(self, presence: Presence) -> None:
        """Note that a station came or went."""
        member = self.members.get(presence.station)
        if member is None or member.job.role != presence.role:
            return
        before = member.is_up
        if presence.alive:
            member.sessions.add(presence.session)
        else:
            member.sessions.discard(presence.session)
        if member.is_up and not before:
            self._report_up(member)
        elif before and not member.is_up:
            member.silent_ns = self._clock.now_ns()

    def _report_up(self, member: Member) -> None:
        job, pid = member.job, member.process.pid if member.process else 0
        member.silent_ns = None
        if not member.was_up:
            self._print(f"  {job.name:<12} {job.what:<52} pid {pid}")
        elif member.reported_gone:  # a link that was lost for a moment is no news
            self._print(f"  {job.name:<12} is back, pid {pid}")
        member.was_up, member.reported_gone = True, False

    def poll(self) -> None:
        """Start the members that are due, and check which died."""
        now_ns = self._clock.now_ns()
        for member in self.members.values():
            if member.process is not None:
                code = member.process.poll()
                if code is not None:
                    self._ended(member, code, now_ns)
                else:
                    self._report_silent(member, now_ns)
            elif member.due_ns is not None and now_ns >= member.due_ns and self._may_start(member):
                self._start(member, now_ns)
        self._report_slow(now_ns)

    def _may_start(self, member: Member) -> bool:
        before = self.members.get(member.job.after)
        return before is None or before.is_up

    def _start(self, member: Member, now_ns: int) -> None:
        member.process = subprocess.Popen(
            with_parent(member.job.command()),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            start_new_session=True,
        )
        member.started_ns = now_ns
        member.due_ns = None

    def _report_silent(self, member: Member, now_ns: int) -> None:
        name = member.job.name
        if member.silent_ns is not None and now_ns > member.silent_ns + SILENT_NS:
            member.silent_ns, member.reported_gone = None, True
            self._print(f"  {name:<12} is silent: it runs, but gives no sign of life on the bus")

    def _report_slow(self, now_ns: int) -> None:
        """Report, now and then, the members whose first start takes long."""
        slow = [
            m for m in self.members.values()
            if m.process is not None and not m.was_up and now_ns > m.started_ns + SLOW_NS
        ]  # fmt: skip
        if not slow or now_ns < self._slow_reported_ns + SLOW_AGAIN_NS:
            return
        self._slow_reported_ns = now_ns
        names = ", ".join(m.job.name for m in slow)
        waited_s = seconds(now_ns - min(m.started_ns for m in slow))
        first = "; a first start compiles the physics, for a minute or more"
        why = first if any(m.job.name == "world" for m in slow) else ""
        self._print(f"  {waited_s:3.0f} s: still starting: {names}{why}")

    def _ended(self, member: Member, code: int, now_ns: int) -> None:
        name = member.job.name
        member.process = None
        member.silent_ns, member.reported_gone = None, True
        member.sessions.clear()
        if code == 0:
            self._print(f"  {name:<12} left")
            return
        how = f"by {signal.Signals(-code).name}" if code < 0 else f"with exit code {code}"
        member.deaths = 1 if now_ns - member.started_ns > STEADY_NS else member.deaths + 1
        if code == BAD_INPUT and not (member.was_up and member.job.role == "part"):
            self._print(f"  {name:<12} died {how}: its input is bad; it is not started again")
            return
        pause_ns = min(FIRST_PAUSE_NS * 2 ** min(member.deaths - 1, 10), LONGEST_PAUSE_NS)
        member.due_ns = now_ns + pause_ns
        often = f", {member.deaths} times in a row" if member.deaths > 1 else ""
        self._print(f"  {name:<12} died {how}{often}: starts again in {seconds(pause_ns):g} s")

    def stop(self) -> None:
        """Stop all members, those marked `last` last, and kill what is left after 1.5 s."""
        began_ns = self._clock.now_ns()
        for member in self.members.values():
            member.due_ns = None
        stopping: list[subprocess.Popen[bytes]] = []
        for last, until_ns in ((False, began_ns + LAST_STOP_NS), (True, began_ns + STOP_NS)):
            wave = [m.process for m in self.members.values() if m.process and m.job.last == last]
            for process in wave:
                _send(process, signal.SIGTERM)
            stopping += wave
            self._wait_for(stopping, until_ns)
        for member in self.members.values():
            if member.process is not None and member.process.poll() is None:
                self._print(f"  {member.job.name:<12} did not stop: killed")
            if member.process is not None:
                _send(member.process, signal.SIGKILL)
                member.process.wait()
                member.process = None

    def _wait_for(self, processes: Sequence[subprocess.Popen[bytes]], until_ns: int) -> None:
        never = threading.Event()
        while any(p.poll() is None for p in processes) and self._clock.now_ns() < until_ns:
            self._clock.wait_until(self._clock.now_ns() + 10 * NS_PER_MS, never)


def _send(process: subprocess.Popen[bytes], number: signal.Signals) -> None:
    """Send a signal to a process and everything it started itself."""
    try:
        os.killpg(process.pid, number)
    except ProcessLookupError:
        return
