"""Health: is the server up, and can it do its work."""

import logging
import shutil
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path

from fastapi import APIRouter, Response

from scm.api.city import City, json_response
from scm.api.problem import problem
from scm.api.schemas import answer
from scm.clock import seconds
from scm.log import event
from scm.records.health import Alive, Check, Ready

READY_S = 2.0
LEAST_FREE_BYTES = 200 * 2**20
_log = logging.getLogger(__name__)

PREFIX = ""


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(tags=["health"])
    disk = _Disk(city)

    @routes.get("/healthz", summary="The server answers", responses=answer(Alive))
    async def healthz() -> Response:
        return json_response(Alive(status="ok"))

    @routes.get(
        "/readyz",
        summary="The router, the world, all parts and the disk are there",
        responses=answer(Ready),
    )
    def readyz() -> Response:
        checks = (_router(city), _world(city), _parts(city), disk.check())
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


def _parts(city: City) -> Check:
    """Look for parts that died, were given up, or never came."""
    here = {row.name for row in city.view.picture().stations if row.alive and row.role == "part"}
    missing = [name for name in city.link.parts if name not in here]
    if missing:
        detail = f"{', '.join(missing)} not there: the terminal of `scm up` has the reason"
        return Check(name="parts", good=False, detail=detail)
    detail = "all there" if city.link.parts else "it is not known which there should be"
    return Check(name="parts", good=True, detail=detail)


def _age_s(city: City) -> float | None:
    """Return how old the newest snapshot is, though the view's runner may hang."""
    picture = city.view.picture()
    if picture.snapshot is None:
        return None
    return seconds(city.now_ns() - picture.snapshot.arrived_ns)


class _Disk:
    """Free space for the folders. No role needed, so paths are only logged, once."""

    def __init__(self, city: City) -> None:
        self._city = city
        self._is_good = True

    def check(self) -> Check:
        """Check the folder with the least free space."""
        free = [
            (shutil.disk_usage(folder).free, kind, folder) for kind, folder in _folders(self._city)
        ]
        if not free:
            return Check(name="disk", good=True, detail="there are no folders")
        least, kind, folder = min(free, key=lambda found: found[0])
        was_good, self._is_good = self._is_good, least >= LEAST_FREE_BYTES
        if was_good and not self._is_good:
            mib = least // 2**20
            event(_log, "disk_short", level=logging.WARNING, shelf=kind, at=folder, free_mib=mib)
        detail = (
            f"where {kind} are stored {least // 2**20} MiB are free, "
            f"expected {LEAST_FREE_BYTES // 2**20} or more"
        )
        return Check(name="disk", good=self._is_good, detail=detail)


def _folders(city: City) -> Iterator[tuple[str, Path]]:
    """Yield the folders by kind, each with its path or the one it will be created in."""
    for kind in fields(city.folders):
        folder: Path | None = getattr(city.folders, kind.name)
        if folder is not None:
            parents = (folder, *folder.absolute().parents)
            yield kind.name, next(found for found in parents if found.exists())
