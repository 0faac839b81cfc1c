"""A fleet at one router: what 20 to 200 stations at 20 Hz cost it, and how late the bus is then.

Who measures is not who is measured. The stations are sessions of their own in four processes that
tell how late they themselves were; one process hears all of them, as a recorder does; and two more
hold a stopwatch: one sends at every beat, the other hears only these. Their ages are what the bus
adds between two quiet programs while the fleet talks. All keep to beats of the clock, as agents do.
Run: `python -m bench.agents`.
"""

import subprocess
import sys
import threading
import time
from contextlib import ExitStack
from pathlib import Path

from bench.bus import Monotonic, percentiles, state
from scm.clock import NS_PER_S, nanoseconds, next_tick_ns, seconds
from scm.selftest.city import CITY
from scm.v2x.bus import Mailbox
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.router import free_endpoint

FLEETS = (20, 50, 100, 200)
RATE_HZ = 20.0
PROBE_HZ = 40.0
PROBE = 9999
SECONDS = 8.0
WARM_S = 2.0
SENDERS = 4
BAR_SHARE, BAR_P99_MS = 0.10, 10.0


def main() -> None:
    """Print a line a fleet."""
    print(f"{'':10}{'router':>9}{'bus p50':>10}{'p99':>9}{'heard by one':>18}{'p50':>9}{'p99':>9}"
          f"{'sender late p99':>18}")  # fmt: skip
    for count in FLEETS:
        print(_line(count), flush=True)
    print("\nmilliseconds; bus: age of a state between two quiet programs,")
    print(f"bar {BAR_P99_MS:g} ms at p99; router: share of a core, bar {BAR_SHARE:.0%};")
    print("heard by one: by one program that hears all")


def _line(count: int) -> str:
    endpoint, share = free_endpoint(), count // SENDERS
    words = ("bench.agents", endpoint)
    with ExitStack() as stack:
        router = _start(stack, "scm.selftest.router", endpoint)
        bus = stack.enter_context(_bus("stopwatch", endpoint))
        listener = _start(stack, *words, "ears", str(count))
        first = [str(i * share) for i in range(SENDERS)]
        senders = [_start(stack, *words, "send", number, str(share)) for number in first]
        everybody = [listener, *senders, _start(stack, *words, "probe")]
        for process in everybody:
            _line_of(process)
        for process in everybody:
            print(file=process.stdin, flush=True)
        used, ages_ms = _listen(bus, router.pid)
        lags = [float(_line_of(sender).split()[1]) for sender in senders]
        arrived, half, most = _line_of(listener).split()
    p50, p99 = percentiles(ages_ms)
    held = "ok" if used < BAR_SHARE and p99 < BAR_P99_MS else "MISSED"
    held += ", and so do who sends: the machine is busy" if max(lags) > BAR_P99_MS else ""
    return (
        f"{count:>4} cars {used:9.1%}{p50:10.2f}{p99:9.2f}{arrived:>18}{float(half):9.2f}"
        f"{float(most):9.2f}{max(lags):18.2f}   {held}"
    )


def _start(stack: ExitStack, *words: str) -> subprocess.Popen[str]:
    command, pipe = [sys.executable, "-m", *words], subprocess.PIPE
    process = subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True)
    stack.callback(process.wait)
    stack.callback(process.kill)
    return process


def _line_of(process: subprocess.Popen[str]) -> str:
    return process.stdout.readline() if process.stdout is not None else ""


def _ready() -> None:
    """Say so, and wait until everybody is."""
    print(flush=True)
    sys.stdin.readline()


def _bus(station: str, endpoint: str) -> ZenohBus:
    return ZenohBus(CITY, station, endpoint, clock=Monotonic(), connect_timeout_s=30.0)


def _listen(bus: ZenohBus, router: int) -> tuple[float, list[float]]:
    """Return the router's share of a core, and the ages of the probe's states [ms]."""
    box = Mailbox(100_000)
    bus.subscribe(VehicleState, {"vehicle": f"n{PROBE}"}, box)
    _wait(WARM_S)
    box.drain()
    began, used = time.monotonic(), cpu_s(router)
    _wait(SECONDS - WARM_S)
    share = (cpu_s(router) - used) / (time.monotonic() - began)
    return share, _ages_ms(box)


def send(endpoint: str, first: int, count: int) -> None:
    """Be some stations, spread over the beats of each period; print how late they were."""
    buses = [_bus(f"n{first + i}", endpoint) for i in range(count)]
    _ready()
    lags_ms = _send(list(zip(range(first, first + count), buses, strict=True)), RATE_HZ * count)
    print(*percentiles(lags_ms), flush=True)
    for bus in buses:
        bus.close()


def probe(endpoint: str) -> None:
    """Send the stopwatch's states."""
    with _bus(f"n{PROBE}", endpoint) as bus:
        _ready()
        _send([(PROBE, bus)], PROBE_HZ)


def ears(endpoint: str, count: int) -> None:
    """Hear everybody; print how many arrived of how many, and their ages, p50 and p99."""
    with _bus("ears", endpoint) as bus:
        box, ages_ms = Mailbox(100_000), list[float]()
        bus.subscribe(VehicleState, {}, box)
        _ready()
        end = time.monotonic() + SECONDS + 1.0
        while time.monotonic() < end:
            _wait(0.02)
            ages_ms += _ages_ms(box, but=f"n{PROBE}")
    whole = round(SECONDS * RATE_HZ * count)
    print(f"{len(ages_ms)}/{whole}", *percentiles(ages_ms), flush=True)


def _send(stations: list[tuple[int, ZenohBus]], rate_hz: float) -> list[float]:
    """Send in turn for as long as it takes; return how late each was [ms]."""
    lags_ms, began_ns = list[float](), time.time_ns()
    shift = began_ns / NS_PER_S - time.monotonic()
    for n in range(round(SECONDS * rate_hz)):
        due = seconds(next_tick_ns(began_ns + nanoseconds(n / rate_hz))) - shift
        _wait(due - time.monotonic())
        number, bus = stations[n % len(stations)]
        lags_ms.append((time.monotonic() - due) * 1e3)
        bus.publish(state(number))
    return lags_ms


def _ages_ms(box: Mailbox, but: str = "") -> list[float]:
    items = [item for item in box.drain() if isinstance(item.message, VehicleState)]
    return [
        (item.t_ns - item.message.t_ns) / 1e6
        for item in items
        if isinstance(item.message, VehicleState) and item.message.vehicle != but
    ]


def _wait(span_s: float) -> None:
    if span_s > 0.0:
        threading.Event().wait(span_s)


def cpu_s(pid: int) -> float:
    """Return how long a process has used a processor [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / 100.0


if __name__ == "__main__":
    if len(sys.argv) < 3:
        main()
    elif sys.argv[2] == "send":
        send(sys.argv[1], int(sys.argv[3]), int(sys.argv[4]))
    elif sys.argv[2] == "probe":
        probe(sys.argv[1])
    else:
        ears(sys.argv[1], int(sys.argv[3]))
