"""Calibrating overhead cameras: pictures of a board, lens and place, saved calibrations."""

from pathlib import Path as FilePath
from typing import Annotated, Any

import msgspec
from fastapi import APIRouter, Path, Request, Response
from starlette.concurrency import run_in_threadpool

from scm.api.calibration_jobs import CalibrationJobs, FloorTag
from scm.api.calibration_repository import CalibrationRepository
from scm.api.city import City, IdempotencyKey, Name, json_response, not_found
from scm.api.etag import Matching, tagged
from scm.api.eye_rows import frame_of
from scm.api.folders import written_ns
from scm.api.inputs import Json
from scm.api.operations import Operations, accepted
from scm.api.paging import Cursor, Limit, page_of, page_response
from scm.api.problem import RefusedError
from scm.api.roles import ENGINEER, VIEWER
from scm.api.schemas import answer, answer_file, answer_page
from scm.records.eye_calibrations import (
    NAME,
    CalibrationBody,
    CalibrationFile,
    CalibrationRow,
    LensBody,
    PlaceBody,
    View,
    Views,
)
from scm.records.operations import Operation

_MEDIA = {".jpg": "image/jpeg", ".png": "image/png"}
_PICTURES = {
    media: {"schema": {"type": "string", "contentMediaType": media}} for media in _MEDIA.values()
}

CalibrationName = Annotated[
    str, Path(pattern=NAME, description="a calibration's name", examples=["overhead-place"])
]
ViewName = Annotated[
    str,
    Path(
        pattern=r"^[0-9]{4}\.(jpg|png)$",
        description="a picture's file name",
        examples=["0001.jpg"],
    ),
]


def router(city: City, operations: Operations) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/eye", tags=["eye"], dependencies=[VIEWER])
    folder = city.folders.calibrations
    jobs = (
        None
        if folder is None
        else CalibrationJobs(
            CalibrationRepository(folder), city.link.map_file or city.city_map.name
        )
    )

    def there() -> CalibrationJobs:
        if jobs is None:
            detail = "this city keeps no calibrations: start its interface with --data FOLDER"
            raise RefusedError.of("not_found", detail)
        return jobs

    _add_views(routes, city, there)
    _add_measuring(routes, city, there, operations)
    _add_calibrations(routes, there)
    _add_files(routes, there)
    return routes


def _add_views(routes: APIRouter, city: City, there: Any) -> None:
    @routes.get(
        "/cameras/{name}/views",
        summary="Pictures of a board, and what was found in them",
        responses=answer(Views),
    )
    def views(name: Name) -> Response:
        return json_response(_views(there(), name))

    @routes.post(
        "/cameras/{name}/views",
        summary="Keep a picture of a board: one that is sent, or the camera's newest",
        status_code=201,
        dependencies=[ENGINEER],
        responses=answer(View, 201),
        openapi_extra={"requestBody": {"required": False, "content": _PICTURES}},
    )
    async def add_view(request: Request, name: Name, key: IdempotencyKey = "") -> Response:
        del key  # the same key gets the same answer, and no second picture
        seen = await request.body() or _newest(city, name)
        path = await run_in_threadpool(there().add_view, name, seen)
        where = f"/api/v1/eye/cameras/{name}/views/{path.name}"
        return json_response(_view(path, {}), 201, {"Location": where})

    @routes.delete(
        "/cameras/{name}/views",
        summary="Throw all pictures of a board away",
        dependencies=[ENGINEER],
        responses=answer(Views),
    )
    def delete_views(name: Name, key: IdempotencyKey = "") -> Response:
        del key  # once away they stay away
        there().delete_views(name)
        return json_response(_views(there(), name))

    @routes.get(
        "/cameras/{name}/views/{view}",
        summary="A picture of a board",
        response_class=Response,
        responses=answer_file("image/jpeg", "The picture, JPEG or PNG."),
    )
    def view(name: Name, view: ViewName) -> Response:
        path = there().view(name, view)
        return Response(path.read_bytes(), media_type=_MEDIA[path.suffix])

    @routes.delete(
        "/cameras/{name}/views/{view}",
        summary="Throw a picture of a board away",
        dependencies=[ENGINEER],
        responses=answer(Views),
    )
    def delete_view(name: Name, view: ViewName, key: IdempotencyKey = "") -> Response:
        del key  # once away it stays away
        there().view(name, view).unlink(missing_ok=True)
        return json_response(_views(there(), name))


def _add_measuring(routes: APIRouter, city: City, there: Any, operations: Operations) -> None:
    @routes.post(
        "/cameras/{name}/lens",
        summary="Look for a board in all pictures, or measure the lens by them",
        status_code=202,
        dependencies=[ENGINEER],
        responses=answer(Operation, 202),
    )
    def lens(
        request: Request, name: Name, body: Json[LensBody], key: IdempotencyKey = ""
    ) -> Response:
        del key  # the same key gets the same operation
        jobs = there()
        if not jobs.views(name):
            raise not_found("camera with pictures of a board", name)
        save_as = body.save_as or ""
        _check_free(jobs, save_as)
        what = f"lens of {name}" if save_as else f"board in pictures of {name}"
        job = jobs.measure_lens(name, _board_words(body), save_as)
        return accepted(operations.start("calibration", what, job, owner=_owner(request)))

    @routes.post(
        "/cameras/{name}/place",
        summary="Find where a camera hangs, by the tags on the floor that it sees now",
        status_code=202,
        dependencies=[ENGINEER],
        responses=answer(Operation, 202),
    )
    def place(
        request: Request, name: Name, body: Json[PlaceBody], key: IdempotencyKey = ""
    ) -> Response:
        del key  # the same key gets the same operation
        jobs = there()
        if all(camera.name != name for camera in city.city_map.cameras):
            raise not_found("camera on the map", name)
        _check_free(jobs, body.save_as)
        if body.lens and jobs.repository.get(body.lens).row.kind != "lens":
            detail = f"lens: expected a lens, got {body.lens!r}, which is a place"
            raise RefusedError.of("invalid", detail)
        tags = _floor_tags(body)
        job = jobs.locate(name, _newest(city, name), body.lens or "", tags, body.save_as)
        return accepted(
            operations.start("calibration", f"place of {name}", job, owner=_owner(request))
        )


def _add_calibrations(routes: APIRouter, there: Any) -> None:
    @routes.get(
        "/calibrations",
        summary="All saved calibrations, newest first",
        responses=answer_page(CalibrationRow),
    )
    def calibrations(request: Request, limit: Limit = 100, cursor: Cursor = "") -> Response:
        page = page_of(there().repository.rows(), lambda row: row.name, limit=limit, cursor=cursor)
        return page_response(request, page)

    @routes.get("/calibrations/{name}", summary="One", responses=answer(CalibrationFile))
    def calibration(request: Request, name: CalibrationName) -> Response:
        return tagged(request, there().repository.get(name))

    @routes.put(
        "/calibrations/{name}",
        summary="Save a calibration, or replace its text",
        dependencies=[ENGINEER],
        responses={**answer(CalibrationFile), **answer(CalibrationFile, 201, "A new one.")},
    )
    def write(
        request: Request,
        name: CalibrationName,
        body: Json[CalibrationBody],
        condition: Matching,
        key: IdempotencyKey = "",
    ) -> Response:
        del key  # the state that the writer saw is required
        repository = there().repository
        with repository.editing:
            before = repository.find(name)
            condition.check(before)
            written = repository.write(name, body.toml)
        return tagged(request, written, 201 if before is None else 200)

    @routes.delete(
        "/calibrations/{name}",
        summary="Delete a calibration",
        dependencies=[ENGINEER],
        responses=answer(CalibrationFile),
    )
    def delete(name: CalibrationName, condition: Matching, key: IdempotencyKey = "") -> Response:
        del key  # the state that the writer saw is required
        repository = there().repository
        with repository.editing:
            found = repository.get(name)
            condition.check(found)
            repository.delete(name)
        return json_response(found)


def _add_files(routes: APIRouter, there: Any) -> None:
    @routes.get(
        "/calibrations/{name}/report",
        summary="How a calibration was found",
        responses=answer(dict[str, Any]),
    )
    def report(name: CalibrationName) -> Response:
        found = there().repository.report(name)
        if found is None:
            raise not_found("calibration with a report", name)
        return json_response(found)

    @routes.get(
        "/calibrations/{name}/file.toml",
        summary="Download a calibration",
        response_class=Response,
        responses=answer_file("application/toml", "The file, as the Eye's commands take it."),
    )
    def download(name: CalibrationName) -> Response:
        toml = there().repository.get(name).toml
        headers = {"Content-Disposition": f'attachment; filename="{name}.toml"'}
        return Response(toml, headers=headers, media_type="application/toml")


def _views(jobs: CalibrationJobs, camera: str) -> Views:
    findings = jobs.findings(camera) or {}
    by_name = {FilePath(one["name"]).name: one for one in findings.get("views", ())}
    rest = {key: value for key, value in findings.items() if key not in ("views", "said")}
    views = tuple(_view(path, by_name) for path in jobs.views(camera))
    return Views(views=views, findings=rest or None)


def _view(path: FilePath, found: dict[str, Any]) -> View:
    one = found.get(path.name)
    facts = None if one is None else {key: one[key] for key in one if key != "name"}
    return View(name=path.name, made_ns=written_ns(path), found=facts)


def _newest(city: City, camera: str) -> bytes:
    held = frame_of(city.view.picture(), camera)
    if held is None:
        raise not_found("camera with a picture", camera)
    return held.message.payload


def _check_free(jobs: CalibrationJobs, name: str) -> None:
    if name and jobs.repository.path(name).exists():
        detail = f"save_as: there is a calibration named {name!r}; choose another name"
        raise RefusedError.of("exists", detail)


def _board_words(body: LensBody) -> list[str]:
    words = ["--board", body.board, "--squares", f"{body.columns}x{body.rows}"]
    words += ["--square-m", str(body.square_m), "--dictionary", body.dictionary]
    words += ["--first-id", str(body.first_id)]
    words += ["--marker-m", str(body.marker_m)] if body.marker_m is not None else []
    return [*words, *(["--fisheye"] if body.fisheye else [])]


def _owner(request: Request) -> str:
    return str(request.scope.get("scm_owner", ""))


def _floor_tags(body: PlaceBody) -> tuple[FloorTag, ...]:
    try:
        return msgspec.convert(body.tags, tuple[FloorTag, ...], strict=False)
    except msgspec.ValidationError as error:
        raise RefusedError.of("invalid", f"tags: {error}") from error
