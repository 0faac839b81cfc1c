"""All cars' states as a binary stream: what the map draws."""

from fastapi import APIRouter, Response
from fastapi.responses import StreamingResponse

from scm.api.roles import VIEWER
from scm.api.vehicle_frames import MEDIA_TYPE, VERSION, VehicleFrames


def router(frames: VehicleFrames) -> APIRouter:
    """Return the route."""
    routes = APIRouter(tags=["stream"], dependencies=[VIEWER])

    @routes.get(
        "/vehicles.bin",
        summary="All cars' states at 20 Hz, binary; the layout stands in docs/dashboard/map.md",
        response_class=Response,
        responses={200: {"content": {MEDIA_TYPE: {"schema": {"type": "string"}}}}},
    )
    async def states() -> Response:
        return StreamingResponse(
            frames.listen(),
            media_type=MEDIA_TYPE,
            headers={
                "Cache-Control": "no-store",
                "X-Accel-Buffering": "no",
                "X-Frame-Layout": str(VERSION),
            },
        )

    return routes
