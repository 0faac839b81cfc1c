"""Driving a car from a program: `with city.wheel("n1") as wheel: wheel.drive(0.2, 0.0)`.

The program is its own dead-man: nothing is sent but by `drive`, so one that hangs, waits or dies
sends the car nothing. The city then sets zero throttle after 250 ms and releases the lease after
5 s; the car's own guard stops it in any case.
"""

import contextlib
from collections.abc import Iterator
from time import monotonic

import msgspec
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection

from scm.client.connection import Connection, part
from scm.errors import LinkError, MessageError, ScmError
from scm.records.drive import PROTOCOL, Acquired, DriveStatus, Over

PERIOD_S = 0.05
SILENT_S = 2.0
ANSWER_S = 6.0


class WheelError(ScmError):
    """This connection does not, or no longer, drive the car; `over` has the reason."""

    def __init__(self, vehicle: str, over: Over) -> None:
        super().__init__(f"{vehicle}: {over.code}: {over.detail}")
        self.over = over


_words: msgspec.json.Decoder[Acquired | DriveStatus | Over] = msgspec.json.Decoder(
    Acquired | DriveStatus | Over
)
_NOTHING_YET = DriveStatus(
    seq=None, t_ms=None, why="released", throttle=0.0, steering=0.0, mode="", speed_mps=None
)


@contextlib.contextmanager
def acquired(connection: Connection, vehicle: str, reason: str) -> Iterator["Wheel"]:
    """Take a car's wheel, and give it back in the end, whatever happens.

    Args:
        connection: To the city.
        vehicle: The car.
        reason: With one it is taken over from its present owner; the city logs it.

    Raises:
        ProblemError: when the city refuses the connection.
        WheelError: when it refuses the car.
        LinkError: when it does not answer.
    """
    with connection.socket(f"/api/v1/vehicles/{part(vehicle)}/drive", PROTOCOL) as socket:
        wheel = Wheel(socket, vehicle)
        wheel.acquire(reason)
        try:
            yield wheel
        except BaseException:
            with contextlib.suppress(LinkError):
                wheel.give_back()
            raise
        wheel.give_back()


class Wheel:
    """One car in the hands of this program.

    Args:
        socket: Of the drive protocol.
        vehicle: The car.

    Attributes:
        status: The last command in force and the car's state.
        over: How it ended; None: it has not.
    """

    def __init__(self, socket: ClientConnection, vehicle: str) -> None:
        self._socket, self._vehicle, self._seq = socket, vehicle, 0
        self._next_s = monotonic()
        self.status = _NOTHING_YET
        self.over: Over | None = None

    def acquire(self, reason: str) -> Acquired | DriveStatus:
        """Acquire the car; raises as `taken`."""
        self._send({"type": "take", "reason": reason})
        return self._expect(ANSWER_S)

    def drive(self, throttle: float, steering: float, for_s: float = 0.0) -> DriveStatus:
        """Drive for 50 ms, or for longer, and return the last command in force.

        Args:
            throttle: -1 to 1, + = forward.
            steering: -1 to 1, + = left.
            for_s: How long; the command is repeated every 50 ms.

        Raises:
            WheelError: when the wheel is lost.
            LinkError: when the city falls silent.
        """
        until_s = monotonic() + for_s
        while True:
            self._send_drive(throttle, steering)
            self._listen()
            if monotonic() >= until_s:
                return self.status

    def give_back(self) -> Over:
        """Release the car, and return what it does: it continues its trip, or stands.

        Raises:
            LinkError: when the city does not reply.
        """
        self._send({"type": "give_back"})
        until_s = monotonic() + ANSWER_S
        while self.over is None:
            with contextlib.suppress(WheelError):
                self._expect(until_s - monotonic())
        return self.over

    def _send_drive(self, throttle: float, steering: float) -> None:
        now_s = monotonic()
        self._next_s = max(self._next_s, now_s - PERIOD_S) + PERIOD_S
        self._seq += 1
        command = {"held": True, "throttle": throttle, "steering": steering}
        self._send({"type": "drive", "seq": self._seq, "t_ms": 1e3 * now_s, **command})

    def _listen(self) -> None:
        """Receive from the city until the next command is due, one message at least."""
        self._expect(SILENT_S)
        while (left_s := self._next_s - monotonic()) > 0.0:
            self._receive(left_s)

    def _send(self, word: dict[str, object]) -> None:
        with contextlib.suppress(ConnectionClosed):  # its last message is received all the same
            self._socket.send(msgspec.json.encode(word).decode())

    def _expect(self, timeout_s: float) -> Acquired | DriveStatus:
        """Return the next word, which has to come."""
        word = self._receive(timeout_s)
        if word is None:
            msg = f"{self._vehicle}: no reply from the city in time; is `scm up` running?"
            raise LinkError(msg)
        return word

    def _receive(self, timeout_s: float) -> Acquired | DriveStatus | None:
        """Return the next word; None: none came in time.

        Raises:
            WheelError: when it is the last one.
        """
        try:
            word = _words.decode(self._socket.recv(timeout=max(timeout_s, 0.0)))
        except TimeoutError:
            return None
        except ConnectionClosed:
            word = Over(code="ended", detail="the connection ended")
        except msgspec.MsgspecError as cause:
            msg = f"{self._vehicle}: {cause}: is the server another version?"
            raise MessageError(msg) from cause
        if isinstance(word, Over):
            self.over = self.over or word
            raise WheelError(self._vehicle, self.over)
        if isinstance(word, DriveStatus):
            self.status = word
        return word
