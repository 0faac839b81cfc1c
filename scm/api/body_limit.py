"""Bodies: so many bytes and no more, said as a problem, whoever reads them first.

The framework has such a limit, but answers a body that announces too many bytes in plain text,
whatever gate or route had to say; and whoever reads before the route, as the Idempotency-Key does,
was held to the limit of all routes instead of the route's own.
"""

import re
from collections.abc import Mapping

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from scm.api.problem import problem

LARGEST_BODY = 2**20
"""Bytes of a request's body, but for files that are sent."""

_LONGEST_NUMBER = 18


class TooLargeError(HTTPException):
    """A body that has more bytes than its route takes."""

    def __init__(self, most: int) -> None:
        super().__init__(413, f"body: expected at most {most} bytes, got more")


class Bounded:
    """ASGI middleware: who reads a body that is too large gets a `TooLargeError` instead.

    Args:
        app: What is asked.
        larger: Patterns of addresses that take files, and how many bytes each takes.
    """

    def __init__(self, app: ASGIApp, *, larger: Mapping[str, int]) -> None:
        self._app = app
        self._larger = [(re.compile(pattern), most) for pattern, most in larger.items()]

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on; answer it where nobody behind could say that it is too large."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        most = self._most(str(scope["path"]))
        size, begun = _announced(scope), False
        came = 0

        async def receive_bounded() -> Message:
            nonlocal came
            if size > most:
                raise TooLargeError(most)
            message = await receive()
            came += len(message.get("body", b""))
            if came > most:
                raise TooLargeError(most)
            return message

        async def send_noted(message: Message) -> None:
            nonlocal begun
            begun = True
            await send(message)

        try:
            await self._app(scope, receive_bounded, send_noted)
        except TooLargeError as error:
            if begun:
                raise
            answer = problem(413, "too_large", error.detail, instance=scope["path"])
            await answer(scope, receive, send)

    def _most(self, path: str) -> int:
        fitting = (most for pattern, most in self._larger if pattern.fullmatch(path))
        return next(fitting, LARGEST_BODY)


def _announced(scope: Scope) -> int:
    """Return how many bytes a request says it has; 0: it does not say."""
    declared = Headers(scope=scope).get("content-length", "")
    return (
        int(declared)
        if declared.isascii() and declared.isdigit() and len(declared) <= _LONGEST_NUMBER
        else 0
    )
