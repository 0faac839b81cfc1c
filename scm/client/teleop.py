"""The wheel of a car, from a program: `with city.wheel("n1") as wheel: wheel.drive(0.2, 0.0)`.

The program is its own dead-man: nothing is sent but by `drive`, so one that hangs, waits or dies
tells the car nothing. The city then lets go of the throttle after 250 ms and takes the wheel back
after 5 s; the car's own guard stops it besides.
"""

import contextlib
from collections.abc import Iterator
from time import monotonic

import msgspec
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection

from scm.client.connection import Connection, part
from scm.errors import LinkError, MessageError, ScmError

PROTOCOL = "scm.drive.v1"
BEAT_S = 0.05
SILENT_S = 2.0
ANSWER_S = 6.0


class Taken(msgspec.Struct, kw_only=True, frozen=True, tag="taken"):
    """The wheel is yours.

    Attributes:
        vehicle: The car.
        owner: In whose name: that of your key, and of this connection alone.
        epoch: Of the lease.
    """

    vehicle: str
    owner: str
    epoch: int


class Told(msgspec.Struct, kw_only=True, frozen=True, tag="told"):
    """What the car was told last.

    Attributes:
        seq: Number of your newest packet that counted; None: none came yet.
        t_ms: When you sent it, by your clock [ms].
        why: `driving`, `released` (you hold nothing) or `silent` (no packet for 250 ms).
        throttle: -1 to 1, + = forward.
        steering: -1 to 1, + = left.
        mode: The car's, as the world last told it: `stop` also while the city is stopped.
        speed_mps: How fast it is, + = forward [m/s]; None: not known.
    """

    seq: int | None
    t_ms: float | None
    why: str
    throttle: float
    steering: float
    mode: str
    speed_mps: float | None


class Over(msgspec.Struct, kw_only=True, frozen=True, tag="over"):
    """You do not hold the wheel any more.

    Attributes:
        code: `given_back`, `abandoned`, `lost`, `ended`, or the city's word for its refusal.
        detail: What became of the car, or why it was refused.
    """

    code: str
    detail: str


class WheelError(ScmError):
    """The car is not, or no longer, in these hands; `over` says why."""

    def __init__(self, vehicle: str, over: Over) -> None:
        super().__init__(f"{vehicle}: {over.code}: {over.detail}")
        self.over = over


_words: msgspec.json.Decoder[Taken | Told | Over] = msgspec.json.Decoder(Taken | Told | Over)
_NOTHING_YET = Told(
    seq=None, t_ms=None, why="released", throttle=0.0, steering=0.0, mode="", speed_mps=None
)


@contextlib.contextmanager
def taken(connection: Connection, vehicle: str, reason: str) -> Iterator["Wheel"]:
    """Take a car's wheel, and give it back in the end, whatever happens.

    Args:
        connection: To the city.
        vehicle: The car.
        reason: With one it is taken from whoever holds it; the city's log keeps it.

    Raises:
        ProblemError: when the city refuses the connection.
        WheelError: when it refuses the car.
        LinkError: when it does not answer.
    """
    with connection.socket(f"/api/v1/vehicles/{part(vehicle)}/drive", PROTOCOL) as socket:
        wheel = Wheel(socket, vehicle)
        wheel.take(reason)
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
        socket: To the car's seat.
        vehicle: The car.

    Attributes:
        told: What the car was told last.
        over: How it ended; None: it has not.
    """

    def __init__(self, socket: ClientConnection, vehicle: str) -> None:
        self._socket, self._vehicle, self._seq = socket, vehicle, 0
        self._next_s = monotonic()
        self.told = _NOTHING_YET
        self.over: Over | None = None

    def take(self, reason: str) -> Taken | Told:
        """Ask for the wheel; raises as `taken`."""
        self._say({"type": "take", "reason": reason})
        return self._expect(ANSWER_S)

    def drive(self, throttle: float, steering: float, for_s: float = 0.0) -> Told:
        """Drive for a beat of 50 ms, or for longer, and return what the car was told last.

        Args:
            throttle: -1 to 1, + = forward.
            steering: -1 to 1, + = left.
            for_s: How long; the wish is sent anew every beat.

        Raises:
            WheelError: when the wheel is lost.
            LinkError: when the city falls silent.
        """
        until_s = monotonic() + for_s
        while True:
            self._wish(throttle, steering)
            self._listen()
            if monotonic() >= until_s:
                return self.told

    def give_back(self) -> Over:
        """Let go, and return what becomes of the car: it goes on with its trip, or stands.

        Raises:
            LinkError: when the city does not say.
        """
        self._say({"type": "give_back"})
        until_s = monotonic() + ANSWER_S
        while self.over is None:
            with contextlib.suppress(WheelError):
                self._expect(until_s - monotonic())
        return self.over

    def _wish(self, throttle: float, steering: float) -> None:
        now_s = monotonic()
        self._next_s = max(self._next_s, now_s - BEAT_S) + BEAT_S
        self._seq += 1
        wish = {"held": True, "throttle": throttle, "steering": steering}
        self._say({"type": "drive", "seq": self._seq, "t_ms": 1e3 * now_s, **wish})

    def _listen(self) -> None:
        """Hear the city until the next wish is due, one word at least."""
        self._expect(SILENT_S)
        while (left_s := self._next_s - monotonic()) > 0.0:
            self._hear(left_s)

    def _say(self, word: dict[str, object]) -> None:
        with contextlib.suppress(ConnectionClosed):  # what it said last is heard all the same
            self._socket.send(msgspec.json.encode(word).decode())

    def _expect(self, timeout_s: float) -> Taken | Told:
        """Return the next word, which has to come."""
        word = self._hear(timeout_s)
        if word is None:
            msg = f"{self._vehicle}: the city said nothing in time; is `scm up` running?"
            raise LinkError(msg)
        return word

    def _hear(self, timeout_s: float) -> Taken | Told | None:
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
        if isinstance(word, Told):
            self.told = word
        return word
