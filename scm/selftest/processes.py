"""Every process of a city killed, and frozen for ten seconds; the router too; a full disk."""

import resource
import signal
from collections.abc import Iterator
from pathlib import Path

from scm.clock import NS_PER_S, seconds
from scm.errors import ScmError
from scm.recorder.mcap_file import read_run
from scm.recorder.recover import recover
from scm.selftest.city import ROUTER, City
from scm.selftest.city_fault import FaultOutcome, StreamMonitor
from scm.v2x.messages.city_event import CityEvent

NOTICED_S = 1.2
FROZEN_S = 10.0
RESTARTED_S = 30.0
STREAMS_BACK_S = 2.0
LOST_S = 0.5
ROOM_BYTES = 200_000


def kills(city: City, streams: StreamMonitor) -> Iterator[FaultOutcome]:
    """Kill each process in turn, and wait until it is back."""
    for name in city.names:
        recording = city.recording
        began_ns = streams.observer.clock.now_ns()
        city.send(name, signal.SIGKILL)
        gone_ns = streams.wait_gone(name, began_ns, 5.0)
        back_ns = _back(streams, name, gone_ns or began_ns, RESTARTED_S)
        streams.observer.listen(3.0)
        notes, missed = _recorded(recording, began_ns) if name == "record" else ("", "")
        yield FaultOutcome(
            what=f"{name} killed",
            noticed_ns=_since(began_ns, gone_ns),
            back_ns=_since(began_ns, back_ns),
            silence_ns=streams.silence_ns(name, began_ns),
            lost=streams.lost(began_ns),
            notes=notes,
            missed=missed,
        ).short_of(noticed_s=NOTICED_S, back_s=RESTARTED_S)


def freezes(city: City, streams: StreamMonitor) -> Iterator[FaultOutcome]:
    """Stop each process for ten seconds, and let it go on."""
    for name in city.names:
        began_ns = streams.observer.clock.now_ns()
        city.send(name, signal.SIGSTOP)
        gone_ns = streams.wait_gone(name, began_ns, FROZEN_S)
        streams.observer.listen(FROZEN_S - seconds(streams.observer.clock.now_ns() - began_ns))
        woken_ns = streams.observer.clock.now_ns()
        city.send(name, signal.SIGCONT)
        back_ns = _back(streams, name, woken_ns, RESTARTED_S)
        streams.observer.listen(3.0)
        yield FaultOutcome(
            what=f"{name} frozen for {FROZEN_S:g} s",
            noticed_ns=_since(began_ns, gone_ns),
            back_ns=_since(woken_ns, back_ns),
            silence_ns=streams.silence_ns(name, began_ns),
            lost=streams.lost(began_ns),
        ).short_of(noticed_s=NOTICED_S, back_s=RESTARTED_S)


def router(city: City, streams: StreamMonitor) -> Iterator[FaultOutcome]:
    """Kill the router and start it again at once: all streams are back, no event is lost."""
    names = ["traffic", "monitor", "world"]
    began_ns = streams.observer.clock.now_ns()
    city.stop_router()
    city.start_router()
    started_ns = streams.observer.clock.now_ns()

    def all_back_ns() -> int | None:
        first = [next(iter(streams.arrivals(name, started_ns)), None) for name in names]
        times = [t_ns for t_ns in first if t_ns is not None]
        return max(times) if len(times) == len(names) else None

    back_ns = streams.wait(all_back_ns, RESTARTED_S)
    streams.observer.listen(8.0)
    missed = "" if streams.events_lost(began_ns).startswith("0 ") else "no event lost"
    yield FaultOutcome(
        what=f"{ROUTER} killed and started",
        noticed_ns=0,
        back_ns=_since(began_ns, back_ns),
        silence_ns=max(streams.silence_ns(name, began_ns) for name in names),
        lost=streams.lost(began_ns),
        missed=missed,
    ).short_of(back_s=STREAMS_BACK_S)


def full_disk(city: City, streams: StreamMonitor) -> Iterator[FaultOutcome]:
    """Stop the recording's file from growing: the recorder reports it and starts a new one."""
    recording = city.recording
    most = recording.stat().st_size + ROOM_BYTES
    began_ns = streams.observer.clock.now_ns()
    resource.prlimit(city.pid("record"), resource.RLIMIT_FSIZE, (most, most))

    def failure_ns() -> int | None:
        return streams.observer.first_ns(CityEvent, began_ns, lambda e: e.name == "part_failed")

    failed_ns = streams.wait(failure_ns, 60.0)
    gone_ns = streams.wait(lambda: streams.gone_ns("record", began_ns), 10.0)
    back_ns = _back(streams, "record", gone_ns or began_ns, RESTARTED_S)
    streams.observer.listen(3.0)
    notes, missed = _recorded(recording, gone_ns or began_ns)
    yield FaultOutcome(
        what="disk full under the recorder",
        noticed_ns=None if gone_ns is None or failed_ns is None else max(0, gone_ns - failed_ns),
        back_ns=_since(gone_ns or began_ns, back_ns),
        silence_ns=streams.silence_ns("record", began_ns),
        lost=streams.lost(began_ns),
        notes=notes,
        missed=missed,
    ).short_of(noticed_s=2.0, back_s=RESTARTED_S)


def _since(began_ns: int, t_ns: int | None) -> int | None:
    return None if t_ns is None else t_ns - began_ns


def _back(streams: StreamMonitor, name: str, since_ns: int, timeout_s: float) -> int | None:
    """Return when a station was there again and its stream flowed; None: it never did."""
    came_ns = streams.wait(lambda: streams.came_ns(name, since_ns), timeout_s)
    if came_ns is None:
        return None
    return streams.wait(lambda: next(iter(streams.arrivals(name, came_ns)), None), timeout_s)


def _recorded(path: Path, until_ns: int) -> tuple[str, str]:
    """Return what a recording that was broken off lost, in words, and which bar it missed."""
    try:
        result = recover(path)
    except ScmError as cause:
        return str(cause), "recording recovered"
    last_ns = max(message.t_ns for message in read_run(result.path))
    lost_s = max(0.0, (until_ns - last_ns) / NS_PER_S)
    notes = f"{result.messages} messages recovered, the last {lost_s:.2f} s before the end"
    return notes, "" if lost_s <= LOST_S else f"at most {LOST_S:g} s of the recording lost"
