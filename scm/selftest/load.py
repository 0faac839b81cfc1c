"""Too much, and nonsense: a million broken messages, one station that floods, one that is stuck."""

import signal
import subprocess
import sys
from collections.abc import Iterator

from scm.clock import NS_PER_S
from scm.errors import RunError
from scm.runtime.parent_watch import with_parent
from scm.selftest.city import CITY, City
from scm.selftest.city_fault import FaultOutcome, StreamMonitor
from scm.v2x.bus import Mailbox
from scm.v2x.messages.eye_status import EyeStatus

FUZZED = 1_000_000
FUZZ_HZ = 10_000.0
FUZZ_MOST_S = 240.0
FLOOD_HZ = 10_000
FLOOD_S = 10.0
STUCK_S = 10.0
SILENCE_S = 1.0
BACK_S = 5.0


def fuzz(city: City, streams: StreamMonitor) -> Iterator[FaultOutcome]:
    """Send a million invalid messages on every key; no process may die."""
    observer = streams.observer
    before = {name: city.pid(name) for name in city.names}
    began_ns, refused = observer.clock.now_ns(), observer.bus.rejected
    words = ["scm.selftest.fuzz", city.endpoint, CITY, str(FUZZED), str(FUZZ_HZ), str(FUZZ_MOST_S)]
    sent = _run(streams, [*words, "0"], FUZZ_MOST_S + 20.0)
    ended_ns = observer.clock.now_ns()
    took_s = (ended_ns - began_ns) / NS_PER_S
    back_ns = streams.wait(lambda: _all_flow_ns(city, streams, ended_ns), BACK_S * 2)
    died = [name for name, pid in before.items() if not _is_same(city, name, pid)]
    notes = (
        f"{sent / took_s:,.0f} a second; one reader refused {observer.bus.rejected - refused:,}; "
        f"died: {', '.join(died) or 'nobody'}"
    )
    yield FaultOutcome(
        what=f"{sent:,} broken messages",
        back_ns=None if back_ns is None else back_ns - ended_ns,
        silence_ns=_longest(city, streams, began_ns),
        lost=streams.events_lost(began_ns),
        notes=notes,
        missed=", ".join([f"all {FUZZED:,} sent"] * (sent < FUZZED) + ["nobody dies"] * bool(died)),
    ).short_of(back_s=BACK_S)


def flood(city: City, streams: StreamMonitor) -> Iterator[FaultOutcome]:
    """Let one station send 10 000 messages a second, on a key that others hear, or do not."""
    observer = streams.observer
    for subscribes in (False, True):
        box = Mailbox(1000)
        if subscribes:
            observer.bus.subscribe(EyeStatus, {}, box)
        began_ns = observer.clock.now_ns()
        words = ["scm.selftest.flood", city.endpoint, CITY, str(FLOOD_HZ), str(FLOOD_S)]
        sent = _run(streams, words, 3.0 * FLOOD_S)
        observer.listen(3.0)
        observer.bus.unsubscribe(box)
        whose = "on a subscribed key" if subscribes else "on a key without subscribers"
        yield _crowded(city, streams, began_ns, f"{sent / FLOOD_S:,.0f} messages a second {whose}")


def _run(streams: StreamMonitor, words: list[str], most_s: float) -> int:
    """Run a program that sends and then prints how many; return that, 0 when it did not end."""
    program = with_parent([sys.executable, "-m", *words])
    sender = subprocess.Popen(program, stdout=subprocess.PIPE, text=True)
    streams.observer.wait(lambda: sender.poll() is not None, most_s)
    sender.kill()
    return int(sender.communicate()[0] or 0)


def stuck(city: City, streams: StreamMonitor) -> Iterator[FaultOutcome]:
    """Let a station subscribe to everything and then read nothing any more."""
    observer = streams.observer
    out = str(city.folder / "stuck.mcap")
    program = [sys.executable, "-m", "scm", "record", "--out", out]
    reader = subprocess.Popen(with_parent([*program, "--connect", city.endpoint, "--city", CITY]))
    observer.listen(4.0)
    began_ns = observer.clock.now_ns()
    reader.send_signal(signal.SIGSTOP)
    observer.listen(STUCK_S)
    outcome = _crowded(city, streams, began_ns, "a reader of everything that is stuck")
    reader.kill()
    reader.wait()
    yield outcome


def _crowded(city: City, streams: StreamMonitor, began_ns: int, what: str) -> FaultOutcome:
    silence_ns = _longest(city, streams, began_ns)
    missed = silence_ns > SILENCE_S * NS_PER_S
    return FaultOutcome(
        what=what,
        silence_ns=silence_ns,
        lost=streams.lost(began_ns),
        missed=f"no stream silent for {SILENCE_S:g} s" if missed else "",
    )


def _all_flow_ns(city: City, streams: StreamMonitor, since_ns: int) -> int | None:
    first = [next(iter(streams.arrivals(name, since_ns)), None) for name in city.names]
    known = [t_ns for t_ns in first if t_ns is not None]
    return max(known) if len(known) == len(first) else None


def _longest(city: City, streams: StreamMonitor, since_ns: int) -> int:
    quick = [name for name in city.names if name in ("traffic", "monitor", "world", "n3")]
    return max(streams.silence_ns(name, since_ns) for name in quick)


def _is_same(city: City, name: str, pid: int) -> bool:
    try:
        return city.pid(name) == pid
    except RunError:
        return False
