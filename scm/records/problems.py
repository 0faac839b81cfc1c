"""The body of an error, RFC 9457."""

from typing import Annotated

import msgspec
from msgspec import Meta


class Problem(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """The body of an error, RFC 9457.

    Attributes:
        type: `about:blank`: the status is enough.
        title: The status in words.
        status: Of the answer.
        code: A short word for programs.
        detail: What is wrong, where, what was expected, in a sentence.
        asked: Where a part of the city did not answer: the request and its key on the bus.
        instance: The path of the request.
        trace_id: Names this request in the log of the server (W3C trace context).
        errors: Each wrong field: `where` it stands, and what was `expected` there.
    """

    type: Annotated[str, Meta(examples=["about:blank"])]
    title: Annotated[str, Meta(examples=["Not Found"])]
    status: Annotated[int, Meta(examples=[404])]
    code: Annotated[str, Meta(examples=["not_found"])]
    detail: Annotated[str, Meta(examples=["there is no vehicle named 'n9'"])] = ""
    asked: Annotated[str, Meta(examples=["StopRequest on scm/@v1/lab/world/stop_request"])] = ""
    instance: Annotated[str, Meta(examples=["/api/v1/vehicles/n9"])] = ""
    trace_id: Annotated[str, Meta(examples=["4bf92f3577b34da6a3ce929d0e0e4736"])] = ""
    errors: Annotated[
        tuple[dict[str, str], ...],
        Meta(examples=[[{"where": "body.laps", "expected": "a number above 0"}]]),
    ] = ()
