"""A part connected to its bus: collects its inbox, sends its outbox, answers each request once.

Both runners use it. A request whose `request_id` was answered before gets the stored answer: its
effect happens once, however often the network repeats it. With a keeper this holds across restarts
too: an answer leaves only when it, the state behind it and its audit entry are stored.
"""

import logging
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import cast

import msgspec

from scm.log import event
from scm.runtime.part import Part, Subscription
from scm.store.audit import Deed
from scm.store.repository import Table
from scm.v2x.answers import AnswerCache
from scm.v2x.bus import Bus, Mailbox, RawMailbox, check_reply
from scm.v2x.exchange import Answer, Call, Incoming, Outgoing, PersistedState, RawSample, ToCity
from scm.v2x.mailbox import drain_all
from scm.v2x.message import Delivery, Message, Refused, Request, encode
from scm.v2x.write_ahead import Batch, BatchStore

DEPTH = {
    Delivery.STREAM: 1024,
    Delivery.COMMAND: 256,
    Delivery.EVENT: 4096,
    Delivery.RPC: 256,
    Delivery.PRESENCE: 1024,
}
RAW_DEPTH = 16384
MAX_ACTOR = 128  # characters of a sender's name that the audit log stores

_log = logging.getLogger(__name__)


class Station:
    """One part, tied to one bus: subscribed, serving and announced from the start.

    Args:
        part: The part.
        bus: Its connection.
        keeper: Stores what must outlive this process; None: nothing must.
    """

    def __init__(self, part: Part, bus: Bus, keeper: BatchStore | None = None) -> None:
        self._part = part
        self._bus = bus
        self._boxes: list[Mailbox | RawMailbox] = []
        self._replies = self._mailbox(Delivery.RPC)
        self._keeper = keeper
        self._answers = AnswerCache(None if keeper is None else keeper.stored_answers())
        self._followed: Sequence[Subscription] = ()
        self._active: list[tuple[Subscription, Mailbox]] = []
        self._follow()
        for service in part.services:
            bus.serve(service.kind, service.where, self._mailbox(Delivery.RPC))
        self._subscribe_raw()
        part.attach(bus.is_wanted)
        bus.announce(part.role)

    def _subscribe_raw(self) -> None:
        """Subscribe to undecoded messages; these subscriptions stay as they are at the start."""
        box = RawMailbox(RAW_DEPTH)
        for one in self._part.subscriptions:
            if one.raw:
                self._bus.subscribe_raw(box, None if one.kind is Message else one.kind, one.where)
        self._boxes.append(box)

    def _follow(self) -> None:
        """Make the bus subscriptions equal to those of the part."""
        if self._part.subscriptions is self._followed:
            return
        self._followed = self._part.subscriptions
        missing = [one for one in self._followed if not one.raw]
        for pair in list(self._active):
            subscription, box = pair
            if subscription in missing:
                missing.remove(subscription)
            else:
                self._bus.unsubscribe(box)
                self._active.remove(pair)
                self._boxes.remove(box)
        for one in missing:
            box = self._mailbox(one.kind.DELIVERY, once=one.once)
            self._bus.subscribe(one.kind, one.where, box)
            self._active.append((one, box))

    def _mailbox(self, delivery: Delivery, *, once: bool = False) -> Mailbox:
        box = Mailbox(DEPTH[delivery], once=once)
        self._boxes.append(box)
        return box

    @property
    def dropped(self) -> int:
        """How many arrivals had to make room for newer ones since the start."""
        return sum(box.dropped for box in self._boxes)

    def inbox(self) -> list[Incoming]:
        """Return what arrived since the last time, without requests that are answered already."""
        self._follow()
        self._release()
        fresh: list[Incoming | RawSample] = []
        for item in drain_all(self._boxes):
            if isinstance(item, Incoming) and _is_request(item):
                met = self._answers.check(item, self._closed_for(item))
                if isinstance(met, Answer):
                    self._bus.answer(met)
                if met != "do":
                    continue
            fresh.append(item)
        # A part with raw subscriptions declares that its inbox holds samples too.
        return cast("list[Incoming]", fresh)

    def send(self, outgoing: Iterable[Outgoing]) -> None:
        """Deliver what a step returned, in its order; answers wait until they are stored."""
        stored: list[PersistedState] = []
        answers: list[Answer] = []
        calls: list[Call] = []
        for item in outgoing:
            if isinstance(item, Call):
                if item.after_store and self._keeper is not None:
                    calls.append(item)
                else:
                    self._call(item)
            elif isinstance(item, Answer):
                self._log_traced(item)
                if self._keeper is None:
                    self._answer(item)
                else:
                    check_reply(item)
                    answers.append(item)
            elif isinstance(item, PersistedState):
                stored.append(item)
            elif isinstance(item, ToCity):
                self._bus.publish(item.message, item.city)
            else:
                self._bus.publish(item)
        if self._keeper is not None and (stored or answers or calls):
            self._store(self._keeper, stored, answers, calls)

    def close(self) -> None:
        """Store what is pending and send its answers; the bus stays open."""
        if self._keeper is not None:
            self._keeper.close()
            self._release()

    def _closed_for(self, item: Incoming) -> str:
        """Return why a request must be refused: its effect could not be stored now."""
        if self._keeper is None or not _has_effect(item):
            return ""
        return self._keeper.stuck

    def _store(
        self,
        keeper: BatchStore,
        stored: Sequence[PersistedState],
        answers: Sequence[Answer],
        calls: Sequence[Call],
    ) -> None:
        values: list[tuple[Table, str, bytes | None]] = [
            (item.table, item.key, None if item.value is None else msgspec.json.encode(item.value))
            for item in stored
        ]
        for answer in answers:
            record = self._answers.record(answer)
            if record is not None:
                values.append(("answers", record[0], msgspec.json.encode(record[1])))
        dropped, self._answers.dropped = self._answers.dropped, []
        values += [("answers", key, None) for key in dropped]
        deeds = [
            self._deed(answer)
            for answer in answers
            if not isinstance(answer.reply, Refused) and _has_effect(answer.to)
        ]
        if values or deeds or calls:
            keeper.write(Batch(values, deeds, answers, calls))
            self._release()
        else:
            for answer in answers:
                self._answer(answer)

    def _call(self, call: Call) -> None:
        self._bus.call(self._signed(call), self._replies.put)

    def _signed(self, call: Call) -> Call:
        """Return a call whose request names its actor; this part, unless it names somebody."""
        request = call.request
        if not request.HAS_EFFECT or request.actor or _named(request):
            return call
        return replace(call, request=msgspec.structs.replace(request, actor=self._part.name))

    def _log_traced(self, answer: Answer) -> None:
        """Log the outcome of a traced request."""
        request = cast("Request", answer.to.message)
        if request.trace_id and _has_effect(answer.to):
            kind, reply = type(request).__name__, type(answer.reply).__name__
            event(_log, "answered", request=kind, reply=reply, trace_id=request.trace_id[:32])

    def _deed(self, answer: Answer) -> Deed:
        request = cast("Request", answer.to.message)
        return Deed(
            t_ns=answer.to.t_ns,
            station=self._part.name,
            kind=type(request).__name__,
            by=_actor_of(request),
            request_id=request.request_id,
            request=msgspec.Raw(encode(request)[0]),
            reply=msgspec.Raw(encode(answer.reply)[0]),
        )

    def _release(self) -> None:
        """Send the answers and calls whose state is stored by now."""
        if self._keeper is not None:
            for batch in self._keeper.written():
                for call in batch.calls:
                    self._call(call)
                for answer in batch.answers:
                    self._answer(answer)

    def _answer(self, answer: Answer) -> None:
        for ready in self._answers.complete(answer):
            self._bus.answer(ready)


def _is_request(item: Incoming) -> bool:
    return isinstance(item.message, Request) and item.call is None


def _named(request: Request) -> str:
    """Return the requester named in the request itself, or an empty string."""
    return str(getattr(request, "by", "") or getattr(request, "owner", ""))


def _actor_of(request: Request) -> str:
    """Return the requester for the audit log: who is named, and who sent it if that differs."""
    named, actor = _named(request), request.actor[:MAX_ACTOR]
    if not (named and actor):
        return named or actor
    return actor if named in actor else f"{named} ({actor})"


def _has_effect(item: Incoming) -> bool:
    """Return whether a request changes anything; renewing a lease does not."""
    request = cast("Request", item.message)
    return request.HAS_EFFECT and getattr(request, "verb", "") != "renew"
