"""The keeper of the cable: a process of its own between the agent and the Arduino.

The published firmware obeys its last command for ever, so somebody must be there to say zero when
the agent is not. A thread of the agent would be killed, stopped and held up together with it; this
process is not. It holds the port, talks rosserial, and passes wishes on; when no wish of the last
150 ms is there it sends zeros, and when the agent is gone it sends them again and again, waits
until they are out, and ends. It never reads the bus and decides nothing else.

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
from vehicle_agent.nigel.cable import Cable
from vehicle_agent.nigel.host import REST, Host, Phase, Wish, limited
from vehicle_agent.nigel.telemetry import Telemetry

PATIENCE_NS = 150 * NS_PER_MS
"""As the guard's: for so long a wish holds."""
TURN_NS = 5 * NS_PER_MS
GOODBYES = 5
GOODBYE_NS = 20 * NS_PER_MS
DRAIN_NS = 200 * NS_PER_MS
LONGEST = 65536

_log = logging.getLogger(__name__)


class Asked(msgspec.Struct, frozen=True, array_like=True):
    """What the agent sends: a wish, and when it was made, on its clock [ns]."""

    t_ns: int
    wish: Wish


class Written(msgspec.Struct, frozen=True, array_like=True):
    """A command that was written to the port, and when, on this computer's clock [ns]."""

    t_ns: int
    throttle: float
    steering: float


class Told(msgspec.Struct, frozen=True, array_like=True):
    """What the keeper sends.

    Attributes:
        trouble: What keeps the car from being driven, in words; empty: nothing.
        readings: How many telemetries have come.
        rest: Frames that say zero to the Arduino as it is now; empty: it could not be told.
        written: All since the last report, oldest first.
    """

    phase: Phase
    trouble: str
    opened: int
    readings: int
    battery_v: float | None
    telemetry: Telemetry | None
    rest: bytes = b""
    written: tuple[Written, ...] = ()


_asked = msgspec.msgpack.Decoder(Asked)


class Keeper:
    """One cable, one conversation, and the last word on how old a wish may be."""

    def __init__(self, cable: Cable, host: Host) -> None:
        self._cable, self._host = cable, host
        self._asked = Asked(0, REST)
        self._opened = 0
        self._reported: tuple[str, str, int] | None = None
        self._owes = False
        self._written: list[Written] = []

    def step(self, now_ns: int, asked: Asked | None = None) -> None:
        """Read, answer, command; `asked` is what the agent said since the last step."""
        if asked is not None:
            self._asked, self._owes = asked, True
        if self._cable.keep_open(now_ns) and self._cable.opened != self._opened:
            self._opened = self._cable.opened
            self._host.open(now_ns)
        answers = self._host.hear(self._cable.read(), now_ns)
        if self._cable.fd is None:
            self._host.close()
        else:
            self._write(answers + self._host.say(self._wish(now_ns), now_ns), now_ns)

    def report(self) -> Told | None:
        """Return what the agent is to know: at each change, and as an answer to each wish."""
        trouble = self._cable.trouble or self._host.trouble
        news = (self._host.phase, trouble, self._host.readings)
        if news == self._reported and not self._owes:
            return None
        self._reported, self._owes = news, False
        written, self._written = tuple(self._written), []
        return Told(
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
        """Send zeros again and again, wait until they have left, and close; never for long."""
        never = threading.Event()
        for _ in range(GOODBYES):
            self._cable.write(self._host.rest())
            clock.wait_until(clock.now_ns() + GOODBYE_NS, never)
        end_ns = clock.now_ns() + DRAIN_NS
        while not self._cable.is_drained() and clock.now_ns() < end_ns:
            clock.wait_until(clock.now_ns() + TURN_NS, never)
        self._cable.close()

    def _write(self, frames: Sequence[bytes], now_ns: int) -> None:
        """Send frames, and note the command among them if all found room."""
        held_back, command = self._cable.held_back, self._host.commanded
        self._cable.write(frames)
        if command is not None and self._cable.held_back == held_back:
            said = limited(command.throttle), limited(command.steering)
            self._written.append(Written(now_ns, *said))

    def _wish(self, now_ns: int) -> Wish:
        return self._asked.wish if abs(now_ns - self._asked.t_ns) <= PATIENCE_NS else REST


class _Agent:
    """The agent's end of the socket."""

    def __init__(self, line: socket.socket) -> None:
        self._line = line
        self._line.setblocking(False)
        self.is_gone = False

    def fileno(self) -> int:
        return self._line.fileno()

    def newest(self) -> Asked | None:
        """Return the last of all that has come, None where nothing has."""
        newest: Asked | None = None
        while not self.is_gone:
            try:
                data = self._line.recv(LONGEST)
            except BlockingIOError:
                break
            except OSError:
                data = b""
            if not data:
                self.is_gone = True
                break
            newest = _asked.decode(data)
        return newest

    def tell(self, told: Told | None) -> None:
        """Send a report; one that finds no room is as old as the next is new."""
        if told is None:
            return
        try:
            self._line.send(msgspec.msgpack.encode(told))
        except BlockingIOError:
            return
        except OSError:
            self.is_gone = True


def serve(keeper: Keeper, agent: _Agent, cable: Cable, clock: Clock, ended: list[int]) -> None:
    """Keep the cable until the agent is gone or a signal was noted; zeros go out at the end."""
    try:
        while not agent.is_gone and not ended:
            watched = [agent.fileno(), *([] if cable.fd is None else [cable.fd])]
            select.select(watched, [], [], TURN_NS / 1e9)
            asked = agent.newest()
            now_ns = clock.now_ns()
            keeper.step(now_ns, asked)
            agent.tell(keeper.report())
    finally:
        keeper.finish(clock)


def note_signals() -> list[int]:
    """Return a list that gets the number of each signal that asks to end."""
    ended: list[int] = []
    note: Callable[[int, object], None] = lambda number, _frame: ended.append(number)  # noqa: E731
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
        signal.signal(number, note)
    return ended


def main(argv: Sequence[str]) -> None:
    """Keep the cable at `argv[0]`, `argv[1]` baud, for the agent behind socket `argv[2]`."""
    path, baud, number = argv[0], int(argv[1]), int(argv[2])
    ended = note_signals()
    cable, host = Cable(path, baud), Host(baud)
    agent = _Agent(socket.socket(fileno=number))
    try:
        serve(Keeper(cable, host), agent, cable, WallClock(), ended)
    except Exception as fault:
        event(_log, "keeper_failed", level=logging.ERROR, path=path, reason=repr(fault))
        raise


if __name__ == "__main__":
    main(sys.argv[1:])
