"""Construction boxes that cars can push: where they are, and back to their places."""

from fastapi import APIRouter, Response

from scm.api.city import City, IdempotencyKey, json_response
from scm.api.picture import Picture
from scm.api.roles import OPERATOR, VIEWER, Signer
from scm.api.schemas import answer
from scm.records.boxes import Boxes, SnapshotBox
from scm.v2x.messages.boxes_request import BoxesReply, BoxesRequest


def boxes_of(picture: Picture) -> tuple[SnapshotBox, ...]:
    """Return where the boxes are that can be pushed."""
    return picture.snapshot.message.boxes if picture.snapshot is not None else ()


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/boxes", tags=["boxes"], dependencies=[VIEWER])

    @routes.get("", summary="Where the boxes are that cars can push", responses=answer(Boxes))
    async def boxes() -> Response:
        return json_response(Boxes(boxes=boxes_of(city.view.picture())))

    @routes.post(
        "/reset",
        summary="Put all boxes back where the map has them",
        dependencies=[OPERATOR],
        responses=answer(BoxesReply),
    )
    def reset(signer: Signer, key: IdempotencyKey = "") -> Response:
        return json_response(city.call(BoxesRequest(request_id=key, by=signer("")), BoxesReply))

    return routes
