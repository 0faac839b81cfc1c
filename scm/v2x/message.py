"""The base of all messages: a typed record with its key, rate and delivery."""

from enum import Enum
from functools import lru_cache
from typing import Any, ClassVar, TypeVar

import msgspec

from scm.errors import MessageError
from scm.v2x.integers import are_short


class Delivery(Enum):
    """How a message is delivered.

    STREAM: only the newest matters; late ones may be dropped (vehicle state, frames).
    COMMAND: only the newest matters, with priority over all others (drive commands).
    EVENT: each one matters; late joiners get the last ones (events, map, monitor).
    RPC: request and answer.
    PRESENCE: sent by the bus itself when a station connects or disconnects.
    """

    STREAM = "stream"
    COMMAND = "command"
    EVENT = "event"
    RPC = "rpc"
    PRESENCE = "presence"


class Message(msgspec.Struct, kw_only=True, frozen=True, gc=False):
    """Base of all messages. Fields end in their unit; `t_ns` is the sender's time of validity.

    A field named `payload` holds raw bytes: it is sent as the body and everything else as a small
    JSON attachment. New fields need defaults, so that old bytes still decode.

    Messages contain no cycles, so the garbage collector does not track them (`gc=False`): creating
    one takes half the time.

    Attributes:
        KEY: Below `scm/@v1/<city>/`; `{field}` chunks are fields of the message.
        RATE_HZ: Nominal rate; None: sent on occasion.
        DELIVERY: How it is delivered.
        HISTORY_DEPTH: With EVENT, how many last messages a late joiner gets.
    """

    KEY: ClassVar[str] = ""
    RATE_HZ: ClassVar[float | None] = None
    DELIVERY: ClassVar[Delivery] = Delivery.STREAM
    HISTORY_DEPTH: ClassVar[int] = 1


class Request(Message, kw_only=True, frozen=True):
    """Base of requests; `REPLY` is the class of the answer.

    Attributes:
        request_id: One effect per id: a retry gets the stored answer. Empty: not retried.
        trace_id: W3C trace id of its cause, such as a click; for logs only. Empty: not traced.
        actor: Who sends it, for the audit log only: a station, a program, the owner of an API key.
            Empty: unknown.
        SERVER: Who answers it, for people; `{field}` words are fields of the message.
        HAS_EFFECT: Whether it changes anything; only such requests are in the audit log.
    """

    DELIVERY: ClassVar[Delivery] = Delivery.RPC
    REPLY: ClassVar[type[Message]] = Message
    SERVER: ClassVar[str] = "the part that does this"
    HAS_EFFECT: ClassVar[bool] = True

    request_id: str = ""
    trace_id: str = ""
    actor: str = ""

    @property
    def server(self) -> str:
        """Who answers it, for people."""
        fields = {name: getattr(self, name) for name in self.__struct_fields__}
        return self.SERVER.format_map(fields)


class Refused(Message, kw_only=True, frozen=True):
    """The answer to a request that could not be fulfilled (RFC 9457: type, title, detail).

    Attributes:
        code: Machine-readable: `timeout`, `not_found`, `owned`, `invalid`, `offline`.
        detail: One sentence for people: what, where, got, expected.
        asked: Without a reply: the request and its key on the bus, for engineers.
    """

    KEY: ClassVar[str] = "refused"
    DELIVERY: ClassVar[Delivery] = Delivery.RPC

    code: str
    detail: str
    asked: str = ""


M = TypeVar("M", bound=Message)

_encoder = msgspec.json.Encoder()


@lru_cache(maxsize=256)
def _decoder(kind: type[Message]) -> msgspec.json.Decoder[Any]:
    return msgspec.json.Decoder(kind)


@lru_cache(maxsize=256)
def is_bulk(kind: type[Message]) -> bool:
    """Return whether messages of this class carry a raw `payload`."""
    return "payload" in kind.__struct_fields__


def encode(message: Message) -> tuple[bytes, bytes | None]:
    """Return (body, attachment): JSON and None, or the raw payload and its JSON header."""
    if not is_bulk(type(message)):
        return _encoder.encode(message), None
    fields = {name: getattr(message, name) for name in message.__struct_fields__}
    payload: bytes = fields.pop("payload")
    return payload, _encoder.encode(fields)


def decode(kind: type[M], body: bytes, attachment: bytes | None = None) -> M:
    """Decode a message.

    Raises:
        MessageError: naming the class, the field and what was expected there.
    """
    try:
        if is_bulk(kind):
            header = msgspec.json.decode(attachment or b"{}")
            message = msgspec.convert({**header, "payload": body}, kind)
        else:
            message = _decoder(kind).decode(body)
    except (msgspec.MsgspecError, TypeError, UnicodeDecodeError, RecursionError) as cause:
        msg = f"{kind.__name__}: {cause}"
        raise MessageError(msg) from cause
    if not are_short(message):
        msg = f"{kind.__name__}: expected integers of at most 64 bits"
        raise MessageError(msg)
    return message
