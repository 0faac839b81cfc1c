"""Who is calling; and a cookie for pages, whose event stream and pictures cannot send a header."""

from fastapi import APIRouter, Request, Response

from scm.api.city import json_response
from scm.api.gate import COOKIE
from scm.api.roles import VIEWER


def router() -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/session", tags=["session"], dependencies=[VIEWER])

    @routes.get("", summary="Who this key says you are")
    def session(request: Request) -> Response:
        return json_response({"owner": request.scope["scm_owner"], "role": _role(request)})

    @routes.put("", summary="Keep this key as a cookie, good for reading")
    def begin(request: Request) -> Response:
        response = json_response({"owner": request.scope["scm_owner"], "role": _role(request)})
        key = request.scope["scm_key"]
        if key:
            secure = request.url.scheme == "https"
            response.set_cookie(
                COOKIE, key, path="/api", httponly=True, samesite="strict", secure=secure
            )
        return response

    @routes.delete("", summary="Forget the cookie")
    def end() -> Response:
        response = json_response({})
        response.delete_cookie(COOKIE, path="/api")
        return response

    return routes


def _role(request: Request) -> str:
    return str(request.scope["scm_role"])
