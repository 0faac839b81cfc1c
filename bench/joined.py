"""Local messages of a city beside a bad link to its neighbour, against the same city alone.

Two cities of a router and a gateway each, joined through a proxy that stalls, throttles (64 kB each
0.2 s) and cuts. 20 cars report at 20 Hz, and 25 hand-over requests of 200 kB a second are sent, by
the station whose messages are timed. Run: `python -m bench joined`.
"""

import argparse
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from statistics import quantiles

import zenoh

from scm.maps.load import MAPS_DIR
from scm.runtime.parent_watch import with_parent
from scm.selftest.proxy import FaultyProxy
from scm.v2x import zenoh_config
from scm.v2x.key import prefix
from scm.v2x.router import free_endpoint

CARS, CAR_PERIOD_S = 20, 0.05
PROBE_S, SPAN_S, JOINED_S = 0.005, 6.0, 8.0
REQUEST_EVERY, REQUEST_BYTES = 8, 200_000
A, B = prefix("a"), prefix("b")


class Bench:
    def __init__(self, folder: Path, stack: ExitStack) -> None:
        self.folder, self.stack = folder, stack
        gate, self.a, b = free_endpoint(), free_endpoint(), free_endpoint()
        self.proxy = stack.enter_context(FaultyProxy(gate))
        self._city("a", "b", self.a, f"admit={gate}")
        self._city("b", "a", b, f"join={self.proxy.listen}")
        self.probe, local, far = self._session(self.a), self._session(self.a), self._session(b)
        self.times_ms: list[float] = []
        self.crossed = 0
        self.held = [
            local.declare_subscriber(A + "probe", self._callback(self._time)),
            far.declare_subscriber(A + "v/*/state", self._callback(self._count)),
            far.declare_queryable(B + "handover/*", self._callback(lambda query: query.drop())),
        ]
        self.over = threading.Event()
        self.cars = threading.Thread(target=self._drive)
        self.cars.start()

    def _city(self, city: str, other: str, listen: str, link: str) -> None:
        city_map = self.folder / f"{city}.toml"
        neighbour = f'\n[[neighbours]]\ncity = "{other}"\nmessages = ["states"]\n'
        city_map.write_text((MAPS_DIR / "driving_school.toml").read_text() + neighbour)
        words = (city, other, str(city_map), listen, link, str(self.folder / f"{city}.sock"))
        command = with_parent([sys.executable, "-m", "tests.e2e.toy_city", *words])
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
        self.stack.callback(process.wait)
        self.stack.callback(process.terminate)

    def _session(self, endpoint: str) -> zenoh.Session:
        config = zenoh.Config.from_json5(zenoh_config.client(endpoint, 60.0))
        return self.stack.enter_context(zenoh.open(config))

    def _callback(self, call: Callable) -> zenoh.handlers.Callback:
        return zenoh.handlers.Callback(call, indirect=False)

    def _time(self, sample: zenoh.Sample) -> None:
        sent_ns = int.from_bytes(bytes(sample.payload), "little")
        self.times_ms.append((time.perf_counter_ns() - sent_ns) / 1e6)

    def _count(self, sample: zenoh.Sample) -> None:
        self.crossed += 1

    def _drive(self) -> None:
        session = self._session(self.a)
        while not self.over.wait(CAR_PERIOD_S):
            for car in range(CARS):
                session.put(f"{A}v/n{car}/state", bytes(400))

    def measure(self, name: str, *, requests: bool = True) -> float:
        self.times_ms.clear()
        began, crossed, sent = time.perf_counter(), self.crossed, 0
        while time.perf_counter() - began < SPAN_S:
            self.probe.put(A + "probe", time.perf_counter_ns().to_bytes(8, "little"))
            if requests and sent % REQUEST_EVERY == 0:
                ignore = self._callback(lambda reply: None)
                self.probe.get(B + "handover/a", ignore, payload=bytes(REQUEST_BYTES), timeout=2.0)
            sent += 1
            time.sleep(max(0.0, began + sent * PROBE_S - time.perf_counter()))
        time.sleep(0.5)
        times, over = sorted(self.times_ms), (self.crossed - crossed) / SPAN_S
        p99 = quantiles(times, n=100)[98]
        arrived = f"{len(times)} of {sent} arrived"
        print(
            f"  {name:<12} {arrived}, 99 % within {p99:6.2f} ms, last {times[-1]:7.2f} ms; "
            f"{over:4.0f} states/s cross"
        )
        return p99


def main() -> None:
    """Measure local messages beside each kind of link."""
    argparse.ArgumentParser(prog="python -m bench joined", description=__doc__).parse_args()
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        bench = Bench(Path(folder), stack)
        while not bench.crossed:
            time.sleep(0.1)
        good = bench.measure("good link", requests=False)
        bench.proxy.stalled = True
        time.sleep(2.0)
        alone = bench.measure("no link", requests=False)
        bench.proxy.stalled = False
        time.sleep(JOINED_S)
        bench.proxy.delay_s = 0.2
        slow = bench.measure("throttled")
        bench.proxy.delay_s, bench.proxy.stalled = 0.0, True
        stalled = bench.measure("stalled")
        bench.proxy.stalled = False
        for name, p99 in (("good", good), ("throttled", slow), ("stalled", stalled)):
            print(f"  99 % of local messages: {name} link {p99 / alone:.2f} x no link")
        bench.over.set()
        bench.cars.join()
        for one in bench.held:
            one.undeclare()


if __name__ == "__main__":
    main()
