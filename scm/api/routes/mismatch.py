"""Mismatch: searches for what the simulator left out, their reports, and further drives."""

import csv
from pathlib import Path as FilePath
from tempfile import TemporaryFile
from typing import Annotated

import msgspec
from fastapi import APIRouter, Path, Query, Request, Response
from fastapi.responses import FileResponse
from starlette.concurrency import run_in_threadpool

from scm.api import uploads
from scm.api.city import City, IdempotencyKey, json_response, not_found
from scm.api.folders import written_ns
from scm.api.inputs import Json
from scm.api.mismatch_jobs import MismatchJobs
from scm.api.operations import accepted
from scm.api.paging import Cursor, Limit, page_of, page_response
from scm.api.report_folders import FILES, NAME
from scm.api.roles import ENGINEER, OPERATOR, VIEWER
from scm.api.schemas import answer, answer_file, answer_nothing, answer_page
from scm.records.mismatch import (
    DrivePlan,
    DrivePlans,
    Job,
    JobBody,
    Offers,
    PlayBody,
    Report,
    ReportRow,
    Upload,
)
from scm.records.operations import Operation
from scm.vehicles.car_files import car_files

_ZIP = {"application/zip": {"schema": {"type": "string", "contentMediaType": "application/zip"}}}
Title = Annotated[str, Query(max_length=128, description="what to call it", examples=["my drive"])]
ReportName = Annotated[
    str, Path(pattern=NAME, description="a report's name", examples=["again-n1"])
]
DriveName = Annotated[
    str,
    Path(
        pattern=r"^next_drive(_\d{1,2})?$", description="a suggested drive", examples=["next_drive"]
    ),
]


def router(city: City, jobs: MismatchJobs) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/mismatch", tags=["mismatch"], dependencies=[VIEWER])
    _add_jobs(routes, city, jobs)
    _add_uploads(routes, jobs)
    _add_reports(routes, jobs)
    _add_drives(routes, jobs)
    return routes


def _add_jobs(routes: APIRouter, city: City, jobs: MismatchJobs) -> None:
    @routes.get("/offers", summary="What can be searched", responses=answer(Offers))
    def offers() -> Response:
        folder = city.folders.recordings
        runs = [path for path in folder.glob("*.mcap") if path.is_file()] if folder else []
        runs.sort(key=lambda path: -written_ns(path))
        answer_ = Offers(
            recordings=tuple(path.name for path in runs[:200]),
            cars=tuple(sorted(car_files())),
            most_upload_bytes=uploads.MOST_BYTES,
        )
        return json_response(answer_)

    @routes.post(
        "/jobs",
        summary="Search for what the simulator left out",
        status_code=202,
        dependencies=[OPERATOR],
        responses=answer(Operation, 202),
    )
    def search(request: Request, body: Json[JobBody], key: IdempotencyKey = "") -> Response:
        del key  # the same request twice is two searches with one answer: harmless
        return accepted(jobs.search(_job(jobs, body, str(request.scope.get("scm_owner", "")))))


def _add_uploads(routes: APIRouter, jobs: MismatchJobs) -> None:
    @routes.post(
        "/uploads",
        summary="Send a recording: a zip with recording.yaml, or of a run",
        status_code=201,
        dependencies=[OPERATOR],
        responses=answer(Upload, 201),
        openapi_extra={"requestBody": {"required": True, "content": _ZIP}},
    )
    async def upload(request: Request, name: Title = "", key: IdempotencyKey = "") -> Response:
        del key  # a second copy is a second upload; the oldest are forgotten
        folder, cars = jobs.folder(), tuple(sorted(car_files()))
        with TemporaryFile(dir=folder) as body:  # of no name: gone with this request
            async for chunk in request.stream():
                await run_in_threadpool(body.write, chunk)
            stored = await run_in_threadpool(uploads.store, folder, body, name, cars)
        return json_response(stored, 201)


def _add_reports(routes: APIRouter, jobs: MismatchJobs) -> None:
    @routes.get("/reports", summary="All reports, newest first", responses=answer_page(ReportRow))
    def reports(request: Request, limit: Limit = 100, cursor: Cursor = "") -> Response:
        rows = jobs.reports.rows()
        page = page_of(rows, lambda row: row.name, limit=limit, cursor=cursor)
        return page_response(request, page)

    @routes.get("/reports/{name}", summary="One report", responses=answer(Report))
    def report(name: ReportName) -> Response:
        folder = _folder(jobs, name)
        try:
            return json_response(_report(jobs, name, folder))
        except FileNotFoundError:  # somebody removes it at this moment
            raise not_found("report", name) from None

    @routes.delete(
        "/reports/{name}",
        summary="Remove a report",
        status_code=204,
        dependencies=[ENGINEER],
        responses=answer_nothing(),
    )
    def remove(name: ReportName, key: IdempotencyKey = "") -> Response:
        del key  # removed is removed
        if not jobs.reports.remove(name):
            raise not_found("report", name)
        return Response(status_code=204)

    @routes.get(
        "/reports/{name}/files/{file}",
        summary="Download a file of a report",
        response_class=Response,
        responses=answer_file("application/octet-stream"),
    )
    def download(
        name: ReportName,
        file: Annotated[
            str, Path(max_length=32, description="which file", examples=["report.json"])
        ],
    ) -> Response:
        path = _folder(jobs, name) / file
        if file not in FILES or not path.is_file():
            raise not_found("file of this report", file)
        return FileResponse(
            path,
            media_type=FILES[file],
            filename=f"{name}-{file}",
            headers={"Cache-Control": "no-cache"},
        )


def _add_drives(routes: APIRouter, jobs: MismatchJobs) -> None:
    @routes.get(
        "/reports/{name}/drives/{drive}",
        summary="A suggested drive",
        responses=answer(DrivePlans),
    )
    def plans(name: ReportName, drive: DriveName) -> Response:
        folder = _folder(jobs, name)
        if drive not in jobs.reports.drives(folder):
            raise not_found("drive", drive)
        found = sorted((folder / drive).glob("*.yaml"))
        return json_response(DrivePlans(parts=tuple(map(_plan, found))))

    @routes.post(
        "/reports/{name}/drives/{drive}/play",
        summary="Let a car of the city play a drive of a report",
        status_code=202,
        dependencies=[OPERATOR],
        responses=answer(Operation, 202),
    )
    def play(
        request: Request, name: ReportName, drive: DriveName, body: Json[PlayBody],
        key: IdempotencyKey = "",
    ) -> Response:  # fmt: skip
        del key  # drives of one city run one at a time, and a car's lease has one owner
        owner = str(request.scope.get("scm_owner", ""))
        return accepted(jobs.drive(name, drive, body.vehicle, body.part, owner))


def _job(jobs: MismatchJobs, body: Json[JobBody], owner: str) -> Job:
    """Return the request; what a repeated search leaves out is as in the one before."""
    if body.again:
        before = jobs.again(body.again)
    else:
        path = jobs.recording(body.recording) if body.recording else jobs.upload(body.upload)
        before = Job(recordings=(str(path),), source=body.recording or body.upload)
    media = {
        name: getattr(body, name)
        for name in ("vehicle", "budget_s", "from_s", "to_s")
        if getattr(body, name) not in ("", None)
    }
    car = _known_car(body.car) or before.car
    return msgspec.structs.replace(before, car=car, owner=owner, **media)


def _folder(jobs: MismatchJobs, name: str) -> FilePath:
    folder = jobs.reports.find(name)
    if folder is None:
        raise not_found("report", name)
    return folder


def _report(jobs: MismatchJobs, name: str, folder: FilePath) -> Report:
    fields, drawn = jobs.reports.fields(folder)
    return Report(
        row=jobs.reports.row(name, folder),
        report=fields,
        drawn=drawn,
        job=_shown(jobs.reports.job(folder)),
        drives=tuple(jobs.reports.drives(folder)),
        told=len(jobs.reports.recorded_drives(folder)),
        files=tuple(file for file in FILES if (folder / file).is_file()),
        together=jobs.reports.together(folder),
    )


def _shown(job: Job | None) -> Job | None:
    """Return what may be published of a job: files by name, not where they lie on this machine."""
    if job is None:
        return None
    names, answer_ = (
        tuple(FilePath(path).name for path in paths) for paths in (job.recordings, job.told)
    )
    return msgspec.structs.replace(job, recordings=names, told=answer_)


def _known_car(name: str) -> str:
    if name and name not in car_files():
        raise not_found("car file", name)
    return name


def _plan(description: FilePath) -> DrivePlan:
    commands = _rows(description.with_suffix(".csv"))
    way = _rows(description.with_name(f"{description.stem}_way.csv"))
    return DrivePlan(
        commands=commands,
        way=tuple(row[1:] for row in way),
        lasts_s=commands[-1][0] if commands else 0.0,
    )


def _rows(path: FilePath) -> tuple[tuple[float, ...], ...]:
    """Return a table of ours without its head; empty: it is missing or damaged."""
    try:
        with path.open(encoding="utf-8", newline="") as file:
            return tuple(tuple(map(float, row)) for row in list(csv.reader(file))[1:])
    except (OSError, ValueError):
        return ()
