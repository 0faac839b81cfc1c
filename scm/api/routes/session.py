"""Who is calling; and a cookie for pages, whose event stream and pictures cannot send a header."""

from fastapi import APIRouter, Request, Response

from scm.api.city import json_response
from scm.api.gate import COOKIE
from scm.api.roles import VIEWER
from scm.api.schemas import answer
from scm.records.session import Ended, Session


def router() -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/session", tags=["session"], dependencies=[VIEWER])

    @routes.get("", summary="The owner and role of this key", responses=answer(Session))
    async def session(request: Request) -> Response:
        return json_response(_session(request))

    @routes.put(
        "", summary="Keep this key as a cookie, good for reading", responses=answer(Session)
    )
    async def begin(request: Request) -> Response:
        response = json_response(_session(request))
        key = request.scope["scm_key"]
        if key:
            secure = request.url.scheme == "https"
            response.set_cookie(
                COOKIE, key, path="/api", httponly=True, samesite="strict", secure=secure
            )
        return response

    @routes.delete("", summary="Forget the cookie", responses=answer(Ended))
    async def end() -> Response:
        response = json_response(Ended())
        response.delete_cookie(COOKIE, path="/api")
        return response

    return routes


def _session(request: Request) -> Session:
    return Session(owner=request.scope["scm_owner"], role=request.scope["scm_role"])
