"""The client's side of socket.io over one WebSocket, for servers of both generations.

    text of a frame         what it is                      python-socketio 4.x     5.x
    0{"sid": ...}           Engine.IO: welcome              server                  server
    40                      Socket.IO: connected            server, at once         on request
    42["Bridge", {...}]     an event                        both                    both
    4217["Bridge", {...}]   one to be confirmed             ours                    ours
    4317[...]               its handler has returned        server                  server
    2, answered by 3        ping                            client                  server
    41, 1                   disconnects                     server                  server
    44...                   refuses                         server                  server

A server that is silent for a second, as the Devkit's C++ and MATLAB examples are, supports only
events: it receives bare ones, and no pings.

`Dialogue` is the protocol without a socket or a clock; `ScriptSocket` is the thread that maintains
the connection to one script: whichever starts first, and however often the script restarts.
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
PONG_TIMEOUT_NS = 20 * NS_PER_S
CONNECT_AFTER_NS = 200 * NS_PER_MS  # a server of generation 3 connects by itself before
JOIN_TIMEOUT_NS = 5 * NS_PER_S
SILENT_SERVER_NS = NS_PER_S
ANSWER_TIMEOUT_NS = 30 * NS_PER_S
RETRY_NS = NS_PER_S // 2
POLL_NS = 50 * NS_PER_MS
MAX_SHOWN_CHARS = 40
MAX_PING_MS = 86_400_000  # a day; more is a broken welcome
MAX_MESSAGE_BYTES = 2**20
OPEN_TIMEOUT_S = 5.0

_log = logging.getLogger(__name__)


class Dialogue:
    """The protocol of one connection; it begins when the WebSocket is open.

    Attributes:
        is_open: Whether events may be sent.
        ended: Why it is over, in words; empty while it is not.
        generation: Of the server's protocol: 3, 4, or 0 while not known.
        unread: The last frame that could not be read, in words; empty if none.
        is_bare: Whether the server was silent, so that it gets bare events.
        handled: Number of the newest packet that was confirmed as handled; 0: none.
    """

    def __init__(self, now_ns: int) -> None:
        self.is_open = self.is_bare = False
        self.ended = ""
        self.generation = 0
        self.unread = ""
        self.handled = 0
        self._began_ns = now_ns
        self._welcome_ns: int | None = None
        self._out: list[str] = []
        self._connect_sent = False
        self._alarm_ns = now_ns + JOIN_TIMEOUT_NS
        self._ping_timeout_ns = 0
        self._waits_for_pong = False

    @property
    def due_ns(self) -> int:
        """When `due` has something to do even if nothing is received [ns]."""
        if self._out:
            return self._began_ns
        if self._welcome_ns is not None and not self.is_open and not self._connect_sent:
            return min(self._alarm_ns, self._welcome_ns + CONNECT_AFTER_NS)
        if self._welcome_ns is None and not self.is_open:
            return min(self._alarm_ns, self._began_ns + SILENT_SERVER_NS)
        return self._alarm_ns

    def due(self, now_ns: int) -> list[str]:
        """Return the frames to send now."""
        if not self.is_open and not self._connect_sent and self._welcome_ns is not None:
            if self.generation == 4 or now_ns - self._welcome_ns >= CONNECT_AFTER_NS:
                self._connect_sent, self.generation = True, 4
                self._out.append("40")
        elif self._is_silent(now_ns):
            self.is_open = self.is_bare = True
            self._alarm_ns = now_ns + ANSWER_TIMEOUT_NS
        elif now_ns >= self._alarm_ns and not self.ended:
            self._ring(now_ns)
        out, self._out = self._out, []
        return out

    def _is_silent(self, now_ns: int) -> bool:
        unheard = self._welcome_ns is None and not self.is_open
        return unheard and now_ns - self._began_ns >= SILENT_SERVER_NS

    def _ring(self, now_ns: int) -> None:
        if not self.is_open or self.is_bare:
            waited_s = seconds(now_ns - self._began_ns)
            self.ended = f"it is no socket.io server, or does not answer: waited {waited_s:.0f} s"
        elif self.generation == 4:
            self.ended = "it sends no pings"
        elif self._waits_for_pong:
            self.ended = "it does not answer our ping"
        else:
            self._out.append("2")
            self._waits_for_pong = True
            self._alarm_ns = now_ns + PONG_TIMEOUT_NS

    def feed(self, text: str, now_ns: int) -> list[Any]:
        """Process a frame; return the payloads of its Bridge events. Never raises."""
        kind, rest = text[:1], text[1:]
        if kind == "4":
            return self._on_message(rest, now_ns)
        if kind == "0":
            self._welcome(rest, now_ns)
        elif kind == "1":
            self.ended = "it closed the connection"
        elif kind == "2":
            self._out.append("3" + rest)
            self._alarm_ns = now_ns + self._ping_timeout_ns
        elif kind == "3" and self._waits_for_pong:
            self._waits_for_pong = False
            self._alarm_ns = now_ns + PING_EVERY_NS
        return []

    def _welcome(self, text: str, now_ns: int) -> None:
        if self.is_bare:  # the server was only slow
            self.is_open = self.is_bare = False
            self._alarm_ns = now_ns + JOIN_TIMEOUT_NS
        self._welcome_ns = now_ns
        values = self._decoded(text, dict, "its welcome") or {}
        self.generation = 4 if "maxPayload" in values else 0
        spans = [values.get(key) for key in ("pingInterval", "pingTimeout")]
        spans_ms = [
            min(span, MAX_PING_MS) for span in spans if isinstance(span, int | float) and span > 0
        ]
        self._ping_timeout_ns = round((sum(spans_ms) or 45_000) * NS_PER_MS)

    def _on_message(self, text: str, now_ns: int) -> list[Any]:
        kind, rest = text[:1], text[1:]
        if kind == "0":
            self.is_open = True
            self.generation = self.generation or 3
            every_ns = PING_EVERY_NS if self.generation == 3 else self._ping_timeout_ns
            self._alarm_ns = now_ns + every_ns
        elif kind == "1":
            self.ended = "it disconnected us"
        elif kind == "4":
            self.ended = f"it refused us: {rest[:100] or 'no reason given'}"
        elif kind == "2":
            if self.is_bare:
                self._alarm_ns = now_ns + ANSWER_TIMEOUT_NS
            return self._on_event(rest.lstrip("0123456789"))
        elif kind == "3":
            number = rest[:MAX_SHOWN_CHARS].partition("[")[0]
            self.handled = int(number) if number.isascii() and number.isdecimal() else self.handled
        return []

    def _on_event(self, text: str) -> list[Any]:
        values = self._decoded(text, list, "an event")
        if values is None:
            return []
        if len(values) > 1 and values[0] == EVENT:
            return [values[1]]
        name = values[0][:MAX_SHOWN_CHARS] if values and isinstance(values[0], str) else ""
        self.unread = (
            f"an event {name!r} with {len(values[1:])} values, expected {EVENT!r} with one"
        )
        return []

    def _decoded(self, text: str, wanted: type, what: str) -> Any:
        """Return decoded JSON of the wanted type; else None, and set `unread`."""
        value = _decoded(text)
        if isinstance(value, wanted):
            return value
        self.unread = f"{what} is no JSON {wanted.__name__}: {text[:MAX_SHOWN_CHARS]!r}"
        return None


def _decoded(text: str) -> Any:
    """Return decoded JSON, with NaN and Infinity as Python writes them; None if it is invalid."""
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
    """Acknowledge TCP at once: delayed acknowledgements hold back a script's next small frame."""
    if hasattr(socket, "TCP_QUICKACK"):
        held.setsockopt(socket.IPPROTO_TCP, socket.TCP_QUICKACK, 1)


class _Straight(reconnect):
    """A connection that follows no redirect."""

    def process_redirect(self, exc: Exception) -> Exception:
        """Refuse to follow."""
        return exc


class ScriptSocket:
    """Maintains the connection to one script, on a thread of its own.

    Args:
        address: Host and port of the script's server.
        packet: Returns the newest telemetry; None if there is none yet.
        on_reply: Receives the script's reply, and when it came.
        clock: Of this process.
        gap_ns: Minimum time between two packets; 0: as fast as the script answers.

    Attributes:
        pace: Of the present connection, or of the last one.
        is_open: Whether a script is connected.
        failure: The exception that ended the thread; None if none did.
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
        self._state = ""
        self._was_unread = False
        self.pace = PingPong(gap_ns)
        self.is_open = False
        self.failure: Exception | None = None

    def start(self) -> None:
        """Start to connect to the script."""
        self._thread.start()

    def stop(self) -> None:
        """Disconnect; a send that blocks on a frozen script is cut off."""
        self._stop.set()
        held = self._open
        if held is not None:
            with contextlib.suppress(OSError):
                held.shutdown(socket.SHUT_RDWR)
        self._thread.join(2.0)

    @property
    def detail(self) -> str:
        """State of the connection, in words."""
        return self._state

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
                    url, compression=None, extensions=[OfferToDeflate()], ping_interval=None,
                    max_size=MAX_MESSAGE_BYTES, proxy=None, open_timeout=OPEN_TIMEOUT_S,
                    close_timeout=1.0,
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
            self._set_state(f"no script at {host}:{port}: {why}; retries every half second")
            self._clock.wait_until(self._clock.now_ns() + RETRY_NS, self._stop)

    def _set_state(self, what: str) -> None:
        if what != self._state:
            self._state = what
            level = logging.INFO if self.is_open else logging.WARNING
            event(_log, "devkit_script", level=level, state=repr(what))

    def _talk(self, connection: ClientConnection) -> str:
        """Exchange frames until the connection is over; return why it is."""
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
                self._receive(dialogue, got)
            else:
                dialogue.unread = f"{len(got)} bytes that are no text"
            self._log_unread(dialogue)
            _answer_at_once(connection.socket)
        return dialogue.ended

    def _push(self, connection: ClientConnection, is_bare: bool, now_ns: int) -> int:
        """Send a packet if one is due; return when to check again [ns]."""
        due_ns = self.pace.due_ns(now_ns)
        if due_ns > now_ns:
            return due_ns
        try:
            packet = self._packet()
        except Exception as cause:
            self.failure = cause
            raise
        if packet is None:
            return now_ns + POLL_NS
        number = None if is_bare else self.pace.packets + 1
        if inflates(connection):
            connection.send(packet.deflated(number), text=True)
        else:
            connection.send(packet.text(number))
        self.pace.sent(now_ns)
        return self.pace.due_ns(now_ns)

    def _receive(self, dialogue: Dialogue, text: str) -> None:
        now_ns = self._clock.now_ns()
        handled = dialogue.handled
        for payload in dialogue.feed(text, now_ns):
            self.pace.replied(now_ns)
            self._on_reply(payload, now_ns)
        if dialogue.handled != handled:
            self.pace.handled(min(dialogue.handled, self.pace.packets))
        if dialogue.is_open and not self.is_open:
            self.is_open = True
            host, port = self._address
            protocol = "events alone" if dialogue.is_bare else f"protocol {dialogue.generation}"
            self._set_state(f"talks with the script at {host}:{port}, {protocol}")

    def _log_unread(self, dialogue: Dialogue) -> None:
        if dialogue.unread and not self._was_unread:
            self._was_unread = True
            event(_log, "devkit_unread", level=logging.WARNING, why=repr(dialogue.unread))
