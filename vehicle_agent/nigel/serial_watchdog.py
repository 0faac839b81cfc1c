"""The serial watchdog: a process of its own between the agent and the Arduino.

The published firmware obeys its last command for ever, so somebody must send zeros when the agent
does not. A thread of the agent would be killed, stopped and delayed together with it; this process
is not. It holds the port, speaks rosserial, and forwards commands. Without a command of the last
150 ms it sends zeros; when the agent is gone it sends zeros repeatedly, waits until they are out,
and ends. It never reads the bus and decides nothing else.

    python -m vehicle_agent.nigel.serial_watchdog PATH BAUD FD

FD is a SOCK_SEQPACKET socket to the agent.
"""

import logging
import select
import signal
import socket
import sys
import threading
from collections.abc import Callable, Sequence

import msgspec

from scm.clock import NS_PER_MS, Clock, WallClock
from scm.log import event
from scm.vehicles.guard import COMMAND_TIMEOUT_NS
from vehicle_agent.nigel.cable import Cable
from vehicle_agent.nigel.host import REST, Host, NigelCommand, Phase, clamped
from vehicle_agent.nigel.telemetry import Telemetry

LOOP_NS = 5 * NS_PER_MS
GOODBYES = 5  # zeros at the end, so that one arrives on a bad cable
GOODBYE_NS = 20 * NS_PER_MS
MAX_DRAIN_NS = 200 * NS_PER_MS  # for their transmission
MAX_PACKET_BYTES = 65536

_log = logging.getLogger(__name__)


class WatchdogCommand(msgspec.Struct, frozen=True, array_like=True):
    """From the agent: a command, and when it was made, on its clock [ns]."""

    t_ns: int
    command: NigelCommand


class Written(msgspec.Struct, frozen=True, array_like=True):
    """A command that was written to the port, and when, on this computer's clock [ns]."""

    t_ns: int
    throttle: float
    steering: float


class WatchdogReport(msgspec.Struct, frozen=True, array_like=True):
    """The watchdog's report to the agent.

    Attributes:
        trouble: What prevents driving, in words; empty if nothing does.
        readings: Number of telemetry readings received.
        rest: Frames with zero commands for the Arduino; empty if it cannot be commanded.
        written: Commands since the last report, oldest first.
    """

    phase: Phase
    trouble: str
    opened: int
    readings: int
    battery_v: float | None
    telemetry: Telemetry | None
    rest: bytes = b""
    written: tuple[Written, ...] = ()


_command_decoder = msgspec.msgpack.Decoder(WatchdogCommand)


class SerialWatchdog:
    """One cable, one rosserial connection, and the limit on the age of commands."""

    def __init__(self, cable: Cable, host: Host) -> None:
        self._cable, self._host = cable, host
        self._newest = WatchdogCommand(0, REST)
        self._opened = 0
        self._reported: tuple[str, str, int] | None = None
        self._must_reply = False
        self._written: list[Written] = []

    def step(self, now_ns: int, command: WatchdogCommand | None = None) -> None:
        """Read, answer, command; `command` is the newest from the agent since the last step."""
        if command is not None:
            self._newest, self._must_reply = command, True
        if self._cable.keep_open(now_ns) and self._cable.opened != self._opened:
            self._opened = self._cable.opened
            self._host.open(now_ns)
        answers = self._host.receive(self._cable.read(), now_ns)
        if self._cable.fd is None:
            self._host.close()
        else:
            self._write(
                answers + self._host.frames_due(self._valid_command(now_ns), now_ns), now_ns
            )

    def report(self) -> WatchdogReport | None:
        """Return a report: at each change, and as an answer to each command; else None."""
        trouble = self._cable.trouble or self._host.trouble
        news = (self._host.phase, trouble, self._host.readings)
        if news == self._reported and not self._must_reply:
            return None
        self._reported, self._must_reply = news, False
        written, self._written = tuple(self._written), []
        return WatchdogReport(
            phase=self._host.phase,
            trouble=trouble,
            opened=self._opened,
            readings=self._host.readings,
            battery_v=self._host.battery_v,
            telemetry=self._host.telemetry,
            rest=b"".join(self._host.rest()),
            written=written,
        )

    def finish(self, clock: Clock) -> None:
        """Send zeros repeatedly, wait until they have left, and close; bounded in time."""
        never = threading.Event()
        for _ in range(GOODBYES):
            self._cable.write(self._host.rest())
            clock.wait_until(clock.now_ns() + GOODBYE_NS, never)
        end_ns = clock.now_ns() + MAX_DRAIN_NS
        while not self._cable.is_drained() and clock.now_ns() < end_ns:
            clock.wait_until(clock.now_ns() + LOOP_NS, never)
        self._cable.close()

    def _write(self, frames: Sequence[bytes], now_ns: int) -> None:
        """Send frames, and record the command in them if all found room."""
        held_back, commanded = self._cable.held_back, self._host.commanded
        self._cable.write(frames)
        if commanded is not None and self._cable.held_back == held_back:
            throttle, steering = clamped(commanded.throttle), clamped(commanded.steering)
            self._written.append(Written(now_ns, throttle, steering))

    def _valid_command(self, now_ns: int) -> NigelCommand:
        return (
            self._newest.command if abs(now_ns - self._newest.t_ns) <= COMMAND_TIMEOUT_NS else REST
        )


class _Agent:
    """The agent's end of the socket."""

    def __init__(self, line: socket.socket) -> None:
        self._line = line
        self._line.setblocking(False)
        self.is_gone = False

    def fileno(self) -> int:
        return self._line.fileno()

    def newest(self) -> WatchdogCommand | None:
        """Return the newest received command, None if there is none."""
        newest: WatchdogCommand | None = None
        while not self.is_gone:
            try:
                data = self._line.recv(MAX_PACKET_BYTES)
            except BlockingIOError:
                break
            except OSError:
                data = b""
            if not data:
                self.is_gone = True
                break
            newest = _command_decoder.decode(data)
        return newest

    def send(self, report: WatchdogReport | None) -> None:
        """Send a report; drop it if there is no room, since the next one replaces it."""
        if report is None:
            return
        try:
            self._line.send(msgspec.msgpack.encode(report))
        except BlockingIOError:
            return
        except OSError:
            self.is_gone = True


def serve(
    watchdog: SerialWatchdog, agent: _Agent, cable: Cable, clock: Clock, ended: list[int]
) -> None:
    """Run until the agent is gone or a signal arrives; zeros go out at the end."""
    try:
        while not agent.is_gone and not ended:
            watched = [agent.fileno(), *([] if cable.fd is None else [cable.fd])]
            select.select(watched, [], [], LOOP_NS / 1e9)
            command = agent.newest()
            now_ns = clock.now_ns()
            watchdog.step(now_ns, command)
            agent.send(watchdog.report())
    finally:
        watchdog.finish(clock)


def note_signals() -> list[int]:
    """Return a list that collects the numbers of termination signals."""
    ended: list[int] = []
    note: Callable[[int, object], None] = lambda number, _frame: ended.append(number)  # noqa: E731
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
        signal.signal(number, note)
    return ended


def main(argv: Sequence[str]) -> None:
    """Run for the port `argv[0]` at `argv[1]` baud, for the agent behind socket `argv[2]`."""
    path, baud, number = argv[0], int(argv[1]), int(argv[2])
    ended = note_signals()
    cable, host = Cable(path, baud), Host(baud)
    agent = _Agent(socket.socket(fileno=number))
    try:
        serve(SerialWatchdog(cable, host), agent, cable, WallClock(), ended)
    except Exception as fault:
        event(_log, "watchdog_failed", level=logging.ERROR, path=path, reason=repr(fault))
        raise


if __name__ == "__main__":
    main(sys.argv[1:])
