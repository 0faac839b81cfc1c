"""Real cars' agents that tell when they find their keeper dead or silent, and fail when asked.

A line of arguments on stdin forks one, so that everything is loaded but once; its number is told.
SIGUSR1: its next step raises. SIGUSR2: its next step takes three seconds. All else is as it is;
only the keeper that it starts is `bench.watched_keeper`.
"""

import ctypes
import os
import signal
import sys
import time

from bench.watched_keeper import say
from scm.maps.load import load_map
from scm.runtime.lockstep import Lockstep
from scm.runtime.parent_watch import PR_SET_PDEATHSIG
from scm.world.part import WorldPart
from vehicle_agent.__main__ import main
from vehicle_agent.agent import AgentPart
from vehicle_agent.nigel.hand import Hand
from vehicle_agent.nigel.helm import Helm

STALL_S = 3.0
_asked: list[int] = []
_look, _hang_up, _init = AgentPart._check_losses, Helm._hang_up, Helm.__init__  # noqa: SLF001
_say = Hand.say


def _failing_look(self, now_ns):
    if _asked:
        say("deed")
        if _asked.pop() == signal.SIGUSR1:
            raise ZeroDivisionError("asked for by the bench")
        time.sleep(STALL_S)
    _look(self, now_ns)


def _telling_hang_up(self):
    if self._line is not None:
        say("keeper gone")
    _hang_up(self)


def _telling_say(self, frames):
    say("keeper gone")
    _say(self, frames)


def _watched_init(self, *args):
    _init(self, *args)
    self._command[2] = "bench.watched_keeper"


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
    say("ready")
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
        signal.signal(number, lambda got, _frame: _asked.append(got))
    setattr(AgentPart, "_check_losses", _failing_look)  # noqa: B010
    setattr(Helm, "_hang_up", _telling_hang_up)  # noqa: B010
    setattr(Hand, "say", _telling_say)  # noqa: B010
    setattr(Helm, "__init__", _watched_init)  # noqa: B010
    serve()
