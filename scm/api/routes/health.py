"""Health: is the server up, and does it hear the world."""

from fastapi import APIRouter, Response

from scm.api.city import City, json_response
from scm.api.problem import problem

READY_S = 2.0


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(tags=["health"])

    @routes.get("/healthz", summary="The server answers")
    def healthz() -> Response:
        return json_response({"status": "ok"})

    @routes.get("/readyz", summary="The world is heard")
    def readyz() -> Response:
        picture = city.view.picture()
        if picture.snapshot is None:
            return problem(503, "not_ready", "no snapshot of the world has arrived yet")
        age_s = picture.snapshot.age_s(picture.now_ns)
        if age_s > READY_S:
            detail = f"the newest snapshot is {age_s:.1f} s old, expected at most {READY_S} s"
            return problem(503, "not_ready", detail)
        return json_response({"status": "ready", "snapshot_age_s": round(age_s, 2)})

    return routes
