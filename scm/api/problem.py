"""Errors of the web interface in one shape: RFC 9457 `application/problem+json`.

On top of the RFC's members every problem has a `code`, a short machine word.
"""

import errno
from collections.abc import Iterator
from http import HTTPStatus
from typing import Any, Self

import msgspec
from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect
from starlette.routing import Match

from scm.api.schemas import schema_of
from scm.api.trace import trace_id
from scm.errors import StoreError
from scm.records.problems import Problem
from scm.v2x.message import Refused

STATUS_OF_CODE = {
    "not_found": 404,
    "not_written": 507,
    "owned": 409,
    "precondition_failed": 412,
    "invalid": 422,
    "precondition_required": 428,
    "busy": 429,
    "offline": 503,
    "timeout": 504,
}
"""HTTP status for the code of a `Refused`; any other code is a conflict with the city's state."""

_CODE_OF_STATUS = {
    400: "invalid",
    401: "unauthorised",
    403: "forbidden",
    404: "not_found",
    405: "method_not_allowed",
    413: "too_large",
    415: "media_type",
    422: "invalid",
    429: "too_many",
    500: "internal",
}


DISK_TROUBLE = frozenset(
    {errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES, errno.EPERM, errno.EIO}
)
"""Errors of the server's disk when nothing can be written."""

_METHODS = ("GET", "POST", "PUT", "PATCH", "DELETE")
_STATUSES = (400, 401, 403, 404, 409, 412, 413, 415, 422, 428, 429, 500, 503, 504, 507)


RESPONSES: dict[int | str, dict[str, Any]] = {
    status: {
        "description": HTTPStatus(status).phrase,
        "content": {"application/problem+json": {"schema": schema_of(Problem)}},
    }
    for status in _STATUSES
}
"""What any route may answer instead, for the description of the interface."""


class RefusedError(Exception):
    """The city answered a request with `Refused`; becomes a problem at the edge."""

    def __init__(self, refused: Refused) -> None:
        super().__init__(refused.detail)
        self.refused = refused

    @classmethod
    def of(cls, code: str, detail: str) -> Self:
        """Return the refusal with a code and a sentence."""
        return cls(Refused(code=code, detail=detail))


class InvalidError(Exception):
    """What a caller sent is wrong; becomes a problem at the edge.

    Attributes:
        errors: Each wrong field: `where` it stands, and what was `expected` there.
    """

    def __init__(self, errors: tuple[dict[str, str], ...]) -> None:
        super().__init__(f"{len(errors)} wrong fields")
        self.errors = errors

    @classmethod
    def at(cls, where: str, expected: str) -> Self:
        """Return the error of one place."""
        return cls(({"where": where, "expected": expected},))


def problem(
    status: int,
    code: str,
    detail: str,
    *,
    request: str = "",
    instance: str = "",
    errors: tuple[dict[str, str], ...] = (),
) -> Response:
    """Return the response for an error."""
    body = Problem(
        type="about:blank",
        title=HTTPStatus(status).phrase,
        status=status,
        code=code,
        detail=detail,
        asked=request,
        instance=instance,
        trace_id=trace_id(),
        errors=errors,
    )
    headers = {"Cache-Control": "no-store"}
    if status == HTTPStatus.UNAUTHORIZED:
        headers["WWW-Authenticate"] = "Bearer"
    return Response(
        msgspec.json.encode(body), status, headers, media_type="application/problem+json"
    )


def install(app: FastAPI) -> None:
    """Make every error of the application a problem."""
    app.add_exception_handler(RefusedError, _on_refused)
    app.add_exception_handler(RequestValidationError, _on_invalid)
    app.add_exception_handler(InvalidError, _on_invalid)
    app.add_exception_handler(HTTPException, on_http)
    app.add_exception_handler(ClientDisconnect, _on_gone)
    app.add_exception_handler(OSError, _on_disk)
    app.add_exception_handler(StoreError, _on_store)
    app.add_exception_handler(Exception, _on_bug)


async def _on_refused(request: Request, error: Exception) -> Response:
    assert isinstance(error, RefusedError)  # noqa: S101  the type it was registered for
    refused = error.refused
    status = STATUS_OF_CODE.get(refused.code, 409)
    at = request.url.path
    return problem(status, refused.code, refused.detail, request=refused.asked, instance=at)


async def _on_invalid(request: Request, error: Exception) -> Response:
    assert isinstance(error, InvalidError | RequestValidationError)  # noqa: S101  as registered
    errors = error.errors if isinstance(error, InvalidError) else _in_parameters(error)
    detail = "; ".join(f"{item['where']}: {item['expected']}" for item in errors)
    return problem(422, "invalid", detail, instance=request.url.path, errors=errors)


def _in_parameters(error: RequestValidationError) -> tuple[dict[str, str], ...]:
    """Return where parameters of a path, query or header are wrong, and what was expected there."""
    return tuple(
        {"where": ".".join(str(step) for step in found["loc"]), "expected": str(found["msg"])}
        for found in error.errors()
    )


async def on_http(request: Request, error: Exception) -> Response:
    """Return the problem for what the framework refuses: a path, a method, too large a body."""
    assert isinstance(error, HTTPException)  # noqa: S101  the type it was registered for
    code = _CODE_OF_STATUS.get(error.status_code, "http")
    response = problem(error.status_code, code, str(error.detail), instance=request.url.path)
    if error.status_code == HTTPStatus.METHOD_NOT_ALLOWED:
        response.headers["Allow"] = ", ".join(_allowed(request))
    return response


def _allowed(request: Request) -> Iterator[str]:
    """Yield the methods of an address: its route that refused one knows its own alone."""
    for method in _METHODS:
        scope = {**request.scope, "method": method}
        if any(route.matches(scope)[0] is Match.FULL for route in request.app.routes):
            yield method
            if method == "GET":
                yield "HEAD"


async def _on_gone(request: Request, _error: Exception) -> Response:
    """Answer a body that broke off, for metrics and audit: no client receives it, no bug."""
    return problem(400, "invalid", "the body broke off", instance=request.url.path)


async def _on_disk(request: Request, error: Exception) -> Response:
    """Report what keeps a folder from being written; any other file error is a bug."""
    if not isinstance(error, OSError) or error.errno not in DISK_TROUBLE:
        raise error
    detail = f"the server's disk: {error.strerror}"
    return problem(507, "not_written", detail, instance=request.url.path)


async def _on_store(request: Request, error: Exception) -> Response:
    return problem(507, "not_written", str(error), instance=request.url.path)


async def _on_bug(request: Request, _error: Exception) -> Response:
    detail = "the server failed on this request; its log has the reason"
    return problem(500, "internal", detail, instance=request.url.path)
