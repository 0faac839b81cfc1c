"""What every message is: a typed record that knows its key, its rate and how it should travel."""

from enum import Enum
from functools import lru_cache
from typing import Any, ClassVar, TypeVar

import msgspec

from scm.errors import MessageError
from scm.v2x.integers import are_short


class Delivery(Enum):
    """How a message should travel, named for what the receiver needs.

    STREAM: only the newest matters; a late one may be dropped (vehicle state, frames).
    COMMAND: only the newest matters and it overtakes everything else (drive commands).
    EVENT: each one matters; late joiners get the last ones (events, map, monitor).
    RPC: asked and answered once.
    PRESENCE: made by the bus itself when a station comes or goes.
    """

    STREAM = "stream"
    COMMAND = "command"
    EVENT = "event"
    RPC = "rpc"
    PRESENCE = "presence"


class Message(msgspec.Struct, kw_only=True, frozen=True, gc=False):
    """Base of all messages. Fields end in their unit; `t_ns` is when it was true at the sender.

    A field named `payload` holds raw bytes: it travels as the body and everything else as a small
    JSON attachment. New fields need defaults: old bytes must still decode.

    No message holds itself, so the collector of cycles need not know of any (`gc=False`): to make
    one takes half of the time, and nobody walks over the thousand that wait.

    Attributes:
        KEY: Below `scm/@v1/<city>/`; `{field}` chunks are fields of the message.
        RATE_HZ: How often it is meant to be sent; None when it is sent on occasion.
        DELIVERY: How it should travel.
        KEEP: With EVENT, how many last messages a late joiner gets.
    """

    KEY: ClassVar[str] = ""
    RATE_HZ: ClassVar[float | None] = None
    DELIVERY: ClassVar[Delivery] = Delivery.STREAM
    KEEP: ClassVar[int] = 1


class Request(Message, kw_only=True, frozen=True):
    """Base of messages that are asked and answered; `REPLY` is the class of the answer.

    Attributes:
        request_id: Same id, same effect, once: a retry gets the stored answer. Empty: not retried.
        trace_id: W3C trace id of what led to it, a click perhaps; whoever does it notes that. It
            makes no difference to what is asked. Empty: nobody traces it.
        actor: Who sends it, for the audit log: a station, a program, the owner of an API key. It
            makes no difference to what is asked either. Empty: the request does not say.
        SERVER: Who answers it, for people; `{field}` words are fields of the message.
        HAS_EFFECT: Whether it changes anything: what does not is in no audit log.
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
    """The answer to a request that could not be done, in words (RFC 9457: type, title, detail).

    Attributes:
        code: A short machine word: `timeout`, `not_found`, `owned`, `invalid`, `offline`.
        detail: One sentence for a person: what, where, got, expected.
        asked: Where nobody answered: the request and its key on the bus, for engineers.
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
    """Read a message back.

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
