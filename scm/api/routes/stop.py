"""The red button: stop every car of the city, or let them drive again."""

from fastapi import APIRouter, Response
from pydantic import BaseModel, ConfigDict, Field

from scm.api.city import City, IdempotencyKey, json_response
from scm.api.picture import Picture
from scm.api.roles import OPERATOR, VIEWER
from scm.api.schemas import answer
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.stop_request import StopRequest


class StopBody(BaseModel):
    """The state wished for: setting it twice is the same as once."""

    model_config = ConfigDict(extra="forbid")

    engaged: bool = Field(description="true: stop every car", examples=[True])
    by: str = Field("api", max_length=64, description="who wishes it", examples=["ada"])
    reason: str = Field(
        "", max_length=500, description="why, for the log", examples=["a hand on the floor"]
    )


def stop_of(picture: Picture) -> CityStop:
    """Return the stop as last told by the world; released when it never spoke of it."""
    return picture.stop or CityStop(t_ns=0, engaged=False)


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/stop", tags=["stop"], dependencies=[VIEWER])

    @routes.get("", summary="Whether the city-wide stop is engaged", responses=answer(CityStop))
    async def stop() -> Response:
        return json_response(stop_of(city.view.picture()))

    @routes.put(
        "",
        summary="Engage or release the city-wide stop",
        dependencies=[OPERATOR],
        responses=answer(CityStop),
    )
    def set_stop(body: StopBody, key: IdempotencyKey = "") -> Response:
        request = StopRequest(request_id=key, engaged=body.engaged, by=body.by, reason=body.reason)
        return json_response(city.ask(request, CityStop))

    return routes
