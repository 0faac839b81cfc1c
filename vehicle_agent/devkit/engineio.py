"""The client's side of socket.io over one WebSocket, for servers of both generations.

    text of a frame         what it is                      python-socketio 4.x     5.x
    0{"sid": ...}           Engine.IO: welcome              server                  server
    40                      Socket.IO: connected            server, unasked         asked by ours
    42["Bridge", {...}]     an event                        both                    both
    4217["Bridge", {...}]   one that wants to be confirmed  ours                    ours
    4317[...]               its handler has returned        server                  server
    2, answered by 3        still there?                    client asks             server asks
    41, 1                   leaves                          server                  server
    44...                   refuses                         server                  server

A server that says nothing for a second, as the Devkit's C++ and MATLAB examples, knows events
alone: it is sent bare ones, and no pings.

`Dialogue` is the protocol without a socket or a clock; `ScriptSocket` is the thread that keeps it
up with one script: whichever starts first, and however often the script ends and comes back.
"""

import contextlib
import json
import logging
import socket
import threading
from collections.abc import Callable
from typing import Any

import msgspec
from websockets.exceptions import WebSocketException
from websockets.sync.client import ClientConnection, reconnect

from scm.clock import NS_PER_MS, NS_PER_S, Clock, seconds
from scm.log import event
from vehicle_agent.devkit.deflate import OfferToDeflate, Packet, inflates
from vehicle_agent.devkit.pingpong import PingPong

EVENT = "Bridge"
PING_EVERY_NS = 20 * NS_PER_S
PONG_WITHIN_NS = 20 * NS_PER_S
ASK_AFTER_NS = 200 * NS_PER_MS
JOIN_WITHIN_NS = 5 * NS_PER_S
SILENT_NS = NS_PER_S
ANSWER_WITHIN_NS = 30 * NS_PER_S
RETRY_NS = NS_PER_S // 2
LOOK_NS = 50 * NS_PER_MS
MOST_DIGITS = 40
LONGEST_SPAN_MS = 86_400_000
MOST_BYTES = 2**20
OPEN_S = 5.0

_log = logging.getLogger(__name__)


class Dialogue:
    """One connection's protocol; it begins when the WebSocket is open.

    Attributes:
        is_open: Whether events may be sent.
        ended: Why it is over, in words; empty: it is not.
        generation: Of the server's protocol: 3, 4, or 0 while that is not known.
        unread: What it last said that could not be read, in words; empty: nothing.
        is_bare: Whether it said nothing, so that it is told bare events.
        eaten: Number of the newest packet whose handler has returned, as far as told; 0: none.
    """

    def __init__(self, now_ns: int) -> None:
        self.is_open = self.is_bare = False
        self.ended = ""
        self.generation = 0
        self.unread = ""
        self.eaten = 0
        self._began_ns = now_ns
        self._welcome_ns: int | None = None
        self._out: list[str] = []
        self._asked = False
        self._alarm_ns = now_ns + JOIN_WITHIN_NS
        self._server_asks_ns = 0
        self._waits_for_pong = False

    @property
    def due_ns(self) -> int:
        """When `due` has something to do without hearing anything [ns]."""
        if self._out:
            return self._began_ns
        if self._welcome_ns is not None and not self.is_open and not self._asked:
            return min(self._alarm_ns, self._welcome_ns + ASK_AFTER_NS)
        if self._welcome_ns is None and not self.is_open:
            return min(self._alarm_ns, self._began_ns + SILENT_NS)
        return self._alarm_ns

    def due(self, now_ns: int) -> list[str]:
        """Return the frames to send now."""
        if not self.is_open and not self._asked and self._welcome_ns is not None:
            if self.generation == 4 or now_ns - self._welcome_ns >= ASK_AFTER_NS:
                self._asked, self.generation = True, 4
                self._out.append("40")
        elif self._is_silent(now_ns):
            self.is_open = self.is_bare = True
            self._alarm_ns = now_ns + ANSWER_WITHIN_NS
        elif now_ns >= self._alarm_ns and not self.ended:
            self._ring(now_ns)
        out, self._out = self._out, []
        return out

    def _is_silent(self, now_ns: int) -> bool:
        unheard = self._welcome_ns is None and not self.is_open
        return unheard and now_ns - self._began_ns >= SILENT_NS

    def _ring(self, now_ns: int) -> None:
        if not self.is_open or self.is_bare:
            waited_s = seconds(now_ns - self._began_ns)
            self.ended = f"it is no socket.io server, or does not answer: waited {waited_s:.0f} s"
        elif self.generation == 4:
            self.ended = "it has not asked whether we are still there"
        elif self._waits_for_pong:
            self.ended = "it does not answer our ping"
        else:
            self._out.append("2")
            self._waits_for_pong = True
            self._alarm_ns = now_ns + PONG_WITHIN_NS

    def take(self, text: str, now_ns: int) -> list[Any]:
        """Read a frame; return the payloads of the Bridge events in it. Nothing makes it raise."""
        kind, rest = text[:1], text[1:]
        if kind == "4":
            return self._take_message(rest, now_ns)
        if kind == "0":
            self._welcome(rest, now_ns)
        elif kind == "1":
            self.ended = "it closed the connection"
        elif kind == "2":
            self._out.append("3" + rest)
            self._alarm_ns = now_ns + self._server_asks_ns
        elif kind == "3" and self._waits_for_pong:
            self._waits_for_pong = False
            self._alarm_ns = now_ns + PING_EVERY_NS
        return []

    def _welcome(self, text: str, now_ns: int) -> None:
        if self.is_bare:  # it was only slow
            self.is_open = self.is_bare = False
            self._alarm_ns = now_ns + JOIN_WITHIN_NS
        self._welcome_ns = now_ns
        told = self._decoded(text, dict, "its welcome") or {}
        self.generation = 4 if "maxPayload" in told else 0
        spans = [told.get(key) for key in ("pingInterval", "pingTimeout")]
        spans_ms = [
            min(span, LONGEST_SPAN_MS)
            for span in spans
            if isinstance(span, int | float) and span > 0
        ]
        self._server_asks_ns = round((sum(spans_ms) or 45_000) * NS_PER_MS)

    def _take_message(self, text: str, now_ns: int) -> list[Any]:
        kind, rest = text[:1], text[1:]
        if kind == "0":
            self.is_open = True
            self.generation = self.generation or 3
            every_ns = PING_EVERY_NS if self.generation == 3 else self._server_asks_ns
            self._alarm_ns = now_ns + every_ns
        elif kind == "1":
            self.ended = "it disconnected us"
        elif kind == "4":
            self.ended = f"it refused us: {rest[:100] or 'it does not say why'}"
        elif kind == "2":
            if self.is_bare:
                self._alarm_ns = now_ns + ANSWER_WITHIN_NS
            return self._take_event(rest.lstrip("0123456789"))
        elif kind == "3":
            number = rest[:MOST_DIGITS].partition("[")[0]
            self.eaten = int(number) if number.isascii() and number.isdecimal() else self.eaten
        return []

    def _take_event(self, text: str) -> list[Any]:
        told = self._decoded(text, list, "an event")
        if told is None:
            return []
        if len(told) > 1 and told[0] == EVENT:
            return [told[1]]
        name = told[0][:MOST_DIGITS] if told and isinstance(told[0], str) else ""
        self.unread = f"an event {name!r} with {len(told[1:])} values, expected {EVENT!r} with one"
        return []

    def _decoded(self, text: str, wanted: type, what: str) -> Any:
        """Return what JSON says if it is of the wanted type; else None, and say so."""
        told = _decoded(text)
        if isinstance(told, wanted):
            return told
        self.unread = f"{what} is no JSON {wanted.__name__}: {text[:MOST_DIGITS]!r}"
        return None


def _decoded(text: str) -> Any:
    """Return what JSON says, NaN and Infinity allowed as Python writes them; None: it is none."""
    try:
        return msgspec.json.decode(text)
    except (msgspec.DecodeError, UnicodeError, RecursionError):
        pass
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        return None


def _reason(cause: Exception) -> str:
    if isinstance(cause, ConnectionRefusedError):
        return "nothing listens there yet"
    return str(cause)[:200] or type(cause).__name__


def _answer_at_once(held: socket.socket) -> None:
    """Let TCP confirm without delay: until then a script's next small frame is held back."""
    if hasattr(socket, "TCP_QUICKACK"):
        held.setsockopt(socket.IPPROTO_TCP, socket.TCP_QUICKACK, 1)


class _Straight(reconnect):
    """A connection to the address that was asked for and to no other."""

    def process_redirect(self, exc: Exception) -> Exception:
        """Refuse to follow."""
        return exc


class ScriptSocket:
    """Keeps up the conversation with one script, on a thread of its own.

    Args:
        address: Host and port of the script's server.
        packet: Returns the newest telemetry; None: there is nothing to tell yet.
        on_reply: Takes what the script said, and when.
        clock: Of this process.
        gap_ns: Least time between two packets; 0: as fast as the script answers.

    Attributes:
        pace: Of the conversation that runs, or of the last one.
        is_open: Whether a script is there.
        failure: What ended the thread: a fault of ours; None: nothing did.
    """

    def __init__(
        self,
        address: tuple[str, int],
        packet: Callable[[], Packet | None],
        on_reply: Callable[[Any, int], None],
        clock: Clock,
        gap_ns: int = 0,
    ) -> None:
        self._address = address
        self._packet = packet
        self._on_reply = on_reply
        self._clock = clock
        self._gap_ns = gap_ns
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._live, name="devkit-script", daemon=True)
        self._open: socket.socket | None = None
        self._said = ""
        self._was_unread = False
        self.pace = PingPong(gap_ns)
        self.is_open = False
        self.failure: Exception | None = None

    def start(self) -> None:
        """Begin to look for the script."""
        self._thread.start()

    def stop(self) -> None:
        """Leave the script; a send that hangs on a frozen one is cut off."""
        self._stop.set()
        held = self._open
        if held is not None:
            with contextlib.suppress(OSError):
                held.shutdown(socket.SHUT_RDWR)
        self._thread.join(2.0)

    @property
    def detail(self) -> str:
        """How it stands with the script, in words."""
        return self._said

    def _live(self) -> None:
        try:
            self._run()
        except Exception as cause:  # noqa: BLE001  the edge of a thread: the bridge's own one raises it
            self.failure, self.is_open = cause, False

    def _run(self) -> None:
        host, port = self._address
        url = f"ws://{host}:{port}/socket.io/?EIO=4&transport=websocket"
        while not self._stop.is_set():
            why = "it went away"
            try:
                with _Straight(
                    url, compression=None, extensions=[OfferToDeflate()], max_size=MOST_BYTES,
                    ping_interval=None, proxy=None, open_timeout=OPEN_S, close_timeout=1.0,
                ) as connection:  # fmt: skip
                    self._open = connection.socket
                    why = self._talk(connection)
            except (OSError, WebSocketException) as cause:
                why = _reason(cause)
            except Exception as cause:
                if self.failure is not None:
                    raise
                why = f"{type(cause).__name__}: {_reason(cause)}"
            self._open, self.is_open = None, False
            if self._stop.is_set():
                return
            self._say(f"no script at {host}:{port}: {why}; looks again every half second")
            self._clock.wait_until(self._clock.now_ns() + RETRY_NS, self._stop)

    def _say(self, what: str) -> None:
        if what != self._said:
            self._said = what
            level = logging.INFO if self.is_open else logging.WARNING
            event(_log, "devkit_script", level=level, state=repr(what))

    def _talk(self, connection: ClientConnection) -> str:
        """Converse until it is over; return why it is."""
        dialogue = Dialogue(self._clock.now_ns())
        self.pace, self._was_unread = PingPong(self._gap_ns), False
        while not self._stop.is_set() and not dialogue.ended:
            now_ns = self._clock.now_ns()
            for text in dialogue.due(now_ns):
                connection.send(text)
            wake_ns = dialogue.due_ns
            if dialogue.is_open:
                wake_ns = min(wake_ns, self._push(connection, dialogue.is_bare, now_ns))
            wait_s = seconds(wake_ns - self._clock.now_ns())
            try:
                got = connection.recv(timeout=max(0.0, wait_s))
            except TimeoutError:
                continue
            if isinstance(got, str):
                self._hear(dialogue, got)
            else:
                dialogue.unread = f"{len(got)} bytes that are no text"
            self._tell_unread(dialogue)
            _answer_at_once(connection.socket)
        return dialogue.ended

    def _push(self, connection: ClientConnection, is_bare: bool, now_ns: int) -> int:
        """Send a packet if one is due; return when to look again [ns]."""
        due_ns = self.pace.due_ns(now_ns)
        if due_ns > now_ns:
            return due_ns
        try:
            packet = self._packet()
        except Exception as cause:
            self.failure = cause
            raise
        if packet is None:
            return now_ns + LOOK_NS
        number = None if is_bare else self.pace.packets + 1
        if inflates(connection):
            connection.send(packet.deflated(number), text=True)
        else:
            connection.send(packet.text(number))
        self.pace.sent(now_ns)
        return self.pace.due_ns(now_ns)

    def _hear(self, dialogue: Dialogue, text: str) -> None:
        now_ns = self._clock.now_ns()
        eaten = dialogue.eaten
        for told in dialogue.take(text, now_ns):
            self.pace.replied(now_ns)
            self._on_reply(told, now_ns)
        if dialogue.eaten != eaten:
            self.pace.eaten(min(dialogue.eaten, self.pace.packets))
        if dialogue.is_open and not self.is_open:
            self.is_open = True
            host, port = self._address
            protocol = "events alone" if dialogue.is_bare else f"protocol {dialogue.generation}"
            self._say(f"talks with the script at {host}:{port}, {protocol}")

    def _tell_unread(self, dialogue: Dialogue) -> None:
        if dialogue.unread and not self._was_unread:
            self._was_unread = True
            event(_log, "devkit_unread", level=logging.WARNING, why=repr(dialogue.unread))
