"""ETag and If-Match: an editor sends the state it saw, so that no other edit is overwritten."""

import hashlib
from typing import Annotated, NamedTuple

from fastapi import Depends, Header, Request, Response

from scm.api.city import json_response
from scm.api.encoding import encode
from scm.api.problem import RefusedError

_READS = frozenset({"GET", "HEAD"})


def etag_of(body: bytes) -> str:
    """Return the strong ETag of a resource's bytes."""
    return f'"{hashlib.sha256(body).hexdigest()[:16]}"'


def tagged(request: Request, body: object, status: int = 200) -> Response:
    """Return a resource that can be edited as JSON with its ETag; 304 to a reader who has it."""
    tag = etag_of(encode(body))
    if request.method in _READS and has_tag(request.headers.get("if-none-match", ""), tag):
        return Response(status_code=304, headers={"ETag": tag, "Cache-Control": "no-cache"})
    return json_response(body, status, {"ETag": tag, "Cache-Control": "no-cache"})


class Condition(NamedTuple):
    """Which state a writer saw, by the headers of the request; None: not given."""

    if_match: str | None = None
    if_none_match: str | None = None

    def check(self, body: object | None) -> None:
        """Let a change pass when its writer saw the present state.

        Args:
            body: The resource as it is now; None: there is none yet.

        Raises:
            RefusedError: 428 where neither header is given, 412 where the state is another.
        """
        if self.if_match is None and self.if_none_match is None:
            detail = (
                "send If-Match with the ETag that you edited, or If-None-Match: * for a new one"
            )
            raise RefusedError.of("precondition_required", detail)
        if body is None:
            if self.if_match is not None:
                raise _stale("If-Match", self.if_match, "none: it does not exist")
            return
        tag = etag_of(encode(body))
        if self.if_match is None:
            raise _stale("If-None-Match", str(self.if_none_match), f"{tag}: it exists")
        if not names_tag(self.if_match, tag):
            raise _stale("If-Match", self.if_match, tag)


def _condition(
    if_match: Annotated[
        str | None,
        Header(
            max_length=200,
            description="ETag of the state that was edited; `*`: whichever there is",
            examples=['"5f2b8c1d9e0a4763"'],
        ),
    ] = None,
    if_none_match: Annotated[
        str | None,
        Header(max_length=200, description="`*`: only where there is none yet", examples=["*"]),
    ] = None,
) -> Condition:
    return Condition(if_match, if_none_match)


Matching = Annotated[Condition, Depends(_condition)]
"""What a route that changes what can be edited takes, and checks against the present state."""


def names_tag(header: str, tag: str) -> bool:
    """Return whether an `If-Match` names an ETag: the very one, not a weak one."""
    named = [part.strip() for part in header.split(",")]
    return named == ["*"] or tag in named


def has_tag(header: str, tag: str) -> bool:
    """Return whether an `If-None-Match` names an ETag, though a proxy that packs made it weak."""
    return names_tag(header.replace("W/", ""), tag)


def _stale(header: str, got: str, have: str) -> RefusedError:
    detail = f"{header}: got {got}, have {have}; read it again and redo your change"
    return RefusedError.of("precondition_failed", detail)
