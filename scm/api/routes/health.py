"""Health: is the server up, and can it do its work."""

import shutil
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path

import msgspec
from fastapi import APIRouter, Response

from scm.api.city import City, json_response
from scm.api.problem import problem
from scm.api.schemas import answer
from scm.clock import seconds

READY_S = 2.0
LEAST_FREE_BYTES = 200 * 2**20


class Alive(msgspec.Struct, kw_only=True, frozen=True):
    """The server answers.

    Attributes:
        status: `ok`.
    """

    status: str


class Check(msgspec.Struct, kw_only=True, frozen=True):
    """One thing that the server needs.

    Attributes:
        name: `router`: its connection to the bus; `world`: snapshots come; `disk`: there is room on
            the shelves for recordings, reports and the like.
        good: Whether it is there.
        detail: What was found, in words.
    """

    name: str
    good: bool
    detail: str


class Ready(msgspec.Struct, kw_only=True, frozen=True):
    """The server can do its work.

    Attributes:
        status: `ready`.
        snapshot_age_s: How long ago the world was heard.
        checks: What was looked at.
    """

    status: str
    snapshot_age_s: float | None
    checks: tuple[Check, ...]


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(tags=["health"])

    @routes.get("/healthz", summary="The server answers", responses=answer(Alive))
    async def healthz() -> Response:
        return json_response(Alive(status="ok"))

    @routes.get(
        "/readyz",
        summary="The router, the world and the disk are there",
        responses=answer(Ready),
    )
    def readyz() -> Response:
        checks = (_router(city), _world(city), _disk(city))
        wrong = [f"{check.name}: {check.detail}" for check in checks if not check.good]
        if wrong:
            return problem(503, "not_ready", "; ".join(wrong))
        age_s = _age_s(city)
        age_s = None if age_s is None else round(age_s, 2)
        return json_response(Ready(status="ready", snapshot_age_s=age_s, checks=checks))

    return routes


def _router(city: City) -> Check:
    up = city.link.is_connected()
    detail = "connected" if up else "not connected: nothing comes from the city, nothing goes there"
    return Check(name="router", good=up, detail=detail)


def _world(city: City) -> Check:
    age_s = _age_s(city)
    if age_s is None:
        return Check(name="world", good=False, detail="no snapshot of the world has arrived yet")
    detail = f"the newest snapshot is {age_s:.1f} s old, expected at most {READY_S} s"
    return Check(name="world", good=age_s <= READY_S, detail=detail)


def _age_s(city: City) -> float | None:
    """Return how old the newest snapshot is, though the view's runner may hang."""
    picture = city.view.picture()
    if picture.snapshot is None:
        return None
    return seconds(city.now_ns() - picture.snapshot.arrived_ns)


def _disk(city: City) -> Check:
    free = {folder: shutil.disk_usage(folder).free for folder in _folders(city)}
    if not free:
        return Check(name="disk", good=True, detail="there are no shelves")
    folder, least = min(free.items(), key=lambda found: found[1])
    detail = f"{folder} has {least // 2**20} MiB free, expected {LEAST_FREE_BYTES // 2**20} or more"
    return Check(name="disk", good=least >= LEAST_FREE_BYTES, detail=detail)


def _folders(city: City) -> Iterator[Path]:
    """Yield the shelves that are there, or what they will be made in."""
    for shelf in fields(city.shelves):
        folder: Path | None = getattr(city.shelves, shelf.name)
        if folder is not None:
            yield next(found for found in (folder, *folder.absolute().parents) if found.exists())
