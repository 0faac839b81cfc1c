"""A part at its bus: what it hears is collected, what it sends goes out, retries get one answer.

Both runners use it. Whoever asks again with the `request_id` of an answered request gets the
stored answer: the effect happens once, however often the network makes people ask.
"""

from collections import OrderedDict
from collections.abc import Iterable, Sequence
from typing import TypeVar, cast

from scm.part import Hears, Part
from scm.v2x.bus import Bus, Mailbox, RawMailbox
from scm.v2x.exchange import Answer, Call, Incoming, Outgoing, RawSample
from scm.v2x.mailbox import drain_all
from scm.v2x.message import Delivery, Message, Refused, Request, encode

DEPTH = {
    Delivery.STREAM: 1024,
    Delivery.COMMAND: 256,
    Delivery.EVENT: 4096,
    Delivery.RPC: 256,
    Delivery.PRESENCE: 1024,
}
RAW_DEPTH = 16384
ANSWERS_KEPT = 1024

V = TypeVar("V")


class Station:
    """One part, tied to one bus: subscribed, serving and announced from the start."""

    def __init__(self, part: Part, bus: Bus) -> None:
        self._part = part
        self._bus = bus
        self._boxes: list[Mailbox | RawMailbox] = []
        self._replies = self._mailbox(Delivery.RPC)
        self._answers = _Answers()
        self._heard: Sequence[Hears] = ()
        self._ears: list[tuple[Hears, Mailbox]] = []
        self._follow()
        for serves in part.serves:
            bus.serve(serves.kind, serves.where, self._mailbox(Delivery.RPC))
        self._hear_raw()
        learn = getattr(part, "learn_wishes", None)
        if learn is not None:
            learn(bus.is_wanted)
        bus.announce(part.role)

    def _hear_raw(self) -> None:
        raw = RawMailbox(RAW_DEPTH)
        if getattr(self._part, "hears_raw", False):
            self._bus.subscribe_raw(raw)
        for kind in getattr(self._part, "hears_raw_too", ()):
            self._bus.subscribe_raw(raw, kind)
        self._boxes.append(raw)

    def _follow(self) -> None:
        """Subscribe to what the part wishes to hear now, and to nothing else any more."""
        if self._part.hears is self._heard:
            return
        self._heard = self._part.hears
        wished = list(self._heard)
        for ear in list(self._ears):
            hears, box = ear
            if hears in wished:
                wished.remove(hears)
            else:
                self._bus.unsubscribe(box)
                self._ears.remove(ear)
                self._boxes.remove(box)
        for hears in wished:
            box = self._mailbox(hears.kind.DELIVERY)
            self._bus.subscribe(hears.kind, hears.where, box)
            self._ears.append((hears, box))

    def _mailbox(self, delivery: Delivery) -> Mailbox:
        box = Mailbox(DEPTH[delivery])
        self._boxes.append(box)
        return box

    @property
    def dropped(self) -> int:
        """How many arrivals had to make room for newer ones since the start."""
        return sum(box.dropped for box in self._boxes)

    def inbox(self) -> list[Incoming]:
        """Return what arrived since the last time, without requests that are answered already."""
        self._follow()
        fresh: list[Incoming | RawSample] = []
        for item in drain_all(self._boxes):
            if isinstance(item, Incoming) and _is_request(item):
                stored = self._answers.recall(item)
                if stored is not None:
                    self._bus.answer(stored)
                    continue
                if not self._answers.is_first(item):
                    continue
            fresh.append(item)
        # A part that asks for raw samples declares that its inbox holds them too.
        return cast("list[Incoming]", fresh)

    def send(self, outgoing: Iterable[Outgoing]) -> None:
        """Deliver what a step returned, in its order."""
        for item in outgoing:
            if isinstance(item, Call):
                self._bus.call(item, self._replies.put)
            elif isinstance(item, Answer):
                for answer in self._answers.store(item):
                    self._bus.answer(answer)
            else:
                self._bus.publish(item)


def _is_request(item: Incoming) -> bool:
    return isinstance(item.message, Request) and item.call is None


class _Answers:
    """The last answers by request id, and who else waits for one that is not given yet."""

    def __init__(self) -> None:
        self._given: OrderedDict[tuple[type[Message], str], tuple[bytes, Message]] = OrderedDict()
        self._waiting: OrderedDict[tuple[type[Message], str], list[Incoming]] = OrderedDict()

    def recall(self, item: Incoming) -> Answer | None:
        """Return the stored answer to a retry, or a refusal when its id was used otherwise."""
        request = _request(item)
        stored = self._given.get((type(request), request.request_id))
        if stored is None:
            return None
        body, reply = stored
        if encode(request)[0] != body:
            detail = f"request_id: {request.request_id!r} was used for another request already"
            return Answer(item, Refused(code="invalid", detail=detail))
        return Answer(item, reply)

    def is_first(self, item: Incoming) -> bool:
        """Return whether the part must see it; a retry waits for the first one's answer."""
        request = _request(item)
        if not request.request_id:
            return True
        waiting = self._waiting.setdefault((type(request), request.request_id), [])
        waiting.append(item)
        _shorten(self._waiting)
        return len(waiting) == 1

    def store(self, answer: Answer) -> Sequence[Answer]:
        """Keep an answer; return it for everybody who waits for it."""
        request = _request(answer.to)
        if not request.request_id:
            return [answer]
        key = (type(request), request.request_id)
        self._given[key] = (encode(request)[0], answer.reply)
        _shorten(self._given)
        others = [item for item in self._waiting.pop(key, []) if item is not answer.to]
        return [answer, *(Answer(item, answer.reply) for item in others)]


def _request(item: Incoming) -> Request:
    return cast("Request", item.message)


def _shorten(store: "OrderedDict[tuple[type[Message], str], V]") -> None:
    while len(store) > ANSWERS_KEPT:
        store.popitem(last=False)
