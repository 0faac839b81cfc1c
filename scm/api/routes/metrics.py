"""Metrics of the city and of this server, as Prometheus reads them."""

from fastapi import APIRouter, Response
from prometheus_client import CONTENT_TYPE_LATEST

from scm.api.metrics import Metrics
from scm.api.roles import VIEWER
from scm.api.schemas import answer_file

PREFIX = ""


def router(metrics: Metrics) -> APIRouter:
    """Return the route."""
    routes = APIRouter(tags=["health"], dependencies=[VIEWER])

    @routes.get(
        "/metrics",
        summary="Metrics, as Prometheus reads them",
        response_class=Response,
        responses=answer_file("text/plain", "One line a number; `# HELP` describes it."),
    )
    async def all_metrics() -> Response:
        return Response(metrics.text(), headers={"Content-Type": CONTENT_TYPE_LATEST})

    return routes
