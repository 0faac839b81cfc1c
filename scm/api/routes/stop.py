"""The city stop: stop every car of the city, or let them drive again.

It has threads of its own: it never waits behind other requests to the server.
"""

import asyncio
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context

from fastapi import APIRouter, Request, Response

from scm.api.city import City, IdempotencyKey, json_response
from scm.api.inputs import Json
from scm.api.picture import Picture
from scm.api.problem import RefusedError
from scm.api.roles import OPERATOR, VIEWER, Signer
from scm.api.schemas import answer
from scm.records.stop import StopBody
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.stop_request import StopRequest

THREADS = 8


def stop_of(picture: Picture) -> CityStop:
    """Return the stop as last reported by the world; released if it never was."""
    return picture.stop or CityStop(t_ns=0, engaged=False)


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/stop", tags=["stop"], dependencies=[VIEWER])
    threads = ThreadPoolExecutor(THREADS, thread_name_prefix="stop")

    @routes.get("", summary="Whether the city-wide stop is engaged", responses=answer(CityStop))
    async def stop() -> Response:
        return json_response(stop_of(city.view.picture()))

    @routes.put(
        "",
        summary="Engage or release the city-wide stop",
        dependencies=[OPERATOR],
        responses=answer(CityStop),
    )
    async def set_stop(
        request_: Request, body: Json[StopBody], signer: Signer, key: IdempotencyKey = ""
    ) -> Response:
        if not (body.engaged or request_.scope.get("scm_is_sure", True)):
            detail = "the store of API keys cannot be read now: it must know your key for that"
            raise RefusedError.of("offline", detail)
        by, reason = signer(body.by), body.reason
        request = StopRequest(request_id=key, engaged=body.engaged, by=by, reason=reason)
        loop = asyncio.get_running_loop()
        run = copy_context().run  # the trace of this request goes along
        stop = await loop.run_in_executor(threads, run, city.call, request, CityStop)
        return json_response(stop)

    return routes
