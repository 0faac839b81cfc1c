"""The bus against bare Zenoh in the same run: round trip of a question, and many cars at one ear.

Another process asks and publishes; this one answers and listens, through a router process of its
own. `bare` is zenoh-python used directly with the same bytes; `bus` adds keys, validation, typed
messages, mailboxes and a reader that waits. Run: `python -m bench.bus`.
"""

import subprocess
import sys
import threading
import time
from collections.abc import Callable
from statistics import quantiles

import zenoh

from scm.v2x import zenoh_config
from scm.v2x.bus import Mailbox
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.exchange import Answer, Call
from scm.v2x.message import decode, encode
from scm.v2x.messages.plan_request import PlanReply, PlanRequest
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.router import Router, free_endpoint

REQUESTS = 1000
CARS = 50
RATE_HZ = 50.0
SECONDS = 2.0
BARE_STATE, BARE_QUESTION = "bare/v/{}/state", "bare/question"
REQUEST = PlanRequest(junction="x1", plan="calm", by="bench")
REPLY = PlanReply(junction="x1", plan="calm")


class Monotonic:
    """The clock that all processes of a machine share: latencies can be told across them."""

    def now_ns(self) -> int:
        return time.monotonic_ns()

    def wait_until(self, t_ns: int, wake: threading.Event) -> bool:
        return wake.wait(max(0.0, (t_ns - self.now_ns()) / 1e9))


def state(car: int) -> VehicleState:
    return VehicleState(
        vehicle=f"n{car}",
        t_ns=time.monotonic_ns(),
        seq=0,
        x_m=1.25,
        y_m=-0.5,
        yaw_rad=0.1,
        speed_mps=0.26,
        yaw_rate_radps=0.0,
        steering_rad=0.02,
        throttle=0.5,
        source="simulated",
    )


# The other process: it asks and publishes, and prints what its questions took.


def other(endpoint: str) -> None:
    bare = zenoh.open(zenoh.Config.from_json5(zenoh_config.client(endpoint, 5.0)))
    with ZenohBus("city", "other", endpoint, clock=Monotonic()) as bus:
        for request in (lambda done: request_bare(bare, done), lambda done: request_bus(bus, done)):
            print(*round_trips(request), flush=True)
        publishers = [
            bare.declare_publisher(
                BARE_STATE.format(car),
                express=True,
                priority=zenoh.Priority.DATA_HIGH,
                congestion_control=zenoh.CongestionControl.DROP,
            )
            for car in range(CARS)
        ]
        for send in (
            lambda car: publishers[car].put(encode(state(car))[0]),
            lambda car: bus.publish(state(car)),
        ):
            publish(send)
    bare.close()


def request_bare(session: zenoh.Session, done: threading.Event) -> None:
    body = encode(REQUEST)[0]
    callback = zenoh.handlers.Callback(lambda _: done.set(), indirect=False)
    session.get(BARE_QUESTION, callback, payload=body, consolidation=zenoh.ConsolidationMode.NONE)


def request_bus(bus: ZenohBus, done: threading.Event) -> None:
    bus.call(Call(REQUEST), lambda _: done.set())


def round_trips(request: Callable[[threading.Event], None]) -> list[int]:
    took = []
    for _ in range(REQUESTS):
        done = threading.Event()
        began_ns = time.monotonic_ns()
        request(done)
        if not done.wait(5.0):
            sys.exit("no answer")
        took.append(time.monotonic_ns() - began_ns)
    return took


def publish(send: Callable[[int], None]) -> None:
    """Send a state of every car, spread evenly over each period, for some seconds."""
    began = time.monotonic()
    for n in range(round(SECONDS * RATE_HZ * CARS)):
        wait_s = began + n / (RATE_HZ * CARS) - time.monotonic()
        if wait_s > 0.0:
            time.sleep(wait_s)
        send(n % CARS)


# This process: it answers and listens.


def main() -> None:
    """Print the table."""
    with Router(free_endpoint()) as router, Ears(router.listen) as ears:
        command = [sys.executable, "-m", "bench.bus", router.listen]
        printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        ears.wait()
        bare_us, bus_us = ([int(w) / 1e3 for w in line.split()] for line in printed.splitlines())
    row("round trip of a question", bare_us, bus_us)
    row(f"one way, {CARS} cars x {RATE_HZ:g} Hz", ears.bare_us, ears.bus_us)
    sent = round(SECONDS * RATE_HZ * CARS)
    print(f"  lost: bare {sent - len(ears.bare_us)}, bus {sent - len(ears.bus_us)} of {sent}")


def row(what: str, bare_us: list[float], bus_us: list[float]) -> None:
    (bare_50, bare_99), (bus_50, bus_99) = (percentiles(t) for t in (bare_us, bus_us))
    print(
        f"  {what:<28} bare p50 {bare_50:6.0f} p99 {bare_99:6.0f} us   "
        f"bus p50 {bus_50:6.0f} p99 {bus_99:6.0f} us   "
        f"ratio {bus_50 / bare_50:.2f} / {bus_99 / bare_99:.2f}"
    )


def percentiles(values: list[float]) -> tuple[float, float]:
    cuts = quantiles(values, n=100)
    return cuts[49], cuts[98]


class Ears:
    """Answers both kinds of question, and notes how old both kinds of state arrive [us]."""

    def __init__(self, endpoint: str) -> None:
        self.bare_us: list[float] = []
        self.bus_us: list[float] = []
        self._bare = zenoh.open(zenoh.Config.from_json5(zenoh_config.client(endpoint, 5.0)))
        self._bus = ZenohBus("city", "ears", endpoint, clock=Monotonic())
        self._wake, self._stop = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._read)

    def __enter__(self) -> "Ears":
        self._questions = Mailbox(1000, self._wake)
        self._states = Mailbox(10_000, self._wake)
        self._bus.serve(PlanRequest, {}, self._questions)
        self._bus.subscribe(VehicleState, {}, self._states)
        answer = zenoh.handlers.Callback(self._answer_bare, indirect=False)
        callback = zenoh.handlers.Callback(self._receive_bare, indirect=False)
        self._declared = [
            self._bare.declare_queryable(BARE_QUESTION, answer),
            self._bare.declare_subscriber(BARE_STATE.format("*"), callback),
        ]
        self._thread.start()
        return self

    def __exit__(self, *exc: object) -> None:
        self._stop.set()
        self._thread.join()
        for thing in self._declared:
            thing.undeclare()
        self._bare.close()
        self._bus.close()

    def wait(self) -> None:
        """Let what is still on its way arrive."""
        time.sleep(0.2)

    def _answer_bare(self, query: zenoh.Query) -> None:
        decode(PlanRequest, query.payload.to_bytes())
        query.reply(query.key_expr, encode(REPLY)[0])
        query.drop()

    def _receive_bare(self, sample: zenoh.Sample) -> None:
        sent_ns = decode(VehicleState, sample.payload.to_bytes()).t_ns
        self.bare_us.append((time.monotonic_ns() - sent_ns) / 1e3)

    def _read(self) -> None:
        while not self._stop.is_set():
            self._wake.wait(0.1)
            self._wake.clear()
            for item in self._questions.drain():
                self._bus.answer(Answer(item, REPLY))
            for item in self._states.drain():
                self.bus_us.append((time.monotonic_ns() - item.message.t_ns) / 1e3)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        other(sys.argv[1])
    else:
        main()
