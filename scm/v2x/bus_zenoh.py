"""The bus between processes and machines: one Zenoh client session, always closed.

Rules for zenoh-python 1.10: callbacks run directly on Zenoh's threads (`indirect=False`; with the
default, a process that exits without closing hangs), they only store bytes and time, and
never send a query. Publications never wait for a slow receiver. An empty result of a query is a
failure, never an answer.
"""

import logging
import threading
from collections import OrderedDict
from collections.abc import Callable, Iterable, Mapping
from datetime import timedelta
from functools import partial
from types import TracebackType
from typing import TYPE_CHECKING, Any, Protocol, Self

import zenoh

from scm.clock import Clock, WallClock
from scm.errors import LinkError, MessageError
from scm.log import event
from scm.v2x import zenoh_config
from scm.v2x.bus import check_reply, more_informative, no_answer, no_link, no_server
from scm.v2x.credentials import Credentials
from scm.v2x.exchange import Answer, Call, Incoming, RawSample
from scm.v2x.flood_gate import FloodGate
from scm.v2x.key import check_name, everything, key_of, names_of, parse, selector
from scm.v2x.mailbox import Mailbox, RawMailbox
from scm.v2x.message import Delivery, Message, Refused, Request, decode, encode, is_bulk
from scm.v2x.messages.presence import Presence
from scm.v2x.reader import Reader
from scm.v2x.thread_state import THREAD_STATES
from scm.v2x.yielding import yielding
from scm.v2x.zenoh_events import declare_event_publisher, declare_event_subscriber

if TYPE_CHECKING:
    from scm.v2x.signed_cams import SignedCams

MAX_OPEN_REQUESTS = 1024
REQUERY_EVERY = timedelta(seconds=1)
REQUERY_ALL_EVERY = timedelta(seconds=5)
_TIMEOUT = b"Timeout"
_FLOOD = "more than is read from one key in a second"

_log = logging.getLogger(__name__)

OnSample = Callable[[str, bytes, bytes | None, int], None]


class _Publisher(Protocol):
    def put(self, payload: bytes, *, attachment: bytes | None = None) -> None: ...


class ZenohBus:
    """One station's connection to the router of its city; see `scm.v2x.bus.Bus`.

    Opening waits up to `connect_timeout_s` for the router. `credentials` authenticate the station
    where the router requires it.

    Raises:
        LinkError: when there is no router at the endpoint, or it rejects the station.
    """

    def __init__(
        self,
        city: str,
        station: str,
        endpoint: str,
        *,
        clock: Clock | None = None,
        connect_timeout_s: float = 5.0,
        credentials: Credentials | None = None,
    ) -> None:
        self.city = check_name(city, "city")
        self.station = check_name(station, "station")
        self._clock = clock or WallClock()
        self._signed = _signed_cams(credentials)
        self._reader = Reader(self._clock, None if self._signed is None else self._signed.check)
        self._lock = threading.Lock()
        self._closed = False
        self._publishers: dict[tuple[type[Message], tuple[str, ...]], _Publisher] = {}
        self._declared: list[Any] = []
        self._subscribers: list[tuple[Mailbox, Any]] = []
        self._matching: dict[str, zenoh.Publisher] = {}
        self._to_answer: OrderedDict[Incoming, zenoh.Query] = OrderedDict()
        self._session = _open(endpoint, connect_timeout_s, credentials)
        self.session = str(self._session.zid())
        self._connected = bool(self._session.info.routers_zid())
        self._declared.append(
            self._session.info.declare_transport_events_listener(
                self._direct(self._on_transport), history=True
            )
        )

    @property
    def connected(self) -> bool:
        """Whether the router is reachable now; messages published while it is not are dropped."""
        return self._connected and not self._closed

    @property
    def rejected(self) -> int:
        """How many arrivals were dropped because they could not be read."""
        return self._reader.rejected

    def publish(self, message: Message, city: str = "") -> None:
        """Send a message on its own key, or on that of another city; never blocks.

        While disconnected only EVENTs are retained until the connection is back.
        """
        self._check_open()
        if self._signed is not None:
            message = self._signed.signed(message, self._clock.now_ns())
        if self._connected or message.DELIVERY is Delivery.EVENT:
            publisher = self._publisher(message, city or self.city)
            body, attachment = encode(message)
            publisher.put(body, attachment=attachment)

    def _publisher(self, message: Message, city: str) -> _Publisher:
        kind, names = type(message), (city, *names_of(message))
        publisher = self._publishers.get((kind, names))
        if publisher is not None:
            return publisher
        key = key_of(city, message)
        with self._lock:
            publisher = self._publishers.get((kind, names))
            if publisher is None:
                publisher = _declare_publisher(self._session, kind, key)
                self._publishers[kind, names] = publisher
                self._declared.append(publisher)
            return publisher

    def subscribe(self, kind: type[Message], where: Mapping[str, str], mailbox: Mailbox) -> None:
        """Deliver messages of a class to a mailbox until the bus is closed."""
        self._check_open()
        expression = selector(self.city, kind, where)
        if kind.DELIVERY is Delivery.PRESENCE:
            self._watch_presence(expression, mailbox)
            return

        read = self._reader.read_once if mailbox.once else self._reader.read

        def on_sample(key: str, body: bytes, attachment: bytes | None, t_ns: int) -> None:
            mailbox.put_later(partial(read, kind, key, body, attachment, t_ns))

        callback = self._direct(self._noting(on_sample))
        if kind.DELIVERY is Delivery.EVENT:
            again = requery_interval(kind, REQUERY_EVERY)
            subscriber = declare_event_subscriber(
                self._session, expression, callback, kind.HISTORY_DEPTH, again
            )
        else:
            subscriber = self._session.declare_subscriber(expression, callback)
        with self._lock:
            self._subscribers.append((mailbox, subscriber))

    def unsubscribe(self, mailbox: Mailbox) -> None:
        """Stop delivery to a mailbox; its contents stay."""
        self._check_open()
        with self._lock:
            ended = [thing for box, thing in self._subscribers if box is mailbox]
            self._subscribers = [item for item in self._subscribers if item[0] is not mailbox]
        _undeclare(ended)

    def is_wanted(self, kind: type[Message], where: Mapping[str, str]) -> bool:
        """Return whether anybody subscribes to messages of a class.

        Zenoh reports it to declared publishers: checking `*` first keeps their number small.
        """
        self._check_open()
        expression = selector(self.city, kind, where)
        with self._lock:
            probe = self._matching.get(expression)
            if probe is None:
                probe = self._matching[expression] = self._session.declare_publisher(expression)
                self._declared.append(probe)
        # The stubs declare a bool; it is an object that is always true.
        status: Any = probe.matching_status
        return bool(status.matching)

    def _watch_presence(self, expression: str, mailbox: Mailbox) -> None:
        def on_sample(sample: zenoh.Sample) -> None:
            alive = sample.kind == zenoh.SampleKind.PUT
            facts = (str(sample.key_expr), alive, self._clock.now_ns())
            mailbox.put_later(partial(self._read_presence, *facts))

        live = self._session.liveliness()
        subscriber = live.declare_subscriber(expression, self._direct(on_sample), history=True)
        with self._lock:
            self._subscribers.append((mailbox, subscriber))

    def _read_presence(self, key: str, alive: bool, t_ns: int) -> Incoming | None:
        try:
            names = parse(self.city, Presence, key)
        except MessageError as cause:
            self._reader.reject(key, str(cause))
            return None
        return Incoming(Presence(**names, alive=alive), t_ns)

    def subscribe_raw(
        self,
        mailbox: RawMailbox,
        kind: type[Message] | None = None,
        where: Mapping[str, str] | None = None,
    ) -> None:
        """Deliver everything that is published, or one class of it, to a mailbox, undecoded."""
        self._check_open()

        def on_sample(key: str, body: bytes, attachment: bytes | None, t_ns: int) -> None:
            mailbox.put(RawSample(key, body, attachment, t_ns))

        callback = self._direct(self._noting(on_sample))
        expression = (
            everything(self.city) if kind is None else selector(self.city, kind, where or {})
        )
        if kind is not None and kind.DELIVERY is not Delivery.EVENT:
            self._declare(self._session.declare_subscriber(expression, callback))
            return
        again = requery_interval(kind, REQUERY_ALL_EVERY)
        self._declare(declare_event_subscriber(self._session, expression, callback, None, again))

    def serve(self, kind: type[Request], where: Mapping[str, str], mailbox: Mailbox) -> None:
        """Deliver requests of a class to a mailbox; each needs an `answer`."""
        self._check_open()

        gate = FloodGate()

        def on_query(query: zenoh.Query) -> None:
            if not gate.admits(str(query.key_expr), 0, self._clock.now_ns()):
                self._reader.reject(str(query.key_expr), _FLOOD)
                query.drop()  # type: ignore[no-untyped-call]
                return
            body = query.payload.to_bytes() if query.payload is not None else b""
            attachment = query.attachment.to_bytes() if query.attachment is not None else None
            facts = (body, attachment, self._clock.now_ns())
            mailbox.put_later(partial(self._read_request, kind, query, *facts))

        expression = selector(self.city, kind, where)
        self._declare(self._session.declare_queryable(expression, self._direct(on_query)))

    def _read_request(
        self,
        kind: type[Request],
        query: zenoh.Query,
        body: bytes,
        attachment: bytes | None,
        t_ns: int,
    ) -> Incoming | None:
        incoming = self._reader.read(kind, str(query.key_expr), body, attachment, t_ns)
        if incoming is None:
            refused = Refused(code="invalid", detail=f"{kind.__name__}: it could not be read")
            self._reply(query, refused)
            return None
        with self._lock:
            self._to_answer[incoming] = query
            if len(self._to_answer) > MAX_OPEN_REQUESTS:
                self._to_answer.popitem(last=False)
        return incoming

    def answer(self, answer: Answer) -> None:
        """Reply to a request from `serve`; a second answer to the same request is ignored."""
        self._check_open()
        check_reply(answer)
        with self._lock:
            query = self._to_answer.pop(answer.to, None)
        if query is not None:
            self._reply(query, answer.reply)

    def _reply(self, query: zenoh.Query, reply: Message) -> None:
        body, attachment = encode(reply)
        try:
            if isinstance(reply, Refused):
                query.reply_err(body)
            else:
                query.reply(query.key_expr, body, attachment=attachment)
        except zenoh.ZError as cause:
            event(_log, "reply_not_sent", level=logging.WARNING, reason=cause)
        finally:
            query.drop()  # type: ignore[no-untyped-call]

    def call(self, call: Call, on_reply: Callable[[Incoming], None]) -> None:
        """Send a request and pass the reply (or a `Refused`) to `on_reply` later; never blocks."""
        self._check_open()
        key = key_of(call.city or self.city, call.request)
        pending = _PendingCall(call, on_reply, key, self._clock)
        if not self._connected:
            pending.finish(no_link(call.request, key))
            return
        body, attachment = encode(call.request)
        self._session.get(
            key,
            zenoh.handlers.Callback(pending.receive, pending.done, indirect=False),
            payload=body,
            attachment=attachment,
            timeout=call.timeout_s,
            consolidation=zenoh.ConsolidationMode.NONE,
        )

    def announce(self, role: str) -> None:
        """Declare this station present until the bus closes or its process dies."""
        self._check_open()
        here = Presence(role=role, station=self.station, session=self.session, alive=True)
        self._declare(self._session.liveliness().declare_token(key_of(self.city, here)))

    def close(self) -> None:
        """Leave; safe to call twice."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            declared, self._declared = self._declared, []
            declared += [thing for _, thing in self._subscribers]
            self._subscribers.clear()
            self._publishers.clear()
            self._matching.clear()
        _undeclare(reversed(declared))
        self._to_answer.clear()
        self._session.close()  # type: ignore[no-untyped-call]

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _check_open(self) -> None:
        if self._closed:
            msg = f"the bus of {self.station!r} is closed"
            raise LinkError(msg)

    def _declare(self, thing: object) -> None:
        with self._lock:
            self._declared.append(thing)

    def _on_transport(self, change: zenoh.TransportEvent) -> None:
        self._connected = change.kind == zenoh.SampleKind.PUT

    def _noting(self, on_sample: OnSample) -> Callable[[zenoh.Sample], None]:
        gate = FloodGate()

        def note(sample: zenoh.Sample) -> None:
            if sample.kind != zenoh.SampleKind.PUT:
                return
            key, now_ns = str(sample.key_expr), self._clock.now_ns()
            if not gate.admits(key, len(sample.payload), now_ns):
                self._reader.reject(key, _FLOOD)
                return
            attachment = sample.attachment.to_bytes() if sample.attachment is not None else None
            on_sample(key, sample.payload.to_bytes(), attachment, now_ns)

        return note

    def _direct(self, callback: Callable[[Any], None]) -> Any:
        """Wrap a callback so that it runs on Zenoh's thread and its errors are counted."""

        def guarded(item: object) -> None:
            THREAD_STATES.pin()
            try:
                callback(item)
            except Exception:  # noqa: BLE001  the edge of a thread that is not ours
                _log.exception("callback_failed station=%s", self.station)
                self._reader.rejected += 1

        return zenoh.handlers.Callback(guarded, indirect=False)


class _PendingCall:
    """An open call: finished by the first reply, or at its end by a refusal."""

    def __init__(
        self, call: Call, on_reply: Callable[[Incoming], None], key: str, clock: Clock
    ) -> None:
        self._call = call
        self._on_reply = on_reply
        self._key = key
        self._clock = clock
        self._lock = threading.Lock()
        self._is_finished = False
        self._refused: Refused | None = None

    def finish(self, reply: Message) -> None:
        with self._lock:
            if self._is_finished:
                return
            self._is_finished = True
        self._on_reply(Incoming(reply, self._clock.now_ns(), self._call))

    def receive(self, reply: zenoh.Reply) -> None:
        if reply.ok is None:
            body = reply.err.payload.to_bytes() if reply.err is not None else _TIMEOUT
            self._refused = more_informative(self._refused, self._read_refusal(body))
            return
        attachment = reply.ok.attachment
        try:
            self.finish(
                decode(
                    self._call.request.REPLY,
                    reply.ok.payload.to_bytes(),
                    attachment.to_bytes() if attachment is not None else None,
                )
            )
        except MessageError as cause:
            self._refused = Refused(code="invalid", detail=f"the reply: {cause}")

    def _read_refusal(self, body: bytes) -> Refused:
        if body == _TIMEOUT:
            return no_answer(self._call, self._key)
        try:
            return decode(Refused, body)
        except MessageError as cause:
            return Refused(code="invalid", detail=f"the refusal: {cause}")

    def done(self) -> None:
        self.finish(self._refused or no_server(self._call.request, self._key))


def _signed_cams(credentials: Credentials | None) -> "SignedCams | None":
    if credentials is None or not credentials.air_authority:
        return None
    from scm.v2x.signed_cams import SignedCams  # noqa: PLC0415  cryptography is slow to load

    return SignedCams(credentials)


def _undeclare(things: Iterable[Any]) -> None:
    for thing in things:
        try:
            thing.undeclare()
        except zenoh.ZError as cause:
            event(_log, "undeclare_failed", level=logging.DEBUG, reason=cause)


def _open(
    endpoint: str, connect_timeout_s: float, credentials: Credentials | None
) -> zenoh.Session:
    who = credentials.client_settings() if credentials is not None else None
    try:
        config = zenoh.Config.from_json5(zenoh_config.client(endpoint, connect_timeout_s, who))
        with yielding():
            return zenoh.open(config)
    except zenoh.ZError as cause:
        why = zenoh_config.reason(cause)
        hint = "" if who is None else ", and does it know these credentials"
        msg = (
            f"no city at {endpoint!r} within {connect_timeout_s} s: "
            f"is `scm up` running{hint}? ({why})"
        )
        raise LinkError(msg) from cause


def requery_interval(kind: type[Message] | None, every: timedelta) -> timedelta | None:
    """Return how often a subscriber queries for events that it may have lost; None: never.

    Periodic messages show a gap by their next sample. Querying each of a thousand cars for its trip
    would keep both cores of a small machine busy for half a second each time.
    """
    return None if kind is not None and kind.RATE_HZ is not None else every


def _declare_publisher(session: zenoh.Session, kind: type[Message], key: str) -> _Publisher:
    if kind.DELIVERY is Delivery.EVENT:
        events: _Publisher = declare_event_publisher(session, key, kind.HISTORY_DEPTH)
        return events
    if kind.DELIVERY is Delivery.COMMAND:
        priority = zenoh.Priority.REAL_TIME
    else:
        priority = zenoh.Priority.DATA if is_bulk(kind) else zenoh.Priority.DATA_HIGH
    # Express sends each message in its own batch. Only for commands: of a burst of 60 express
    # states a busy machine lost 10 to 40 % and took ten times as long; batched, it lost none.
    return session.declare_publisher(
        key,
        priority=priority,
        congestion_control=zenoh.CongestionControl.DROP,
        express=kind.DELIVERY is Delivery.COMMAND,
    )
