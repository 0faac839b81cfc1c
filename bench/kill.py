"""Every way to kill a real car's program: how long until the motor has no throttle.

    python -m bench kill [published] [ours] [--only WORD] [--times N]

A city, an Eye, an agent with its watchdog, and a device: the published firmware emulated, or ours
on a simulated chip. Times count to the line in which the device reports PWM 0: from the deed, and
from when the host first knew (its watchdog, or its agent that finds the watchdog gone or silent);
"to the port" from there until the watchdog's zeros were written. Limits: ours 300 ms from the deed,
whatever happens; the published one 20 ms, a frame, from when the host knew.
Some ten minutes for each firmware; `--only` takes the rows with a word in their name.
"""

import argparse
import contextlib
import os
import random
import signal
import socket
import statistics
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from bench.car_rig import FIRMWARES, Motor, ReadProcess, Rig, published, rig, wait_for
from scm.v2x.exchange import Call
from scm.v2x.messages.lease_request import LeaseRequest
from scm.v2x.router import free_endpoint

MAP = "driving_school"
OURS_MS, FRAME_MS = 300.0, 20.0
PATIENCE_S = 4.0
STEADY_S = 1.0
PULLED = tuple(f"unplug@{t}:5" for t in range(16, 400, 10))
NOBODY = "nobody can say it"
WATCHDOG_GONE = "watchdog gone"
"""What an agent prints that finds its watchdog dead or silent: late ones look like it too."""


class Town:
    """A router and a world, to be broken."""

    def __init__(self) -> None:
        self.endpoint = free_endpoint()
        self.router = ReadProcess("scm.selftest.router", self.endpoint)
        wait_for(lambda: listens(self.endpoint), 10.0)
        self.world = ReadProcess("scm", "world", MAP, "--connect", self.endpoint, "--hosted", "0")

    def signal(self, number: int) -> None:
        for process in (self.router, self.world):
            os.kill(process.pid, number)

    def renew_router(self) -> None:
        """Have a router again at the same address."""
        self.router.end()
        self.router = ReadProcess("scm.selftest.router", self.endpoint)
        wait_for(lambda: listens(self.endpoint), 10.0)

    def close(self) -> None:
        self.world.end()
        self.router.end()


def listens(endpoint: str) -> bool:
    """Return whether a router answers at an endpoint."""
    host, _, port = endpoint.removeprefix("tcp/").rpartition(":")
    with contextlib.suppress(OSError), socket.create_connection((host, int(port)), 0.2):
        return True
    return False


@dataclass(frozen=True)
class Row:
    """One way.

    Attributes:
        do: Does it; returns when [monotonic ns].
        revert: Repairs what would stay broken.
        gap: Whether the published firmware cannot be helped: nobody can reach it.
        knows: What the host prints when it first knows.
        ends: Whether the next trial needs another agent.
    """

    name: str
    do: Callable[[Rig, Town], int]
    revert: Callable[[Rig, Town], None] = lambda _rig, _town: None
    gap: bool = False
    knows: str = "notice"
    ends: bool = False


def to_agent(number: int) -> Callable[[Rig, Town], int]:
    """Return the deed of sending the agent a signal."""

    def do(rig: Rig, town: Town) -> int:
        del town
        return struck(rig.drive(), number)

    return do


def to_watchdog(number: int) -> Callable[[Rig, Town], int]:
    """Return the deed of sending the watchdog a signal."""

    def do(rig: Rig, town: Town) -> int:
        del town
        return struck(rig.watchdog(), number)

    return do


def to_both(number: int) -> Callable[[Rig, Town], int]:
    """Return the deed of sending both a signal, the watchdog first."""

    def do(rig: Rig, town: Town) -> int:
        del town
        watchdog, agent = rig.watchdog(), rig.drive()
        t_ns = struck(watchdog, number)
        os.kill(agent, number)
        return t_ns

    return do


def struck(pid: int, number: int) -> int:
    t_ns = time.monotonic_ns()
    os.kill(pid, number)
    return t_ns


def failing_step(number: int) -> Callable[[Rig, Town], int]:
    """Return the deed of asking the agent's next step to fail; it says when it does."""

    def do(rig: Rig, town: Town) -> int:
        del town
        agent = rig.drive()
        requested_ns = struck(agent, number)
        wait_for(lambda: rig.agents.mentioned_ns("deed", requested_ns), 2.0)
        return rig.agents.mentioned_ns("deed", requested_ns) or requested_ns

    return do


def blind(rig: Rig, town: Town) -> int:
    del town
    rig.eye.is_open = False
    return time.monotonic_ns()


def kill_router(rig: Rig, town: Town) -> int:
    t_ns = struck(town.router.pid, signal.SIGKILL)
    rig.eye.is_open = False
    return t_ns


def stop_city(rig: Rig, town: Town) -> int:
    t_ns = time.monotonic_ns()
    town.signal(signal.SIGSTOP)
    rig.eye.is_open = False
    return t_ns


def steal(rig: Rig, town: Town) -> int:
    """Have somebody else take the car and never speak up."""
    del town
    request = LeaseRequest(
        vehicle=rig.eye.vehicle, owner="thief", verb="steal", reason="bench", ttl_ms=10_000
    )
    t_ns = time.monotonic_ns()
    rig.eye.bus.call(Call(request, timeout_s=1.0), lambda _reply: None)
    return t_ns


def pull(rig: Rig, town: Town) -> int:
    """Pull the cable: the emulator does it at its own times, the board on command."""
    del town
    motor, now_ns = rig.motor, time.monotonic_ns()
    if not is_emulated(motor):
        motor.process.stdin.write("pull\n")  # type: ignore[union-attr]
        return now_ns

    def pulled() -> int:
        return next((t for t, s in list(motor.lines) if "fault_unplug" in s and t > now_ns), 0)

    wait_for(pulled, 60.0)
    return pulled()


def plug(rig: Rig, town: Town) -> None:
    del town
    if not is_emulated(rig.motor):
        rig.motor.process.stdin.write("plug\n")  # type: ignore[union-attr]


def is_emulated(motor: Motor) -> bool:
    return any("emulated Nigel" in line for _, line in motor.lines)


def wake(rig: Rig, town: Town) -> None:
    """Let everything that was stopped go on."""
    with contextlib.suppress(ProcessLookupError):
        town.signal(signal.SIGCONT)
    if rig.agent is None:
        return
    for pid in (rig.agent, *children(rig.agent)):
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGCONT)
    time.sleep(STEADY_S)


def children(pid: int) -> list[int]:
    try:
        return [int(one) for one in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
    except OSError:
        return []


def new_router(rig: Rig, town: Town) -> None:
    del rig
    town.renew_router()


def signals_of(who: str, deed: Callable[[int], Callable[[Rig, Town], int]]) -> list[Row]:
    """Return the rows in which a process is sent a signal."""
    rows = []
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGKILL, signal.SIGSTOP):
        is_gone = who == "watchdog" and number in (signal.SIGKILL, signal.SIGSTOP)
        rows.append(
            Row(
                f"{who}: {number.name}",
                deed(number),
                revert=wake if number is signal.SIGSTOP else Row.revert,
                knows=WATCHDOG_GONE if is_gone else "notice",
                ends=who == "agent" and number is not signal.SIGSTOP,
            )
        )
    return rows


ROWS = (
    *signals_of("agent", to_agent),
    Row("agent: its step raises", failing_step(signal.SIGUSR1), ends=True),
    Row("agent: its loop stalls", failing_step(signal.SIGUSR2)),
    *signals_of("watchdog", to_watchdog),
    Row("bus: the router is killed", kill_router, new_router, ends=True),
    Row("bus: the city is stopped (SIGSTOP)", stop_city, wake, ends=True),
    Row("the lease is stolen", steal, ends=True),
    Row("the Eye is blind", blind),
    Row("the cable is pulled", pull, plug, gap=True, knows=NOBODY),
    Row("agent and watchdog: SIGKILL", to_both(signal.SIGKILL), gap=True, knows=NOBODY, ends=True),
    Row("agent and watchdog: SIGSTOP", to_both(signal.SIGSTOP), wake, gap=True, knows=NOBODY),
)


@dataclass(frozen=True)
class Trial:
    """How long until PWM 0 [ms], from the deed and from when the host knew; None: unknown.

    `sent_ms`: from when the host knew until the port had its zeros.
    """

    deed_ms: float | None
    notice_ms: float | None
    sent_ms: float | None


def tried(row: Row, made: Rig, town: Town) -> Trial:
    """Do it once."""
    made.drive()
    time.sleep(random.uniform(0.0, 0.2))
    did_ns = row.do(made, town)
    wait_for(lambda: made.motor.stopped(did_ns), PATIENCE_S)
    stopped_ns = made.motor.stopped(did_ns)
    row.revert(made, town)
    time.sleep(0.05)
    times = [made.agents.mentioned_ns(word, did_ns) for word in (row.knows, WATCHDOG_GONE)]
    knew_ns = min((t_ns for t_ns in times if t_ns is not None), default=None)
    sent_ns = made.agents.mentioned_ns("written", did_ns)
    if row.ends:
        made.end_agent()
    if stopped_ns is None:
        return Trial(None, None, None)
    notice = None if knew_ns is None else (stopped_ns - knew_ns) / 1e6
    sent = None if knew_ns is None or sent_ns is None else (sent_ns - knew_ns) / 1e6
    return Trial((stopped_ns - did_ns) / 1e6, notice, sent)


def median_and_worst(values: list[float | None]) -> str:
    """Return median and worst of what was measured; never: not while one waited."""
    known = [value for value in values if value is not None]
    if not known:
        return "never"
    worst = "never" if len(known) < len(values) else f"{max(known):.0f}"
    return f"{statistics.median(known):.0f} / {worst}"


def verdict(row: Row, firmware: str, trials: list[Trial]) -> str:
    """Return how the trials stand beside the bar."""
    if firmware == "ours":
        good = all(t.deed_ms is not None and t.deed_ms <= OURS_MS for t in trials)
        return "pass" if good else "FAIL"
    if row.gap:
        return "the gap"
    good = all(t.notice_ms is not None and t.notice_ms <= FRAME_MS for t in trials)
    return "pass" if good else "FAIL"


def measure(firmware: str, rows: list[Row], times: int, town: Town) -> Iterator[bool]:
    """Print a line a row; yield whether each passed its bar."""

    def device(link: Path) -> Motor:
        emulates = firmware == "published"
        return published(link, *PULLED) if emulates and pulls else FIRMWARES[firmware](link)

    for pulls in (False, True):
        some = [row for row in rows if (row.do is pull) == pulls]
        if not some:
            continue
        with rig(town.endpoint, MAP, device) as made:
            for row in some:
                trials = [tried(row, made, town) for _ in range(times)]
                judged = verdict(row, firmware, trials)
                cells = [median_and_worst([t.deed_ms for t in trials]), NOBODY, "-"]
                if not row.gap:
                    cells[1] = median_and_worst([t.notice_ms for t in trials])
                if row.knows == "notice":
                    cells[2] = median_and_worst([t.sent_ms for t in trials])
                print(f"| {row.name} | {firmware} | {' | '.join(cells)} | {judged} |", flush=True)
                yield judged != "FAIL"


def main() -> None:
    """Print the table; end with 1 when a bar was missed."""
    parser = argparse.ArgumentParser(prog="python -m bench kill", description=__doc__)
    parser.add_argument("firmware", nargs="*", help="published, ours; default: both")
    parser.add_argument("--only", default="", metavar="WORD")
    parser.add_argument("--times", type=int, default=5)
    given = parser.parse_args()
    rows = [row for row in ROWS if given.only in row.name]
    town = Town()
    print(f"milliseconds to PWM 0, median / worst of {given.times}")
    print("| what happens | firmware | from the deed | from when the host knew | to the port | |")
    print("|---|---|---|---|---|---|")
    try:
        firmwares = given.firmware or list(FIRMWARES)
        passed = [good for one in firmwares for good in measure(one, rows, given.times, town)]
    finally:
        town.close()
    if not all(passed):
        raise SystemExit(1)


if __name__ == "__main__":
    main()
