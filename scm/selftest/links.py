"""Pulled cables: of a car, of the signals, of a commander."""

import threading
import uuid
from collections.abc import Iterator

from scm.clock import NS_PER_MS, NS_PER_S, WallClock
from scm.selftest.city import CITY, City
from scm.selftest.city_fault import FaultOutcome, StreamMonitor
from scm.selftest.proxy import FaultyProxy
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.lease_request import LeaseReply, LeaseRequest
from scm.v2x.messages.vehicle_state import VehicleState

PULLED_S = 5.0
SHORT_S = 0.5
NOTICED_S = 1.2
BACK_S = 15.0
COMMANDED_S = 2.0
BRAKES_S = 0.3
COMMAND_NS = 50 * NS_PER_MS
THROTTLE = 0.3


def links(city: City, streams: StreamMonitor) -> Iterator[FaultOutcome]:
    """Pull, stall and reset each connection that goes through a proxy."""
    for name, proxy in city.proxies.items():
        yield _pulled(name, proxy, streams, PULLED_S).short_of(noticed_s=NOTICED_S, back_s=BACK_S)
        yield _pulled(name, proxy, streams, SHORT_S).short_of(back_s=BACK_S)
        yield _cut(name, proxy, streams).short_of(back_s=BACK_S)


def _pulled(name: str, proxy: FaultyProxy, streams: StreamMonitor, span_s: float) -> FaultOutcome:
    """Let nothing through for a while; what waits goes on afterwards, as TCP has it."""
    observer = streams.observer
    began_ns = observer.clock.now_ns()
    proxy.stalled = True
    observer.listen(span_s)
    proxy.stalled = False
    plugged_ns = observer.clock.now_ns()
    back_ns = streams.wait(lambda: next(iter(streams.arrivals(name, plugged_ns)), None), BACK_S)
    observer.listen(3.0)
    gone_ns = streams.gone_ns(name, began_ns)
    return FaultOutcome(
        what=f"cable of {name} pulled for {span_s:g} s",
        noticed_ns=None if gone_ns is None else gone_ns - began_ns,
        back_ns=None if back_ns is None else back_ns - plugged_ns,
        silence_ns=streams.silence_ns(name, began_ns),
        lost=streams.lost(began_ns),
    )


def _cut(name: str, proxy: FaultyProxy, streams: StreamMonitor) -> FaultOutcome:
    """Reset the connection once; the way is free again at once."""
    observer = streams.observer
    began_ns = observer.clock.now_ns()
    proxy.cut(reset=True)
    gone_ns = streams.wait_gone(name, began_ns, 2.0)
    since_ns = gone_ns or began_ns
    back_ns = streams.wait(lambda: next(iter(streams.arrivals(name, since_ns)), None), BACK_S)
    observer.listen(3.0)
    return FaultOutcome(
        what=f"connection of {name} reset",
        noticed_ns=None if gone_ns is None else gone_ns - began_ns,
        back_ns=None if back_ns is None else back_ns - began_ns,
        silence_ns=streams.silence_ns(name, began_ns),
        lost=streams.lost(began_ns),
    )


def commander(city: City, streams: StreamMonitor) -> Iterator[FaultOutcome]:
    """Drive a car from afar, and pull the commander's cable: the car brakes."""
    vehicle, observer = next(iter(city.proxies)), streams.observer
    with FaultyProxy(city.endpoint) as proxy, Commander(vehicle, proxy.listen) as driver:
        lease = observer.request(
            LeaseRequest(
                vehicle=vehicle,
                owner="commander",
                verb="steal",
                ttl_ms=3000,
                reason="selftest",
                request_id=uuid.uuid4().hex,
            )
        )
        driver.epoch = lease.epoch if isinstance(lease, LeaseReply) else None
        observer.listen(COMMANDED_S)
        began_ns = observer.clock.now_ns()
        before = [state.epoch for _, state in observer.received(VehicleState, began_ns - NS_PER_S)]
        proxy.stalled = True
        stop_ns = streams.wait(lambda: _mode_ns(streams, vehicle, began_ns, ("stop",)), 3.0)
        hold_ns = _mode_ns(streams, vehicle, began_ns, ("hold", "stop"))
    led = driver.epoch is not None and driver.epoch in before
    observer.listen(3.0)
    resumed = _mode_ns(streams, vehicle, stop_ns or began_ns, ("drive",)) is not None
    stop_s = "never" if stop_ns is None else f"{(stop_ns - began_ns) / NS_PER_S:.2f} s"
    yield FaultOutcome(
        what=f"cable of the commander of {vehicle} pulled",
        noticed_ns=None if hold_ns is None else hold_ns - began_ns,
        silence_ns=streams.silence_ns(vehicle, began_ns),
        lost=streams.lost(began_ns),
        notes=f"no throttle, then brakes after {stop_s}; stands until commanded again",
        missed="it stands until commanded again"
        if resumed
        else ""
        if led
        else "driven from afar before",
    ).short_of(noticed_s=BRAKES_S)


def _mode_ns(
    streams: StreamMonitor, vehicle: str, since_ns: int, modes: tuple[str, ...]
) -> int | None:
    return streams.observer.first_ns(
        VehicleState, since_ns, lambda s: s.vehicle == vehicle and s.mode in modes
    )


class Commander:
    """Sends drive commands to a car at 20 Hz, once it has an epoch; a context manager.

    Attributes:
        epoch: Of its lease; None: it has none yet.
    """

    def __init__(self, vehicle: str, endpoint: str) -> None:
        self.epoch: int | None = None
        self._vehicle = vehicle
        self._bus = ZenohBus(CITY, "commander", endpoint)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._command, name="commander")

    def _command(self) -> None:
        clock, seq = WallClock(), 0
        due_ns = clock.now_ns()
        while not clock.wait_until(due_ns, self._stop):
            due_ns += COMMAND_NS
            if self.epoch is None:
                continue
            seq += 1
            self._bus.publish(
                DriveCommand(
                    vehicle=self._vehicle,
                    t_ns=clock.now_ns(),
                    epoch=self.epoch,
                    seq=seq,
                    throttle=THROTTLE,
                    steering=0.0,
                )
            )

    def __enter__(self) -> "Commander":
        """Begin to command."""
        self._thread.start()
        return self

    def __exit__(self, *exc: object) -> None:
        """Leave."""
        self._stop.set()
        self._thread.join()
        self._bus.close()
