"""The audit log."""

from typing import Annotated, Any

import msgspec
from msgspec import Meta

from scm.records.fields import (
    Digest,
    ErrorText,
    KindName,
    Number,
    RequestedBy,
    StationName,
    Text,
    TNs,
)


class AuditRow(msgspec.Struct, kw_only=True, frozen=True):
    """One deed of the audit log.

    Attributes:
        number: Of the entry; numbers have no gaps.
        t_ns: When it was requested [ns since 1970].
        station: Who did it: `world`, `traffic`, `api`.
        kind: The request's class, or method and path of a call of the web; `unreadable`: what
            stands there is no entry.
        text: What was done, in words.
        by: Who requested it: the owner of the API key, the program that called, the part.
        request_id: Id of the request; empty: it had none.
        trace_id: Of what led to it: the call of the web and what the city did for it have the same;
            empty: it was not traced.
        request, reply: The request and its reply, as the station noted them.
    """

    number: Number
    t_ns: TNs
    station: StationName
    kind: KindName
    text: Text
    by: RequestedBy
    request_id: Annotated[str, Meta(examples=["k1"])]
    trace_id: Annotated[str, Meta(examples=["4bf92f3577b34da6a3ce929d0e0e4736"])]
    request: dict[str, Any]
    reply: dict[str, Any]


class ChainVerdict(msgspec.Struct, kw_only=True, frozen=True):
    """Whether the chain of entries is whole.

    Attributes:
        whole: Whether every entry follows the one before as it is now.
        entries: Number of the newest.
        digest: Hash of the newest, in hexadecimal: note it elsewhere, and give it again.
        error: What is broken; empty: nothing.
    """

    whole: bool
    entries: int
    digest: Digest
    error: ErrorText
