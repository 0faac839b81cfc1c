"""The live city with 1 000 cars: every process beside one core, and the world beside real time.

Starts `scm up` on a grid city, listens to what the world says of itself, and reads from the system
what each process used. Nothing else should run on the machine; this listener itself, which reads
all 20 000 states a second, yields to the city (nice 10): it is not part of what is measured.
"""

import contextlib
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from scm.clock import NS_PER_S
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.mailbox import Mailbox
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.world_snapshot import WorldSnapshot
from scm.v2x.router import free_endpoint

MAP, CARS = "grid:6x6:12", 1000
WARM_UP_S, SPAN_S, START_S = 5.0, 12.0, 90.0
TICKS_A_SECOND = 50
MEEK = 10
_PID = re.compile(r"^\s+(\S+)\s.*pid (\d+)$")


@contextlib.contextmanager
def city(cars: int = CARS, map_name: str = MAP) -> Iterator[tuple[str, dict[str, int], int]]:
    """Run a city; yield its endpoint, the process number of each part, and the web port."""
    endpoint = free_endpoint()
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "scm", "up", map_name, "--hosted", str(cars)]
        command += ["--agents", "0", "--port", "0", "--listen", endpoint, "--record-dir", folder]
        up = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        try:
            yield endpoint, *started(up)
        finally:
            up.send_signal(signal.SIGINT)
            try:
                up.wait(10.0)
            except subprocess.TimeoutExpired:
                up.kill()
            recorded_mib = sum(path.stat().st_size for path in Path(folder).iterdir()) / 2**20
            print(f"    the recording: {recorded_mib:.0f} MiB")


def started(up: "subprocess.Popen[str]") -> tuple[dict[str, int], int]:
    """Read what `scm up` prints until all parts are there."""
    parts = {"router": up.pid}
    for line in up.stdout or ():
        found = _PID.match(line.rstrip())
        if found:
            parts[found[1]] = int(found[2])
        port = re.search(r"http://[\w.]+:(\d+)", line)
        if port:
            return parts, int(port[1])
    raise SystemExit(up.stderr.read() if up.stderr else "the city did not start")


def used_s(pid: int) -> float:
    """Return the processor time of a process [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(") ")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def memory_mib(pid: int) -> float:
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGESIZE") / 2**20


def measure(parts: dict[str, int], endpoint: str) -> None:
    """Watch a running city for a while and print what it took."""
    with ZenohBus("city", "bench", endpoint) as bus:
        received, reports = Mailbox(10_000), Mailbox(1_000_000)
        for kind in (WorldSnapshot, PartStatus):
            bus.subscribe(kind, {}, received)
        bus.subscribe(VehicleState, {}, reports)
        while not any(isinstance(item.message, WorldSnapshot) for item in received.drain()):
            time.sleep(0.1)
        time.sleep(WARM_UP_S)
        received.drain()
        reports.drain()
        before = {name: used_s(pid) for name, pid in parts.items()}
        began = time.perf_counter()
        time.sleep(SPAN_S)
        took = time.perf_counter() - began
        share = {name: (used_s(pid) - before[name]) / took for name, pid in parts.items()}
        messages = [item.message for item in received.drain()]
        counts = Counter(item.message.vehicle for item in reports.drain())
    shots = [m for m in messages if isinstance(m, WorldSnapshot)]
    status = {m.station: m for m in messages if isinstance(m, PartStatus)}
    first, last = shots[0], shots[-1]
    simulated_s = (last.t_ns - first.t_ns) / NS_PER_S
    late = last.late_ticks - first.late_ticks
    slowest = min(shot.real_time_factor for shot in shots)
    rate = f"{sum(counts.values()) / took / len(counts):.1f} states/s a car"
    print(
        f"    {len(last.vehicles)} cars, {len(shots) / took:.1f} snapshots/s, {rate}, "
        f"slowest second {slowest:.3f} of real time, "
        f"{late} late of {simulated_s * TICKS_A_SECOND:.0f} ticks "
        f"({late / (simulated_s * TICKS_A_SECOND):.1%})"
    )
    for name, value in sorted(share.items(), key=lambda item: -item[1]):
        report = status.get(name)
        step = (
            f"slowest step {report.step_ms:5.1f} ms, {report.late_steps} late, " if report else ""
        )
        dropped = f"{report.dropped} dropped, " if report else ""
        memory = memory_mib(parts[name])
        print(f"    {name:<9} {value:>6.1%} of a core   {step}{dropped}{memory:.0f} MiB")


def live() -> None:
    print(f"live, {CARS} cars on {MAP}")
    with city() as (endpoint, parts, _):
        os.nice(MEEK)
        measure(parts, endpoint)


if __name__ == "__main__":
    live()
