"""The live stream as server-sent events."""

from typing import Annotated

from fastapi import APIRouter, Header, Query, Response
from fastapi.responses import StreamingResponse

from scm.api.problem import RefusedError
from scm.api.roles import VIEWER
from scm.api.schemas import answer_file
from scm.api.stream import Stream
from scm.errors import nearest


def router(stream: Stream) -> APIRouter:
    """Return the route."""
    routes = APIRouter(tags=["stream"], dependencies=[VIEWER])

    @routes.get(
        "/stream",
        summary="What is live: a snapshot, then what changed, at 20 Hz",
        response_class=StreamingResponse,
        responses=answer_file(
            "text/event-stream", "`snapshot`, then `delta` and `beat`, as events."
        ),
    )
    async def live(
        topics: Annotated[
            str,
            Query(
                max_length=200,
                description=f"comma-separated: {', '.join(stream.topics)}; none: all",
                examples=["vehicles,signals"],
            ),
        ] = "",
        last_event_id: Annotated[
            str,
            Header(
                alias="Last-Event-ID",
                max_length=64,
                description="of the last frame seen: events continue after it",
                examples=["1f0c9a2e-120-7"],
            ),
        ] = "",
    ) -> Response:
        named = [name.strip() for name in topics.split(",") if name.strip()]
        _check(named, stream.topics)
        return StreamingResponse(
            stream.listen(last_event_id, named or None),
            media_type="text/event-stream",
            headers={"Cache-Control": "no-store", "X-Accel-Buffering": "no"},
        )

    return routes


def _check(named: list[str], known: tuple[str, ...]) -> None:
    for name in named:
        if name not in known:
            detail = f"topics: got {name!r}, expected some of {known}{nearest(name, known)}"
            raise RefusedError.of("invalid", detail)
