"""The agent's side of the serial watchdog: starts it, sends it commands, receives its reports.

The watchdog answers every command. If it leaves a few unanswered it may only be late, so zeros are
also written from here, which does no harm if it is well; only one that stays silent is killed. Once
it is gone nobody can send zeros, and a new one takes a while to start. So the port is opened here
at once, which resets the Arduino and stops its motor, and held until the new watchdog reports.
"""

import logging
import os
import select
import socket
import subprocess
import sys
from collections import deque
from contextlib import suppress

import msgspec

from scm.clock import NS_PER_MS, NS_PER_S
from scm.log import event
from vehicle_agent.nigel.cable import FAILURES, Port, open_serial
from vehicle_agent.nigel.host import REST, NigelCommand
from vehicle_agent.nigel.serial_watchdog import (
    MAX_PACKET_BYTES,
    WatchdogCommand,
    WatchdogReport,
    Written,
)

RESTART_NS = NS_PER_S
SUSPECT_NS, SUSPECT_STEPS = 55 * NS_PER_MS, 3
"""Without a report for both, zeros are written from here: an agent that stalled did not listen."""
HANG_NS, HANG_STEPS = 500 * NS_PER_MS, 10
"""Likewise until it is killed, which stops the car for two seconds."""
EXIT_TIMEOUT_S = 2.0
MAX_WRITTEN = 1000
"""Written commands that nobody reads are dropped beyond this: 20 s."""

PULSE_S = 0.006
"""How long DTR must be low: the Arduino's reset circuit is 0.1 uF and 10 kOhm (1 ms)."""

_log = logging.getLogger(__name__)
_report_decoder = msgspec.msgpack.Decoder(WatchdogReport)


class FallbackPort:
    """The agent's own access to the port, for when the watchdog cannot send zeros.

    A silent watchdog still holds the port: opening it a second time resets nothing, and zeros can
    be written. One that is gone has closed it: opening it resets the Arduino and stops the motor.
    """

    def __init__(self, path: str, baud: int) -> None:
        self._path, self._baud = path, baud
        self._beside: int | None = None
        self._port: Port | None = None

    def write_beside(self, frames: bytes) -> None:
        """Write while the watchdog holds the port; what finds no room is dropped."""
        with suppress(OSError):
            if self._beside is None:
                self._beside = os.open(self._path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
            os.write(self._beside, frames)

    def open(self) -> None:
        """Open the port after the watchdog is gone: that resets the Arduino."""
        if self._port is not None:
            return
        self.close_beside()
        select.select([], [], [], PULSE_S)
        with suppress(*FAILURES):
            self._port = open_serial(self._path, self._baud, exclusive=False)

    def close_beside(self) -> None:
        """Close the second access to the port."""
        if self._beside is not None:
            with suppress(OSError):
                os.close(self._beside)
            self._beside = None

    def close(self) -> None:
        """Release the port."""
        self.close_beside()
        if self._port is not None:
            with suppress(*FAILURES):
                self._port.close()
            self._port = None


class WatchdogClient:
    """Runs one watchdog process at a time and restarts it when it dies.

    Attributes:
        report: The newest report; None before the first.
    """

    def __init__(self, path: str, baud: int) -> None:
        self._argv = [
            sys.executable,
            "-m",
            "vehicle_agent.nigel.serial_watchdog",
            path,
            str(baud),
        ]
        self._path, self._fallback = path, FallbackPort(path, baud)
        self._socket: socket.socket | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self._started_ns: int | None = None
        self._report_ns = self._unanswered = 0
        self._logged = ""
        self._is_closed = False
        self.report: WatchdogReport | None = None
        self._written: deque[Written] = deque(maxlen=MAX_WRITTEN)

    def trouble(self, now_ns: int) -> str:
        """Return what prevents driving, in words; empty if nothing does."""
        if self._socket is None:
            return "the serial watchdog is not running"
        if self.report is None:
            return "the serial watchdog is starting"
        if self._is_silent(now_ns, SUSPECT_NS, SUSPECT_STEPS):
            return "the serial watchdog is silent"
        return self.report.trouble

    def command(self, command: NigelCommand, now_ns: int) -> None:
        """Send a command and receive reports; start the watchdog if there is none."""
        self._receive(now_ns)
        self._stop_if_silent(now_ns)
        self._kill_if_hung(now_ns)
        self._start_if_needed(now_ns)
        if self._socket is None:
            return
        self._send(WatchdogCommand(now_ns, command))
        trouble = self.trouble(now_ns)
        if trouble != self._logged:
            self._logged = trouble
            level = logging.WARNING if trouble else logging.INFO
            event(_log, "serial", level=level, path=self._path, trouble=trouble or "none")

    def written(self) -> list[Written]:
        """Return, once, the commands that the watchdog wrote to the port, and when."""
        written = list(self._written)
        self._written.clear()
        return written

    def close(self) -> None:
        """Send zeros and wait until the watchdog has ended."""
        self._is_closed = True
        self._send(WatchdogCommand(0, REST))
        self._write_zeros()
        self._disconnect()
        if self._process is not None:
            try:
                self._process.wait(EXIT_TIMEOUT_S)
            except subprocess.TimeoutExpired:
                event(_log, "watchdog_hangs", level=logging.ERROR, path=self._path)
                self._process.kill()
                self._process.wait()
        self._fallback.close()

    def _start_if_needed(self, now_ns: int) -> None:
        if self._socket is not None or self._is_closed:
            return
        if self._process is not None and self._process.poll() is None:
            return  # it still holds the port
        if self._process is not None:
            self._fallback.open()
        if self._started_ns is not None and now_ns - self._started_ns < RESTART_NS:
            return
        self._started_ns = self._report_ns = now_ns
        self._unanswered, self.report = 0, None
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            self._process = (
                subprocess.Popen(  # a session of its own survives signals to the agent's group
                    [*self._argv, str(theirs.fileno())],
                    pass_fds=[theirs.fileno()],
                    start_new_session=True,
                )
            )
        ours.setblocking(False)
        self._socket = ours

    def _is_silent(self, now_ns: int, span_ns: int, steps: int) -> bool:
        return self._unanswered >= steps and now_ns - self._report_ns > span_ns

    def _receive(self, now_ns: int) -> None:
        self._unanswered += 1
        while self._socket is not None:
            try:
                data = self._socket.recv(MAX_PACKET_BYTES)
            except BlockingIOError:
                return
            except OSError:
                data = b""
            if not data:
                self._disconnect()
                event(_log, "watchdog_died", level=logging.ERROR, path=self._path)
                return
            self.report, self._report_ns, self._unanswered = _report_decoder.decode(data), now_ns, 0
            self._written += self.report.written
            self._fallback.close()

    def _stop_if_silent(self, now_ns: int) -> None:
        """Write zeros beside a watchdog that may hang."""
        if self._is_silent(now_ns, SUSPECT_NS, SUSPECT_STEPS):
            self._write_zeros()

    def _write_zeros(self) -> None:
        if self._socket is not None and self.report is not None and self.report.rest:
            self._fallback.write_beside(self.report.rest)

    def _kill_if_hung(self, now_ns: int) -> None:
        """Kill a watchdog that hangs: the next one resets the Arduino by opening the port."""
        if self._socket is None or self._process is None or self.report is None:
            return
        if not self._is_silent(now_ns, HANG_NS, HANG_STEPS):
            return
        event(_log, "watchdog_hangs", level=logging.ERROR, path=self._path)
        self._fallback.close_beside()
        self._process.kill()
        self._disconnect()

    def _send(self, command: WatchdogCommand) -> None:
        if self._socket is None:
            return
        with suppress(BlockingIOError, BrokenPipeError, ConnectionResetError):
            self._socket.send(msgspec.msgpack.encode(command))

    def _disconnect(self) -> None:
        if self._socket is not None:
            self._socket.close()
            self._socket = None
