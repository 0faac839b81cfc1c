"""A fleet at one router: 200 stations at 20 Hz, the share of a core, and how old states arrive.

The stations are sessions of their own in another process, the router is a process alone, and this
one listens to all of them. Run: `python -m bench.agents`.
"""

import subprocess
import sys
import threading
import time
from pathlib import Path

from bench.bus import Monotonic, percentiles, state
from scm.selftest.city import CITY
from scm.v2x.bus import Mailbox
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.router import free_endpoint

STATIONS = 200
RATE_HZ = 20.0
SECONDS = 10.0
BAR_SHARE, BAR_P99_MS = 0.10, 10.0


def send(endpoint: str) -> None:
    """Be all the stations; send spread evenly over each period."""
    buses = [ZenohBus(CITY, f"n{i}", endpoint, clock=Monotonic()) for i in range(STATIONS)]
    began = time.monotonic()
    for n in range(round(SECONDS * RATE_HZ * STATIONS)):
        wait_s = began + n / (RATE_HZ * STATIONS) - time.monotonic()
        if wait_s > 0.0:
            time.sleep(wait_s)
        buses[n % STATIONS].publish(state(n % STATIONS))
    for bus in buses:
        bus.close()


def main() -> None:
    """Print what it costs."""
    endpoint = free_endpoint()
    router = subprocess.Popen([sys.executable, "-m", "scm.selftest.router", endpoint])
    try:
        share, ages_ms = measure(endpoint, router.pid)
    finally:
        router.kill()
        router.wait()
    half, most = percentiles(ages_ms)
    sent = round(SECONDS * RATE_HZ * STATIONS)
    print(f"  {STATIONS} stations x {RATE_HZ:g} Hz: {len(ages_ms)} of {sent} states arrived")
    print(f"  router  {share:6.1%} of a core   bar {BAR_SHARE:.0%}   {verdict(share < BAR_SHARE)}")
    print(
        f"  age     p50 {half:.2f} ms, p99 {most:.2f} ms   bar {BAR_P99_MS:g} ms   "
        f"{verdict(most < BAR_P99_MS)}"
    )


def verdict(held: bool) -> str:
    return "ok" if held else "MISSED"


def measure(endpoint: str, router: int) -> tuple[float, list[float]]:
    """Return the router's share of a core while states come, and their ages [ms]."""
    box, ages_ms = Mailbox(100_000), list[float]()
    time.sleep(0.5)
    with ZenohBus(CITY, "ears", endpoint, clock=Monotonic()) as bus:
        bus.subscribe(VehicleState, {}, box)
        sender = subprocess.Popen([sys.executable, "-m", "bench.agents", endpoint])
        never = threading.Event()
        while not box.drain() and sender.poll() is None:
            never.wait(0.005)
        began, used = time.monotonic(), cpu_s(router)
        while sender.poll() is None and time.monotonic() - began < SECONDS - 0.5:
            never.wait(0.02)
            ages_ms += [(item.t_ns - item.message.t_ns) / 1e6 for item in box.drain()]
        share = (cpu_s(router) - used) / (time.monotonic() - began)
        sender.wait()
        ages_ms += [(item.t_ns - item.message.t_ns) / 1e6 for item in box.drain()]
    return share, ages_ms


def cpu_s(pid: int) -> float:
    """Return how long a process has used a processor [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / 100.0


if __name__ == "__main__":
    if len(sys.argv) > 1:
        send(sys.argv[1])
    else:
        main()
