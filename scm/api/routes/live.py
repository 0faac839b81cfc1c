"""The live stream as server-sent events."""

from typing import Annotated

from fastapi import APIRouter, Header, Response
from fastapi.responses import StreamingResponse

from scm.api.roles import VIEWER
from scm.api.stream import Stream


def router(stream: Stream) -> APIRouter:
    """Return the route."""
    routes = APIRouter(tags=["stream"], dependencies=[VIEWER])

    @routes.get("/stream", summary="Everything live: a snapshot, then what changed, at 20 Hz")
    async def live(
        last_event_id: Annotated[str, Header(alias="Last-Event-ID", max_length=64)] = "",
    ) -> Response:
        return StreamingResponse(
            stream.listen(last_event_id),
            media_type="text/event-stream",
            headers={"Cache-Control": "no-store", "X-Accel-Buffering": "no"},
        )

    return routes
