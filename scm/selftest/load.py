"""Too much, and nonsense: a million broken messages, one station that floods, one that is stuck."""

import signal
import subprocess
import sys
from collections.abc import Iterator

from scm.clock import NS_PER_S
from scm.errors import RunError
from scm.parent_watch import with_parent
from scm.selftest.city import CITY, City
from scm.selftest.harm import Harm, Watch

FUZZED = 1_000_000
FUZZ_HZ = 6_000.0
FLOOD_HZ = 10_000
FLOOD_S = 10.0
STUCK_S = 10.0
SILENCE_S = 1.0
BACK_S = 5.0


def fuzz(city: City, watch: Watch) -> Iterator[Harm]:
    """Send broken messages on every key; nobody may die of it."""
    observer = watch.observer
    before = {name: city.pid(name) for name in city.names}
    began_ns = observer.clock.now_ns()
    program = [sys.executable, "-m", "scm.selftest.fuzz", city.endpoint, CITY]
    sender = subprocess.Popen(with_parent([*program, str(FUZZED), str(FUZZ_HZ), "0"]))
    observer.wait(lambda: sender.poll() is not None, 4.0 * FUZZED / FUZZ_HZ)
    sender.kill()
    sent = sender.wait() == 0
    ended_ns = observer.clock.now_ns()
    back_ns = watch.wait(lambda: _all_flow_ns(city, watch, ended_ns), BACK_S * 2)
    died = [name for name, pid in before.items() if not _is_same(city, name, pid)]
    yield Harm(
        what=f"{FUZZED:,} broken messages",
        back_ns=None if back_ns is None else back_ns - ended_ns,
        silence_ns=_longest(city, watch, began_ns),
        lost=watch.events_lost(began_ns),
        said=f"in {(ended_ns - began_ns) / NS_PER_S:.0f} s; died: {', '.join(died) or 'nobody'}",
        missed=", ".join(["all sent"] * (not sent) + ["nobody dies"] * bool(died)),
    ).short_of(back_s=BACK_S)


def flood(city: City, watch: Watch) -> Iterator[Harm]:
    """Let one station send 10 000 messages a second."""
    observer = watch.observer
    began_ns = observer.clock.now_ns()
    program = [sys.executable, "-m", "scm.selftest.flood", city.endpoint, CITY]
    sender = subprocess.Popen(
        with_parent([*program, str(FLOOD_HZ), str(FLOOD_S)]), stdout=subprocess.PIPE, text=True
    )
    observer.wait(lambda: sender.poll() is not None, 3.0 * FLOOD_S)
    sender.kill()
    sent = int(sender.communicate()[0] or 0)
    observer.listen(3.0)
    yield _crowded(city, watch, began_ns, f"flood of {sent / FLOOD_S:,.0f} messages a second")


def stuck(city: City, watch: Watch) -> Iterator[Harm]:
    """Let a station subscribe to everything and then read nothing any more."""
    observer = watch.observer
    out = str(city.folder / "stuck.mcap")
    program = [sys.executable, "-m", "scm", "record", "--out", out]
    reader = subprocess.Popen(with_parent([*program, "--connect", city.endpoint, "--city", CITY]))
    observer.listen(4.0)
    began_ns = observer.clock.now_ns()
    reader.send_signal(signal.SIGSTOP)
    observer.listen(STUCK_S)
    outcome = _crowded(city, watch, began_ns, "a reader of everything that is stuck")
    reader.kill()
    reader.wait()
    yield outcome


def _crowded(city: City, watch: Watch, began_ns: int, what: str) -> Harm:
    silence_ns = _longest(city, watch, began_ns)
    missed = silence_ns > SILENCE_S * NS_PER_S
    return Harm(
        what=what,
        silence_ns=silence_ns,
        lost=watch.lost(began_ns),
        missed=f"no stream silent for {SILENCE_S:g} s" if missed else "",
    )


def _all_flow_ns(city: City, watch: Watch, since_ns: int) -> int | None:
    first = [next(iter(watch.arrivals(name, since_ns)), None) for name in city.names]
    known = [t_ns for t_ns in first if t_ns is not None]
    return max(known) if len(known) == len(first) else None


def _longest(city: City, watch: Watch, since_ns: int) -> int:
    quick = [name for name in city.names if name in ("traffic", "monitor", "world", "n3")]
    return max(watch.silence_ns(name, since_ns) for name in quick)


def _is_same(city: City, name: str, pid: int) -> bool:
    try:
        return city.pid(name) == pid
    except RunError:
        return False
