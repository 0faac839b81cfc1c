"""The bus inside one process: the same contract without a network, in a fixed order.

Every message is encoded and decoded as on a network, so stations share no objects and nothing
passes that could not be sent. With a stepped clock the result depends only on the order of calls,
so runs repeat bit for bit.
"""

import heapq
import threading
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import islice
from types import TracebackType
from typing import Self

from scm.clock import Clock, nanoseconds
from scm.errors import LinkError
from scm.v2x.bus import check_reply, more_informative, no_answer, no_server
from scm.v2x.exchange import Answer, Call, Incoming, RawSample
from scm.v2x.faults import Faults
from scm.v2x.key import check_name, everything, intersects, key_of, matches, selector
from scm.v2x.mailbox import Mailbox, RawMailbox
from scm.v2x.message import Delivery, Message, Refused, Request, decode, encode
from scm.v2x.messages.presence import Presence
from scm.v2x.reader import Reader

OnReply = Callable[[Incoming], None]


@dataclass(eq=False)
class _Subscription:
    """One subscription: `deliver` puts an arrival into the subscriber's mailbox."""

    owner: "MemoryBus"
    expression: str
    deliver: Callable[[RawSample], None]
    mailbox: Mailbox | RawMailbox
    wants_retained: bool = False


@dataclass(eq=False)
class _Service:
    owner: "MemoryBus"
    expression: str
    deliver: Callable[["_PendingCall", RawSample], None]


@dataclass(eq=False)
class _PendingCall:
    """An open call: finished by the first reply, by a refusal when all refuse, or by timeout."""

    by: "MemoryBus"
    call: Call
    on_reply: OnReply
    key: str
    due_ns: int
    open: set["MemoryBus"] = field(default_factory=set)
    is_finished: bool = False
    refused: Refused | None = None

    def finish(self, reply: Message, t_ns: int) -> None:
        if not self.is_finished:
            self.is_finished = True
            self.on_reply(Incoming(reply, t_ns, self.call))

    def receive(self, server: "MemoryBus", reply: Message, t_ns: int) -> None:
        self.open.discard(server)
        if not isinstance(reply, Refused):
            self.finish(reply, t_ns)
            return
        self.refused = more_informative(self.refused, reply)
        if not self.open:
            self.finish(self.refused, t_ns)


class MemoryNetwork:
    """Connects the memory buses of one process.

    Args:
        clock: The time.
        faults: Simulated network faults; None: none.
    """

    def __init__(self, clock: Clock, faults: Faults | None = None) -> None:
        self.clock = clock
        self.faults = faults
        self.lock = threading.RLock()
        self.buses: list[MemoryBus] = []
        self.subscriptions: list[_Subscription] = []
        self.services: list[_Service] = []
        self.pending: list[_PendingCall] = []
        self._routes: dict[str, list[_Subscription]] = {}
        self._matched: dict[str, bool] = {}
        self._opened = 0
        self._delayed: list[tuple[int, int, Callable[[int], None]]] = []
        self._sent = 0

    def bus(self, city: str, station: str) -> "MemoryBus":
        """Return a new connection for a station."""
        with self.lock:
            self._opened += 1
            bus = MemoryBus(self, city, station, f"m{self._opened}")
            self.buses.append(bus)
        return bus

    def expire(self) -> None:
        """Deliver delayed items that are due, and refuse calls that have timed out."""
        while self._delayed and self._delayed[0][0] <= self.clock.now_ns():
            with self.lock:
                due_ns, _, deliver = heapq.heappop(self._delayed)
                deliver(due_ns)
        if not self.pending:
            return
        with self.lock:
            now_ns = self.clock.now_ns()
            overdue = [pending for pending in self.pending if pending.due_ns <= now_ns]
            self.pending = [a for a in self.pending if a.due_ns > now_ns and not a.is_finished]
            for pending in overdue:
                pending.finish(no_answer(pending.call, pending.key), now_ns)

    def transmit(
        self, sender: "MemoryBus", receiver: "MemoryBus", deliver: Callable[[int], None]
    ) -> None:
        """Deliver something from one station to another, subject to the faults.

        `deliver` is called with the time of arrival.
        """
        now_ns = self.clock.now_ns()
        if self.faults is None or sender is receiver:
            deliver(now_ns)
            return
        if sender.city == receiver.city:
            delays = self.faults.delays(sender.station, receiver.station)
        else:
            delays = self.faults.delays(sender.address, receiver.address, over_link=True)
        for delay_ns in delays:
            if delay_ns:
                self._sent += 1
                heapq.heappush(self._delayed, (now_ns + delay_ns, self._sent, deliver))
            else:
                deliver(now_ns)

    def route(self, sample: RawSample, sender: "MemoryBus | None" = None) -> None:
        """Deliver a sample to all its subscribers, in the order of their subscriptions.

        Args:
            sample: What is sent.
            sender: Its station; None: it is delivered without faults.
        """
        with self.lock:
            subscriptions = self._routes.get(sample.key)
            if subscriptions is None:
                subscriptions = [w for w in self.subscriptions if matches(w.expression, sample.key)]
                self._routes[sample.key] = subscriptions
            for subscription in subscriptions:
                if self.faults is None or sender is None:
                    subscription.deliver(sample)
                else:
                    self.transmit(
                        sender, subscription.owner, partial(self._deliver, subscription, sample)
                    )

    def _deliver(self, subscription: _Subscription, sample: RawSample, now_ns: int) -> None:
        if subscription.owner.connected:
            subscription.deliver(replace(sample, t_ns=now_ns))

    def deliver_request(
        self, service: _Service, pending: _PendingCall, sample: RawSample, now_ns: int
    ) -> None:
        """Deliver a request to a service if that is still connected."""
        if service.owner.connected:
            service.deliver(pending, replace(sample, t_ns=now_ns))

    def add_subscription(self, subscription: _Subscription) -> None:
        """Add a subscription and deliver what others retain for late joiners."""
        with self.lock:
            self.subscriptions.append(subscription)
            self._forget_routes()
            if subscription.wants_retained:
                retained = [s for bus in self.buses for s in bus.retained(subscription.expression)]
                now_ns = self.clock.now_ns()
                for _, sample in sorted(retained, key=lambda item: item[0]):
                    subscription.deliver(replace(sample, t_ns=now_ns))

    def remove_subscriptions(self, mailbox: Mailbox) -> None:
        """Remove the subscriptions of a mailbox."""
        with self.lock:
            self.subscriptions = [w for w in self.subscriptions if w.mailbox is not mailbox]
            self._forget_routes()

    def has_subscriber(self, expression: str) -> bool:
        """Return whether any subscription matches an expression."""
        with self.lock:
            known = self._matched.get(expression)
            if known is None:
                known = any(
                    intersects(subscription.expression, expression)
                    for subscription in self.subscriptions
                )
                self._matched[expression] = known
            return known

    def _forget_routes(self) -> None:
        """Clear cached routes after a change of subscriptions."""
        self._routes.clear()
        self._matched.clear()

    def leave(self, bus: "MemoryBus") -> None:
        """Remove a bus with its subscriptions, services, retained messages and calls."""
        with self.lock:
            self.buses.remove(bus)
            self.subscriptions = [w for w in self.subscriptions if w.owner is not bus]
            self.services = [o for o in self.services if o.owner is not bus]
            self._forget_routes()
            without_server = [a for a in self.pending if bus in a.open]
            self.pending = [a for a in self.pending if a.by is not bus]
            for pending in without_server:
                pending.receive(
                    bus, no_server(pending.call.request, pending.key), self.clock.now_ns()
                )


class MemoryBus:
    """One station's connection inside this process; see `scm.v2x.bus.Bus`."""

    def __init__(self, network: MemoryNetwork, city: str, station: str, session: str) -> None:
        self.city = check_name(city, "city")
        self.station = check_name(station, "station")
        self.session = session
        self._network = network
        self._reader = Reader(network.clock)
        self._retained: dict[str, deque[tuple[int, RawSample]]] = {}
        self._retained_count = 0
        self._to_answer: dict[Incoming, _PendingCall] = {}
        self._presence: list[Presence] = []
        self._closed = False

    @property
    def address(self) -> str:
        """Its station in its city, as `Faults` names it on a link between cities."""
        return f"{self.city}/{self.station}"

    @property
    def connected(self) -> bool:
        """Whether it is still open."""
        return not self._closed

    @property
    def rejected(self) -> int:
        """How many arrivals were dropped because they could not be read."""
        return self._reader.rejected

    def publish(self, message: Message, city: str = "") -> None:
        """Send a message on its own key, or on that of another city."""
        self._check_open()
        self._network.expire()
        keep = message.HISTORY_DEPTH if message.DELIVERY is Delivery.EVENT else 0
        self._send(message, keep, city)

    def _send(self, message: Message, keep: int, city: str = "") -> None:
        body, attachment = encode(message)
        key = key_of(city or self.city, message)
        sample = RawSample(key, body, attachment, self._network.clock.now_ns())
        with self._network.lock:
            if keep:
                retained = self._retained.setdefault(key, deque(maxlen=keep))
                retained.append((self._order(), sample))
            is_presence = isinstance(message, Presence)
            self._network.route(sample, None if is_presence else self)

    def _order(self) -> int:
        self._retained_count += 1
        return self._retained_count

    def retained(self, expression: str) -> list[tuple[tuple[int, int], RawSample]]:
        """Return what this station retains for late joiners: ((time, order), sample)."""
        return [
            ((sample.t_ns, order), sample)
            for key, samples in self._retained.items()
            if matches(expression, key)
            for order, sample in samples
        ]

    def subscribe(self, kind: type[Message], where: Mapping[str, str], mailbox: Mailbox) -> None:
        """Deliver messages of a class to a mailbox until the bus is closed."""
        self._check_open()

        read = self._reader.read_once if mailbox.once else self._reader.read

        def deliver(sample: RawSample) -> None:
            facts = (sample.key, sample.body, sample.attachment, sample.t_ns)
            mailbox.put_later(partial(read, kind, *facts))

        wants_retained = kind.DELIVERY in (Delivery.EVENT, Delivery.PRESENCE)
        subscription = _Subscription(
            self, selector(self.city, kind, where), deliver, mailbox, wants_retained
        )
        self._network.add_subscription(subscription)

    def subscribe_raw(
        self,
        mailbox: RawMailbox,
        kind: type[Message] | None = None,
        where: Mapping[str, str] | None = None,
    ) -> None:
        """Deliver everything that is published, or one class of it, to a mailbox, undecoded."""
        self._check_open()

        def deliver(sample: RawSample) -> None:
            if not _is_presence(sample.key):
                mailbox.put(sample)

        expression = (
            everything(self.city) if kind is None else selector(self.city, kind, where or {})
        )
        self._network.add_subscription(
            _Subscription(self, expression, deliver, mailbox, wants_retained=True)
        )

    def unsubscribe(self, mailbox: Mailbox) -> None:
        """Stop delivery to a mailbox; its contents stay."""
        self._check_open()
        self._network.remove_subscriptions(mailbox)

    def is_wanted(self, kind: type[Message], where: Mapping[str, str]) -> bool:
        """Return whether anybody subscribes to messages of a class."""
        self._check_open()
        return self._network.has_subscriber(selector(self.city, kind, where))

    def serve(self, kind: type[Request], where: Mapping[str, str], mailbox: Mailbox) -> None:
        """Deliver requests of a class to a mailbox; each needs an `answer`."""
        self._check_open()

        def deliver(pending: _PendingCall, sample: RawSample) -> None:
            def make() -> Incoming | None:
                read = self._reader.read
                incoming = read(kind, sample.key, sample.body, sample.attachment, sample.t_ns)
                if incoming is not None and not pending.is_finished:
                    self._to_answer[incoming] = pending
                return incoming

            mailbox.put_later(make)

        service = _Service(self, selector(self.city, kind, where), deliver)
        with self._network.lock:
            self._network.services.append(service)

    def answer(self, answer: Answer) -> None:
        """Reply to a request from `serve`; a second answer to the same request is ignored."""
        self._check_open()
        check_reply(answer)
        pending = self._to_answer.pop(answer.to, None)
        if pending is not None:
            network = self._network
            reply = decode(type(answer.reply), *encode(answer.reply))
            with network.lock:
                network.transmit(self, pending.by, partial(pending.receive, self, reply))

    def call(self, call: Call, on_reply: OnReply) -> None:
        """Send a request and pass the reply (or a `Refused`) to `on_reply` later; never blocks."""
        self._check_open()
        self._network.expire()
        key = key_of(call.city or self.city, call.request)
        body, attachment = encode(call.request)
        now_ns = self._network.clock.now_ns()
        pending = _PendingCall(self, call, on_reply, key, now_ns + nanoseconds(call.timeout_s))
        sample = RawSample(key, body, attachment, now_ns)
        with self._network.lock:
            services = [o for o in self._network.services if matches(o.expression, key)]
            pending.open.update(o.owner for o in services)
            self._network.pending.append(pending)
            for service in services:
                deliver = partial(self._network.deliver_request, service, pending, sample)
                self._network.transmit(self, service.owner, deliver)
        if not services:
            pending.finish(no_server(call.request, key), now_ns)

    def announce(self, role: str) -> None:
        """Declare this station present until the bus closes."""
        self._check_open()
        here = Presence(role=role, station=self.station, session=self.session, alive=True)
        self._presence.append(here)
        self._send(here, keep=1)

    def close(self) -> None:
        """Leave; safe to call twice."""
        if self._closed:
            return
        self._closed = True
        self._network.leave(self)
        for here in self._presence:
            gone = Presence(role=here.role, station=here.station, session=here.session, alive=False)
            self._send(gone, keep=0)
        self._retained.clear()
        self._to_answer.clear()

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


def _is_presence(key: str) -> bool:
    chunks = islice(reversed(key.split("/")), 1, 2)
    return next(chunks, "") == "alive"
