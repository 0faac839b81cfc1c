"""Recordings: what there is, any moment of one, its events, and files to take home."""

import asyncio
import sys
from collections.abc import AsyncIterator
from pathlib import Path as FilePath
from typing import Annotated

from fastapi import APIRouter, Path, Query, Request, Response
from fastapi.responses import StreamingResponse

from scm.api import replay
from scm.api.city import City, IdempotencyKey, json_response, not_found
from scm.api.city import Name as BusName
from scm.api.etag import Matching, tagged
from scm.api.inputs import Json
from scm.api.operations import Operations, ProgressReporter, accepted
from scm.api.paging import Cursor, Limit, page_of, page_of_names, page_response
from scm.api.problem import RefusedError
from scm.api.programs import run_scm
from scm.api.ranged import send_file
from scm.api.recorded_disturbances import disturbances_of
from scm.api.recording_repository import NAME, RecordingRepository, cars_of, natural, unreadable
from scm.api.roles import ENGINEER, OPERATOR, VIEWER
from scm.api.schemas import answer, answer_file, answer_nothing, answer_page
from scm.clock import NS_PER_S
from scm.errors import RecordingError
from scm.maps.draw import draw_svg
from scm.recorder.run_index import RunIndex
from scm.records.disturbances import RecordedDisturbances
from scm.records.operations import Operation
from scm.records.recordings import (
    CarCamera,
    CarFacts,
    Frames,
    Notes,
    NotesBody,
    PartBody,
    RecordedEvent,
    RecordingRow,
    Summary,
)
from scm.runtime.priority import stand_back

MCAP = "application/octet-stream"
MOST_S = 120.0
BLOCK = 256 * 1024
PICTURE_CACHING = "private, max-age=60"  # looped and stepped through without a new request
MOST_EXPORTS = 2  # programs at once; further ones wait for their turn

Name = Annotated[
    str,
    Path(
        pattern=NAME,
        description="a recording: its file without .mcap",
        examples=["city-20261123-031838-925408"],
    ),
]
Seconds = Annotated[
    float,
    Query(ge=0.0, le=1e7, description="seconds since the recording began", examples=[12.5]),
]
Vehicle = Annotated[
    str,
    Query(
        pattern=r"^[A-Za-z0-9_-]{0,32}$",
        description="a car's own reports; empty: all cars as the world saw them",
        examples=["n1"],
    ),
]


Camera = Annotated[str, Path(pattern=NAME, description="an overhead camera", examples=["overhead"])]
CameraOnCar = Annotated[
    str, Path(pattern=NAME, description="one of its cameras", examples=["front"])
]


def router(city: City, operations: Operations) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/recordings", tags=["recordings"], dependencies=[VIEWER])
    repository = RecordingRepository(city.folders.recordings)
    _add_downloads(routes, repository)
    _add_moments(routes, repository)
    _add_disturbances(routes, repository)
    _add_pictures(routes, repository, city)
    _add_notes(routes, repository)
    _add_parts(routes, repository, operations)

    @routes.get(
        "",
        summary="All recordings, the one written last first",
        responses=answer_page(RecordingRow),
    )
    def all_recordings(request: Request, limit: Limit = 100, cursor: Cursor = "") -> Response:
        page = page_of_names(repository.names(), repository.row, limit=limit, cursor=cursor)
        return page_response(request, page)

    @routes.get("/{name}", summary="One recording", responses=answer(RecordingRow))
    def one_recording(name: Name) -> Response:
        return json_response(repository.row(name))

    @routes.delete(
        "/{name}",
        summary="Delete a recording",
        status_code=204,
        dependencies=[ENGINEER],
        responses=answer_nothing(),
    )
    def remove(name: Name, key: IdempotencyKey = "") -> Response:
        del key  # what is gone stays gone
        repository.remove(name)
        return Response(status_code=204)

    return routes


def _add_downloads(routes: APIRouter, repository: RecordingRepository) -> None:
    """Add files to take home; before the routes whose names would match them too."""
    turns = asyncio.Semaphore(MOST_EXPORTS)

    @routes.get(
        "/{name}.mcap",
        summary="The file as the recorder wrote it, or a range of it",
        responses=answer_file(MCAP) | answer_file(MCAP, "The range of it.", 206),
        response_class=Response,
    )
    def file(request: Request, name: Name) -> Response:
        return send_file(request, repository.path(name), MCAP)

    @routes.get(
        "/{name}/foxglove.mcap",
        summary="The file for Foxglove",
        responses=answer_file(MCAP),
        response_class=Response,
    )
    async def foxglove(name: Name) -> Response:
        index = await asyncio.to_thread(repository.index, name)
        return StreamingResponse(
            _converted(index.path, turns), 200, _named(f"{name}.foxglove.mcap"), MCAP
        )

    @routes.get(
        "/{name}/csv",
        summary="Its cars as CSV",
        responses=answer_file("text/csv"),
        response_class=Response,
    )
    def as_csv(
        name: Name,
        vehicle: Vehicle = "",
        from_s: Seconds = 0.0,
        to_s: Annotated[
            float | None,
            Query(ge=0.0, le=1e7, description="to when; without: to the end", examples=[60.0]),
        ] = None,
    ) -> Response:
        index = repository.index(name)
        if to_s is not None and to_s < from_s:
            detail = f"to_s: got {to_s:g}, expected from_s ({from_s:g}) or later"
            raise RefusedError.of("invalid", detail)
        if vehicle and vehicle not in cars_of(index):
            raise not_found(f"car of {name}", vehicle)
        file = f"{name}{f'-{vehicle}' if vehicle else ''}{_span(from_s, to_s)}.csv"
        table = replay.csv_of(index, vehicle, from_s, to_s)
        if table is None:
            detail = f"{name}: {replay.no_rows(index, vehicle, from_s, to_s)}"
            raise RefusedError.of("not_found", detail)
        return StreamingResponse(table, 200, _named(file), "text/csv")


def _span(from_s: float, to_s: float | None) -> str:
    """Return the part of a file's name that marks a span: `-10-20s`; empty for the whole."""
    if to_s is None:
        return f"-{from_s:g}s-end" if from_s else ""
    return f"-{from_s:g}-{to_s:g}s"


def _add_moments(routes: APIRouter, repository: RecordingRepository) -> None:
    """Add what a replay shows."""

    @routes.get(
        "/{name}/summary", summary="What a replay has to know first", responses=answer(Summary)
    )
    def summary(name: Name) -> Response:
        index = _readable(repository, name)
        city_map = replay.map_of(index)
        return json_response(
            Summary(
                recording=repository.row(name),
                cars=_cars(index),
                map_title=city_map.title if city_map else "",
                lights=city_map.lights if city_map else (),
                boxes=city_map.boxes if city_map else (),
                first_frame_s=replay.first_frame_s(index),
                eye_cameras=replay.eye_cameras(index),
                car_cameras=_car_cameras(index),
            )
        )

    @routes.get(
        "/{name}/frames",
        summary="Where everything was, from a time to another",
        responses=answer(Frames),
    )
    def frames(
        name: Name,
        from_s: Seconds = 0.0,
        to_s: Seconds = 10.0,
        hz: Annotated[
            float, Query(gt=0.0, le=50.0, description="frames a second, at most", examples=[10.0])
        ] = 10.0,
    ) -> Response:
        if not from_s <= to_s <= from_s + MOST_S:
            detail = f"to_s: got {to_s:g}, expected from_s ({from_s:g}) to {MOST_S:g} s after it"
            raise RefusedError.of("invalid", detail)
        return json_response(replay.frames_of(_readable(repository, name), from_s, to_s, hz))

    @routes.get(
        "/{name}/events",
        summary="Its events, in their order",
        responses=answer_page(RecordedEvent),
    )
    def events(request: Request, name: Name, limit: Limit = 500, cursor: Cursor = "") -> Response:
        rows = replay.events_of(_readable(repository, name))
        page = page_of(rows, lambda row: str(row.number), limit=limit, cursor=cursor)
        return page_response(request, page)


def _add_disturbances(routes: APIRouter, repository: RecordingRepository) -> None:
    @routes.get(
        "/{name}/disturbances",
        summary="What made measurements void while it was recorded",
        responses=answer(RecordedDisturbances),
    )
    def disturbances(name: Name) -> Response:
        return json_response(disturbances_of(_readable(repository, name)))


def _add_pictures(routes: APIRouter, repository: RecordingRepository, city: City) -> None:
    @routes.get(
        "/{name}/eye/{camera}.jpg",
        summary="What an overhead camera saw, at a time",
        responses=answer_file("image/jpeg", "The newest picture then; `X-Time-Ns`: its exposure."),
        response_class=Response,
    )
    def picture(name: Name, camera: Camera, t_s: Seconds = 0.0) -> Response:
        return _picture(name, _readable(repository, name), camera, t_s)

    @routes.get(
        "/{name}/vehicles/{vehicle}/camera/{camera}.jpg",
        summary="What a car's own camera saw, at a time",
        responses=answer_file("image/jpeg", "The newest picture then; `X-Time-Ns`: its exposure."),
        response_class=Response,
    )
    def car_picture(
        name: Name, vehicle: BusName, camera: CameraOnCar, t_s: Seconds = 0.0
    ) -> Response:
        return _picture(name, _readable(repository, name), camera, t_s, vehicle)

    @routes.get(
        "/{name}/map.svg",
        summary="The map it was driven on",
        responses=answer_file("image/svg+xml"),
        response_class=Response,
    )
    def map_svg(name: Name) -> Response:
        city_map = replay.map_of(_readable(repository, name)) or city.city_map
        headers = {"Cache-Control": "no-cache"}
        return Response(draw_svg(city_map, movable=False), 200, headers, "image/svg+xml")


def _add_notes(routes: APIRouter, repository: RecordingRepository) -> None:
    @routes.get("/{name}/notes", summary="What people wrote about it", responses=answer(Notes))
    def notes(request: Request, name: Name) -> Response:
        return tagged(request, repository.notes(name))

    @routes.put(
        "/{name}/notes",
        summary="Name a recording and note something on it",
        dependencies=[OPERATOR],
        responses=answer(Notes),
    )
    def write(
        request: Request,
        name: Name,
        body: Json[NotesBody],
        condition: Matching,
        key: IdempotencyKey = "",
    ) -> Response:
        del key  # the same notes twice are the same notes
        fresh = Notes(title=body.title.strip(), notes=body.notes.strip())
        with repository.editing:
            condition.check(repository.notes(name))
            repository.write_notes(name, fresh)
        return tagged(request, fresh)


def _add_parts(routes: APIRouter, repository: RecordingRepository, operations: Operations) -> None:
    @routes.post(
        "/{name}/parts",
        summary="Copy a part of it into a recording of its own",
        status_code=202,
        dependencies=[OPERATOR],
        responses=answer(Operation, 202),
    )
    def cut(
        request: Request, name: Name, body: Json[PartBody], key: IdempotencyKey = ""
    ) -> Response:
        del key  # the same key gets the same operation
        index = _readable(repository, name)
        length_s = (index.end_ns - index.begin_ns) / NS_PER_S
        to_s = min(length_s if body.to_s is None else body.to_s, length_s)
        if not body.from_s < to_s:
            detail = f"from_s, to_s: got {body.from_s:g} to {to_s:g} s, expected a part of "
            detail += f"the {length_s:.1f} s of {name}"
            raise RefusedError.of("invalid", detail)

        def do(progress: ProgressReporter) -> str:
            target = repository.free_path(f"{name[:80]}{_span(body.from_s, to_s)}")
            partial = target.with_name(f".{target.name}")  # in no list until it is whole
            words = ["cut", str(index.path), "--out", str(partial)]
            words += ["--from-s", f"{body.from_s!r}", "--to-s", f"{to_s!r}"]
            try:
                progress("copies it")
                run_scm(words, progress, lambda _: None)
                partial.rename(target)
            finally:
                partial.unlink(missing_ok=True)
            return f"/recordings/{target.stem}"

        what = f"{body.from_s:g} to {to_s:g} s of {name}"
        owner = str(request.scope["scm_owner"])
        return accepted(operations.start("cut", what, do, owner=owner))


def _readable(repository: RecordingRepository, name: str) -> RunIndex:
    """Return a recording's index; refuse one that holds nothing yet."""
    index = repository.index(name)
    if not index.chunks:
        raise unreadable(RecordingError(f"{index.path}: nothing was recorded yet"))
    return index


def _picture(name: str, index: RunIndex, camera: str, t_s: float, vehicle: str = "") -> Response:
    """Return a picture that is in a recording, or raise that it has none."""
    found = replay.picture_at(index, camera, t_s, vehicle)
    if found is None:
        whose = f"{vehicle}'s camera" if vehicle else "camera"
        detail = f"{name}: {whose} {camera!r} has no picture of {t_s:g} s or before"
        raise RefusedError.of("not_found", detail)
    t_ns, jpeg = found
    headers = {"Cache-Control": PICTURE_CACHING, "X-Time-Ns": str(t_ns)}
    return Response(jpeg, 200, headers, "image/jpeg")


def _cars(index: RunIndex) -> tuple[CarFacts, ...]:
    return tuple(sorted(replay.cars_in(index), key=lambda car: natural(car.vehicle)))


def _car_cameras(index: RunIndex) -> tuple[CarCamera, ...]:
    found = replay.car_cameras(index)
    return tuple(sorted(found, key=lambda one: (natural(one.vehicle), one.camera)))


def _named(file: str) -> dict[str, str]:
    return {"Content-Disposition": f'attachment; filename="{file}"', "Cache-Control": "no-store"}


async def _converted(path: FilePath, turns: asyncio.Semaphore) -> AsyncIterator[bytes]:
    """Yield what `scm export foxglove` writes; it works beside the server, so that it stays quick.

    A reader who goes away ends it.
    """
    async with turns:
        command = (sys.executable, "-m", "scm", "export", "foxglove", str(path))
        process = await asyncio.create_subprocess_exec(*command, stdout=asyncio.subprocess.PIPE)
        stand_back(process.pid)
        assert process.stdout is not None  # noqa: S101  it was requested
        try:
            while block := await process.stdout.read(BLOCK):
                yield block
            if await process.wait():
                msg = f"{path}: the export for Foxglove failed; the server's log has the reason"
                raise RecordingError(msg)  # the answer breaks off: a cut file must not look whole
        finally:
            if process.returncode is None:
                process.kill()
                await process.wait()
