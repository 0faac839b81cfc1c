"""HEAD: the headers of GET without its body (RFC 9110, 9.3.2), of every address.

What is long or endless is begun and ended again, as when its reader goes away.
"""

import asyncio

from starlette.types import ASGIApp, Message, Receive, Scope, Send

_FOUND = ("route", "path_params")


class Headed:
    """ASGI middleware, innermost: routes know GET alone."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Compute the answer, and leave out its body."""
        if scope["type"] != "http" or scope["method"] != "HEAD":
            await self._app(scope, receive, send)
            return
        as_get = {**scope, "method": "GET"}
        was_received, is_over = False, asyncio.Event()

        async def receive_once() -> Message:
            nonlocal was_received
            if not was_received:
                was_received = True
                return await receive()
            await is_over.wait()
            return {"type": "http.disconnect"}

        async def send_head(message: Message) -> None:
            if message["type"] == "http.response.start":
                await send(message)
                await send({"type": "http.response.body", "body": b""})
                is_over.set()

        await self._app(as_get, receive_once, send_head)
        scope.update({name: as_get[name] for name in _FOUND if name in as_get})
