"""Mismatch searches as operations: source, folder, progress; and drives that decide more.

Each search is `scm mismatch`, each drive `scm play`: programs of their own that can be called off.
"""

import re
import shutil
import threading
from collections.abc import Sequence
from pathlib import Path

import msgspec

from scm.api import uploads
from scm.api.city import City, not_found
from scm.api.operations import Operations, ProgressReporter
from scm.api.problem import RefusedError
from scm.api.programs import run_scm
from scm.api.report_folders import PARTIAL, ReportFolders
from scm.api.trip_resume import RESUME_NS, RESUME_PAUSE_S, onward, trip_of
from scm.clock import Clock
from scm.errors import RecordingError, RunError
from scm.recorder.run_index import read_index
from scm.records.mismatch import Job
from scm.records.operations import Operation
from scm.v2x.messages.route_request import RouteReply
from scm.v2x.messages.trip import Trip

KIND, DRIVE_KIND = "mismatch", "drive"
_RUN = ".mcap"
_STEP = re.compile(r" *\d+ s +(?P<share>\d+) %  (?P<said>.+)")


class MismatchJobs:
    """Starts searches and drives.

    Args:
        city: Whose folders are read and written.
        work: What runs it.
        clock: For dates.
        bus: Arguments that give a program the bus's address and its identity; empty: no
            bus can be reached, and nothing can be driven.
    """

    def __init__(self, city: City, work: Operations, clock: Clock, bus: Sequence[str]) -> None:
        self._city, self._work, self._clock, self._bus = city, work, clock, bus
        self.reports = ReportFolders(city.folders.reports)
        for left in (city.folders.reports or Path("/nowhere")).glob(f".*{PARTIAL}"):
            shutil.rmtree(left, ignore_errors=True)  # of a server that was killed

    def folder(self) -> Path:
        """Return the folder of reports.

        Raises:
            RefusedError: when this city has none.
        """
        if self._city.folders.reports is None:
            detail = "this city keeps no reports: start `scm api` with --data FOLDER"
            raise RefusedError.of("not_kept", detail)
        self._city.folders.reports.mkdir(parents=True, exist_ok=True)
        return self._city.folders.reports

    def recording(self, name: str) -> Path:
        """Return a recording of the city's folder, by its name with or without `.mcap`.

        Raises:
            RefusedError: when there is none of that name.
        """
        folder = self._city.folders.recordings
        if folder is not None and re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]{0,127}", name):
            for path in (folder / name, folder / f"{name}.mcap"):
                is_run = path.suffix == _RUN and path.is_file()
                if is_run or (path / "recording.yaml").is_file():
                    return path
        raise not_found("recording", name)

    def upload(self, upload: str) -> Path:
        """Return what was sent as a recording.

        Raises:
            RefusedError: when there is none of that id, or no longer.
        """
        folder = self.folder() / uploads.FOLDER / upload
        if not re.fullmatch(uploads.ID, upload) or not folder.is_dir():
            raise not_found("upload", upload)
        return uploads.recording_in(folder)

    def again(self, report: str) -> Job:
        """Return the job that a report was made by, with the drives recorded since to decide more.

        Of a report on one of several cars it is that car alone: only it was driven.

        Raises:
            RefusedError: when that cannot be known.
        """
        folder = self.reports.find(report)
        if folder is None:
            raise not_found("report", report)
        job = self.reports.job(folder)
        if job is None:
            detail = f"{report}: its source is unknown; start from the recording"
            raise RefusedError.of("conflict", detail)
        before = (*job.recordings, *job.told)
        gone = next((path for path in map(Path, before) if not path.exists()), None)
        if gone is not None:
            detail = f"{report}: the recording it was made from is gone: {gone.name}"
            raise RefusedError.of("conflict", detail)
        driven = tuple(map(str, self.reports.recorded_drives(folder)))
        _, _, car = report.partition(".")
        return msgspec.structs.replace(
            job,
            told=(*job.told, *driven),
            vehicle=job.vehicle or car,
            source=f"{job.source}, again with {len(driven)} more",
        )

    def search(self, job: Job) -> Operation:
        """Start a search."""
        folder = self.folder()
        job = msgspec.structs.replace(job, asked_ns=self._clock.now_ns())
        base = _slug(f"{_stem(Path(job.recordings[0]))}-{job.vehicle}".strip("-"))

        def work(progress: ProgressReporter) -> str:
            partial, whole = (
                folder / f".{base}-{job.asked_ns}{end}{PARTIAL}" for end in ("", "-run")
            )
            try:
                runs = [_whole(Path(path), whole, progress) for path in job.recordings]
                run_scm(_words(runs, job, partial), progress, lambda line: _on_line(line, progress))
                (partial / "job.json").write_bytes(msgspec.json.encode(job))
                return f"/mismatch/{_placed(partial, folder, base)}"
            finally:
                shutil.rmtree(partial, ignore_errors=True)
                shutil.rmtree(whole, ignore_errors=True)

        return self._work.start(KIND, job.source, work, owner=job.owner)

    def drive(self, report: str, drive: str, vehicle: str, part: int, owner: str) -> Operation:
        """Start a part of a suggested drive with a car; its recording is put into the report.

        Raises:
            RefusedError: when there is no such drive or part, or no bus to send it over.
        """
        folder = self.reports.find(report)
        if folder is None or drive not in self.reports.drives(folder):
            raise not_found("drive", f"{report}/{drive}")
        if not self._bus:
            raise RefusedError.of("offline", "this server reaches no city to drive in")
        plans = sorted((folder / drive).glob("*.yaml"))
        if part > len(plans):
            raise RefusedError.of("invalid", f"part: got {part}, expected 1 to {len(plans)}")

        def work(progress: ProgressReporter) -> str:
            progress(f"{vehicle} comes to rest and drives")
            trip = trip_of(self._city.view, vehicle)
            try:
                self._play(plans[part - 1], vehicle, folder, progress)
            finally:
                if trip is not None:
                    self._send_on(trip)
            return f"/mismatch/{report}"

        return self._work.start(DRIVE_KIND, f"{drive} of {report} by {vehicle}", work, owner=owner)

    def _send_on(self, trip: Trip) -> None:
        """Send a car on to its destination; a failure shows on the car's own page."""
        request = onward(self._city.view, trip)
        until_ns = self._clock.now_ns() + RESUME_NS
        while True:
            try:
                self._city.call(request, RouteReply)
            except RefusedError as refusal:
                if refusal.refused.code == "owned" and self._clock.now_ns() < until_ns:
                    threading.Event().wait(RESUME_PAUSE_S)
                    continue
            return

    def _play(self, plan: Path, vehicle: str, folder: Path, progress: ProgressReporter) -> None:
        """Play a drive and keep its recording; one that ended early, or was called off, is none."""
        known = self.reports.recorded_drives(folder)
        number = 1 + max((int(one.name.removeprefix("told_")) for one in known), default=0)
        out, floor = folder / f"told_{number}", self._city.city_map.floor
        words = ["play", str(plan), *self._bus, "--vehicle", vehicle, "--out", str(out)]
        words += ["--floor", *(f"{edge:g}" for edge in (*floor.x_m, *floor.y_m))]
        whole = False
        try:
            lines = run_scm(words, progress, lambda _: None, kinder=False)
            early = next((line for line in lines if line.startswith("stopped")), "")
            whole = not early
        finally:
            if not whole:
                shutil.rmtree(out, ignore_errors=True)
        if early:
            raise RunError(early)


def _whole(recording: Path, folder: Path, progress: ProgressReporter) -> Path:
    """Return a recording to be searched: of a run without its end a copy of what is there of it.

    A run has none while it is being written, or where its writer was killed.

    Raises:
        RunError: when nothing is there yet.
    """
    if recording.suffix != _RUN or not _has_no_end(recording):
        return recording
    progress("takes what is recorded so far")
    folder.mkdir(exist_ok=True)
    run_scm(
        ["recover", str(recording), "--out", str(folder / recording.name)], progress, lambda _: None
    )
    return folder / recording.name


def _has_no_end(run: Path) -> bool:
    try:
        return not read_index(run).whole
    except RecordingError:
        return False  # it is no run at all: the search reports it


def _words(runs: Sequence[Path], job: Job, out: Path) -> list[str]:
    words = ["mismatch", *map(str, runs), "--out", str(out), "--budget-s", f"{job.budget_s:g}"]
    words += ["--told", *job.told] if job.told else []
    for option, value in (
        ("--vehicle", job.vehicle), ("--car", job.car), ("--from-s", job.from_s),
        ("--to-s", job.to_s),
    ):  # fmt: skip
        words += [option, f"{value}"] if value not in ("", None) else []
    return words


def _on_line(line: str, progress: ProgressReporter) -> None:
    found = _STEP.fullmatch(line)
    if found is not None:
        progress(found["said"], int(found["share"]) / 100.0)


def _placed(partial: Path, folder: Path, base: str) -> str:
    """Move a finished report into its folder; return its name, or that of its first car."""
    number = 1
    while True:
        name = base if number == 1 else f"{base}-{number}"
        if not (folder / name).exists():
            break
        number += 1
    partial.rename(folder / name)
    if (folder / name / "report.json").is_file():
        return name
    cars = sorted(path.parent.name for path in (folder / name).glob("*/report.json"))
    return f"{name}.{cars[0]}" if cars else name


def _stem(recording: Path) -> str:
    return recording.stem if recording.suffix == _RUN else recording.name


def _slug(text: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-")[:56] or "report"
