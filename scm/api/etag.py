"""ETag and If-Match: who edits says which state he saw, so that nobody's work is overwritten."""

import hashlib

from fastapi import Request, Response

from scm.api.city import json_response
from scm.api.encoding import encode
from scm.api.problem import RefusedError
from scm.v2x.message import Refused


def etag_of(body: bytes) -> str:
    """Return the strong ETag of a resource's bytes."""
    return f'"{hashlib.sha256(body).hexdigest()[:16]}"'


def tagged(request: Request, body: object, status: int = 200) -> Response:
    """Return a resource that can be edited as JSON with its ETag; 304 when the reader has it."""
    tag = etag_of(encode(body))
    if status == 200 and _names(request.headers.get("if-none-match", ""), tag):
        return Response(status_code=304, headers={"ETag": tag, "Cache-Control": "no-cache"})
    return json_response(body, status, {"ETag": tag, "Cache-Control": "no-cache"})


def check_match(request: Request, body: object | None) -> None:
    """Let a change pass when its writer saw the present state.

    Args:
        request: Carries `If-Match`, or `If-None-Match: *` for what is new.
        body: The resource as it is now; None: there is none yet.

    Raises:
        RefusedError: 428 where neither header is given, 412 where the state is another.
    """
    wanted, new = request.headers.get("if-match"), request.headers.get("if-none-match")
    if wanted is None and new is None:
        detail = "send If-Match with the ETag that you edited, or If-None-Match: * for a new one"
        raise RefusedError(Refused(code="precondition_required", detail=detail))
    if body is None:
        if wanted is not None:
            raise _stale("If-Match", wanted, "none: it does not exist")
        return
    tag = etag_of(encode(body))
    if wanted is None:
        raise _stale("If-None-Match", str(new), f"{tag}: it exists")
    if not _names(wanted, tag):
        raise _stale("If-Match", wanted, tag)


def _names(header: str, tag: str) -> bool:
    return "*" in header or tag in (part.strip() for part in header.split(","))


def _stale(header: str, got: str, have: str) -> RefusedError:
    detail = f"{header}: got {got}, have {have}; read it again and redo your change"
    return RefusedError(Refused(code="precondition_failed", detail=detail))
