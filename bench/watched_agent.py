"""Real cars' agents that report when their watchdog is dead or silent, and fail on request.

A line of arguments on stdin forks one, so that everything is loaded once; its pid is printed.
SIGUSR1: its next step raises. SIGUSR2: its next step takes three seconds. Only the watchdog that
it starts is replaced, by `bench.watched_watchdog`.
"""

import ctypes
import os
import signal
import sys
import time

from bench.watched_watchdog import report
from scm.maps.load import load_map
from scm.runtime.lockstep import Lockstep
from scm.runtime.parent_watch import PR_SET_PDEATHSIG
from scm.world.part import WorldPart
from vehicle_agent.__main__ import main
from vehicle_agent.agent import AgentPart
from vehicle_agent.nigel.watchdog_client import FallbackPort, WatchdogClient

STALL_S = 3.0
_signals: list[int] = []
_look = AgentPart._check_losses  # noqa: SLF001
_disconnect = WatchdogClient._disconnect  # noqa: SLF001
_init = WatchdogClient.__init__
_write_beside = FallbackPort.write_beside


def _failing_look(self, now_ns):
    if _signals:
        report("deed")
        if _signals.pop() == signal.SIGUSR1:
            raise ZeroDivisionError("asked for by the bench")
        time.sleep(STALL_S)
    _look(self, now_ns)


def _reporting_disconnect(self):
    if self._socket is not None:
        report("watchdog gone")
    _disconnect(self)


def _reporting_write(self, frames):
    report("watchdog gone")
    _write_beside(self, frames)


def _watched_init(self, *args):
    _init(self, *args)
    self._argv[2] = "bench.watched_watchdog"


def warm_up() -> None:
    """Have everything loaded that an agent needs."""
    with Lockstep([WorldPart(load_map("driving_school"))]) as city:
        city.add(AgentPart("n1"))
        city.run_for(2.0)


def serve() -> None:
    """Fork an agent for each line."""
    warm_up()
    kernel = ctypes.CDLL(None)
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # nobody waits for them
    report("ready")
    for line in sys.stdin:
        pid = os.fork()
        if not pid:
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            kernel.prctl(PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
            os._exit(lived(line.split()))
        print(f"agent {pid}", flush=True)


def lived(arguments: list[str]) -> int:
    """Be an agent; return how it ended."""
    try:
        return main(arguments)
    except ZeroDivisionError:
        return 1


if __name__ == "__main__":
    for number in (signal.SIGUSR1, signal.SIGUSR2):
        signal.signal(number, lambda got, _frame: _signals.append(got))
    setattr(AgentPart, "_check_losses", _failing_look)  # noqa: B010
    setattr(WatchdogClient, "_disconnect", _reporting_disconnect)  # noqa: B010
    setattr(FallbackPort, "write_beside", _reporting_write)  # noqa: B010
    setattr(WatchdogClient, "__init__", _watched_init)  # noqa: B010
    serve()
