"""The agent's end of the cable: it starts the keeper, gives it wishes, and knows what it told.

The keeper answers every wish. One that leaves a few unanswered may only be late, so the zeros are
said here, beside him, which costs nothing if he is well; only one that stays silent is killed. When
he is gone nobody can say zero, and a new keeper takes a while to start. So the port is opened here
at once, which resets the Arduino: its motor rests. It is held until the new keeper speaks.
"""

import logging
import socket
import subprocess
import sys
from collections import deque
from contextlib import suppress

import msgspec

from scm.clock import NS_PER_MS, NS_PER_S
from scm.log import event
from vehicle_agent.nigel.hand import Hand
from vehicle_agent.nigel.host import REST, Wish
from vehicle_agent.nigel.serial_watchdog import LONGEST, Asked, Told, Written

RESTART_NS = NS_PER_S
DOUBT_NS, DOUBT_TURNS = 55 * NS_PER_MS, 3
"""Without a word for both, zeros are said beside it: who stalled himself has not listened."""
HANGS_NS, HANGS_TURNS = 500 * NS_PER_MS, 10
"""Likewise until it is killed, which costs the car two seconds of rest."""
LEAVE_S = 2.0
MOST_WRITTEN = 1000
"""Commands that nobody asks for are forgotten after so many: 20 s."""

_log = logging.getLogger(__name__)
_told = msgspec.msgpack.Decoder(Told)


class Helm:
    """One keeper at a time, started again when it dies.

    Attributes:
        told: The newest of what it told; None: nothing yet.
    """

    def __init__(self, path: str, baud: int) -> None:
        self._command = [
            sys.executable,
            "-m",
            "vehicle_agent.nigel.serial_watchdog",
            path,
            str(baud),
        ]
        self._path, self._hand = path, Hand(path, baud)
        self._line: socket.socket | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self._started_ns: int | None = None
        self._heard_ns = self._unheard = 0
        self._said = ""
        self._is_closed = False
        self.told: Told | None = None
        self._written: deque[Written] = deque(maxlen=MOST_WRITTEN)

    def trouble(self, now_ns: int) -> str:
        """Return what keeps the car from being driven, in words; empty: nothing."""
        if self._line is None:
            return "nobody keeps the cable"
        if self.told is None:
            return "the keeper of the cable starts"
        if self._is_silent(now_ns, DOUBT_NS, DOUBT_TURNS):
            return "the keeper of the cable is silent"
        return self.told.trouble

    def steer(self, wish: Wish, now_ns: int) -> None:
        """Give the keeper a wish and take what it told; start it where there is none."""
        self._hear(now_ns)
        self._speak_for_silent(now_ns)
        self._end_hanging(now_ns)
        self._keep_one(now_ns)
        if self._line is None:
            return
        self._send(Asked(now_ns, wish))
        trouble = self.trouble(now_ns)
        if trouble != self._said:
            self._said = trouble
            level = logging.WARNING if trouble else logging.INFO
            event(_log, "serial", level=level, path=self._path, trouble=trouble or "none")

    def written(self) -> list[Written]:
        """Return, once, the commands that the keeper has written to the port, and when."""
        written = list(self._written)
        self._written.clear()
        return written

    def close(self) -> None:
        """Say zeros and have them said, and wait until the keeper has ended."""
        self._is_closed = True
        self._send(Asked(0, REST))
        self._say_rest()
        self._hang_up()
        if self._process is not None:
            try:
                self._process.wait(LEAVE_S)
            except subprocess.TimeoutExpired:
                event(_log, "keeper_hangs", level=logging.ERROR, path=self._path)
                self._process.kill()
                self._process.wait()
        self._hand.release()

    def _keep_one(self, now_ns: int) -> None:
        if self._line is not None or self._is_closed:
            return
        if self._process is not None and self._process.poll() is None:
            return  # it still holds the port
        if self._process is not None:
            self._hand.hold()
        if self._started_ns is not None and now_ns - self._started_ns < RESTART_NS:
            return
        self._started_ns = self._heard_ns = now_ns
        self._unheard, self.told = 0, None
        ours, its = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with its:
            self._process = subprocess.Popen(  # its own session: who kills the agent's spares it
                [*self._command, str(its.fileno())], pass_fds=[its.fileno()], start_new_session=True
            )
        ours.setblocking(False)
        self._line = ours

    def _is_silent(self, now_ns: int, span_ns: int, turns: int) -> bool:
        return self._unheard >= turns and now_ns - self._heard_ns > span_ns

    def _hear(self, now_ns: int) -> None:
        self._unheard += 1
        while self._line is not None:
            try:
                data = self._line.recv(LONGEST)
            except BlockingIOError:
                return
            except OSError:
                data = b""
            if not data:
                self._hang_up()
                event(_log, "keeper_died", level=logging.ERROR, path=self._path)
                return
            self.told, self._heard_ns, self._unheard = _told.decode(data), now_ns, 0
            self._written += self.told.written
            self._hand.release()

    def _speak_for_silent(self, now_ns: int) -> None:
        """Say zeros beside a keeper that may hang."""
        if self._is_silent(now_ns, DOUBT_NS, DOUBT_TURNS):
            self._say_rest()

    def _say_rest(self) -> None:
        if self._line is not None and self.told is not None and self.told.rest:
            self._hand.say(self.told.rest)

    def _end_hanging(self, now_ns: int) -> None:
        """Kill a keeper that does nothing: the next one resets the Arduino by opening the port."""
        if self._line is None or self._process is None or self.told is None:
            return
        if not self._is_silent(now_ns, HANGS_NS, HANGS_TURNS):
            return
        event(_log, "keeper_hangs", level=logging.ERROR, path=self._path)
        self._hand.withdraw()
        self._process.kill()
        self._hang_up()

    def _send(self, asked: Asked) -> None:
        if self._line is None:
            return
        with suppress(BlockingIOError, BrokenPipeError, ConnectionResetError):
            self._line.send(msgspec.msgpack.encode(asked))

    def _hang_up(self) -> None:
        if self._line is not None:
            self._line.close()
            self._line = None
