"""Mismatch: searches for what the simulator left out, their reports, and drives that tell more."""

import csv
from pathlib import Path as FilePath
from tempfile import TemporaryFile
from typing import Annotated, Any

import msgspec
from fastapi import APIRouter, Path, Query, Request, Response
from fastapi.responses import FileResponse
from pydantic import BaseModel, ConfigDict, Field, model_validator
from starlette.concurrency import run_in_threadpool

from scm.api import uploads
from scm.api.city import City, IdempotencyKey, json_response, not_found
from scm.api.mismatch_jobs import MismatchJobs
from scm.api.operations import Operation, accepted
from scm.api.paging import Cursor, Limit, page_of, page_response
from scm.api.report_folders import BUDGET_S, FILES, NAME, Job, ReportRow, Together
from scm.api.roles import ENGINEER, OPERATOR, VIEWER
from scm.api.schemas import answer, answer_file, answer_nothing, answer_page
from scm.vehicles.car_files import car_files

_CAR = r"^[a-z0-9_-]{0,32}$"
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


class JobBody(BaseModel):
    """A search: of a recording of the shelf, of an upload, or again with what was driven since."""

    model_config = ConfigDict(extra="forbid")

    recording: str = Field(
        "",
        max_length=128,
        description="name on the recordings shelf",
        examples=["city-120000.mcap"],
    )
    upload: str = Field(
        "", max_length=64, description="id of an upload, instead", examples=["drive-1f2e3d4c"]
    )
    again: str = Field(
        "", max_length=130, description="a report, instead: its recordings and drives since",
        examples=["again-n1"],
    )  # fmt: skip
    vehicle: str = Field(
        "", pattern=r"^[A-Za-z0-9_-]{0,64}$", description="which car of it; empty: all",
        examples=["n1"],
    )  # fmt: skip
    car: str = Field(
        "", pattern=_CAR, description="its car file's name; empty: what the recording says",
        examples=["nigel"],
    )  # fmt: skip
    budget_s: float | None = Field(
        None, ge=5.0, le=4 * BUDGET_S, examples=[120.0],
        description="what is not found in time to be told after it is not looked for [s]; "
        "null: 1800, of a search again as before",
    )  # fmt: skip
    from_s: float | None = Field(
        None,
        ge=0.0,
        description="leave out what is before, since its begin [s]",
        examples=[10.0],
    )
    to_s: float | None = Field(
        None, gt=0.0, description="leave out what is after [s]", examples=[100.0]
    )

    @model_validator(mode="after")
    def _is_of_one(self) -> "JobBody":
        given = [name for name in ("recording", "upload", "again") if getattr(self, name)]
        if len(given) != 1:
            msg = f"got {' and '.join(given) or 'nothing'}, expected recording, upload or again"
            raise ValueError(msg)
        if self.from_s is not None and self.to_s is not None and self.to_s <= self.from_s:
            msg = f"to_s: got {self.to_s:g}, expected more than from_s, {self.from_s:g}"
            raise ValueError(msg)
        return self


class PlayBody(BaseModel):
    """Who drives."""

    model_config = ConfigDict(extra="forbid")

    vehicle: str = Field(
        pattern=r"^[a-z0-9_-]{1,32}$", description="a car of the city", examples=["n1"]
    )
    part: int = Field(
        1, ge=1, le=99, description="of a drive in parts, between which the car is changed",
        examples=[1],
    )  # fmt: skip


class Offers(msgspec.Struct, kw_only=True, frozen=True):
    """What a search may be asked of.

    Attributes:
        recordings: Runs of the city on the shelf, newest first.
        cars: Names of car files.
        most_upload_bytes: The largest zip that is taken.
    """

    recordings: tuple[str, ...]
    cars: tuple[str, ...]
    most_upload_bytes: int


class Report(msgspec.Struct, kw_only=True, frozen=True):
    """One report.

    Attributes:
        row: As in the list.
        report: The fields of `report.json`, as docs/mismatch.md lists them; None: damaged.
        drawn: What its pictures draw and the words beside them; None of an older report.
        job: What it was made from; None: nobody noted it.
        drives: Names of the drives it suggests.
        told: How many of them were driven and recorded since.
        files: What can be downloaded.
        together: What its car has in common with others of the search; None: it was alone.
    """

    row: ReportRow
    report: dict[str, Any] | None
    drawn: dict[str, Any] | None
    job: Job | None
    drives: tuple[str, ...]
    told: int
    files: tuple[str, ...]
    together: Together | None


class DrivePlan(msgspec.Struct, kw_only=True, frozen=True):
    """One part of a suggested drive.

    Attributes:
        commands: Rows of time [s], throttle and steering, each held until the next.
        way: Where the likeliest explanation takes the car: rows of x [m], y [m], yaw [rad].
        lasts_s: How long it takes.
    """

    commands: tuple[tuple[float, ...], ...]
    way: tuple[tuple[float, ...], ...]
    lasts_s: float


class DrivePlans(msgspec.Struct, kw_only=True, frozen=True):
    """The parts of a suggested drive, in their order."""

    parts: tuple[DrivePlan, ...]


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
        shelf = city.shelves.recordings
        runs = [path for path in shelf.glob("*.mcap") if path.is_file()] if shelf else []
        runs.sort(key=lambda path: -path.stat().st_mtime_ns)
        told = Offers(
            recordings=tuple(path.name for path in runs[:200]),
            cars=tuple(sorted(car_files())),
            most_upload_bytes=uploads.MOST_BYTES,
        )
        return json_response(told)

    @routes.post(
        "/jobs",
        summary="Search for what the simulator left out",
        status_code=202,
        dependencies=[OPERATOR],
        responses=answer(Operation, 202),
    )
    def search(request: Request, body: JobBody, key: IdempotencyKey = "") -> Response:
        del key  # the same wish twice is two searches of one answer: harmless
        return accepted(jobs.search(_job(jobs, body, str(request.scope.get("scm_owner", "")))))


def _add_uploads(routes: APIRouter, jobs: MismatchJobs) -> None:
    @routes.post(
        "/uploads",
        summary="Send a recording: a zip with recording.yaml, or of a run",
        status_code=201,
        dependencies=[OPERATOR],
        responses=answer(uploads.Upload, 201),
        openapi_extra={"requestBody": {"required": True, "content": _ZIP}},
    )
    async def upload(request: Request, name: Title = "", key: IdempotencyKey = "") -> Response:
        del key  # a second copy is a second upload; the oldest are forgotten
        shelf, cars = jobs.shelf(), tuple(sorted(car_files()))
        with TemporaryFile(dir=shelf) as body:  # of no name: gone with this request
            async for chunk in request.stream():
                await run_in_threadpool(body.write, chunk)
            taken = await run_in_threadpool(uploads.take, shelf, body, name, cars)
        return json_response(taken, 201)


def _add_reports(routes: APIRouter, jobs: MismatchJobs) -> None:
    @routes.get("/reports", summary="All reports, newest first", responses=answer_page(ReportRow))
    def reports(request: Request, limit: Limit = 100, cursor: Cursor = "") -> Response:
        rows = jobs.reports.rows()
        page = page_of(rows, lambda row: row.name, limit=limit, cursor=cursor)
        return page_response(request, page)

    @routes.get("/reports/{name}", summary="One report", responses=answer(Report))
    def report(name: ReportName) -> Response:
        folder = _folder(jobs, name)
        fields, drawn = jobs.reports.fields(folder)
        told = Report(
            row=jobs.reports.row(name, folder),
            report=fields,
            drawn=drawn,
            job=_shown(jobs.reports.job(folder)),
            drives=tuple(jobs.reports.drives(folder)),
            told=len(jobs.reports.told(folder)),
            files=tuple(file for file in FILES if (folder / file).is_file()),
            together=jobs.reports.together(folder),
        )
        return json_response(told)

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
        request: Request, name: ReportName, drive: DriveName, body: PlayBody,
        key: IdempotencyKey = "",
    ) -> Response:  # fmt: skip
        del key  # drives of one city run one at a time, and a car's lease has one owner
        owner = str(request.scope.get("scm_owner", ""))
        return accepted(jobs.drive(name, drive, body.vehicle, body.part, owner))


def _job(jobs: MismatchJobs, body: JobBody, owner: str) -> Job:
    """Return what is asked for; what nobody says of a search again is as in the one before."""
    if body.again:
        before = jobs.again(body.again)
    else:
        path = jobs.recording(body.recording) if body.recording else jobs.upload(body.upload)
        before = Job(recordings=(str(path),), source=body.recording or body.upload)
    said = {
        name: getattr(body, name)
        for name in ("vehicle", "budget_s", "from_s", "to_s")
        if getattr(body, name) not in ("", None)
    }
    car = _known_car(body.car) or before.car
    return msgspec.structs.replace(before, car=car, owner=owner, **said)


def _folder(jobs: MismatchJobs, name: str) -> FilePath:
    folder = jobs.reports.find(name)
    if folder is None:
        raise not_found("report", name)
    return folder


def _shown(job: Job | None) -> Job | None:
    """Return what may be told of a job: files by name, not where they lie on this machine."""
    if job is None:
        return None
    names, told = (
        tuple(FilePath(path).name for path in paths) for paths in (job.recordings, job.told)
    )
    return msgspec.structs.replace(job, recordings=names, told=told)


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
