"""Mismatch searches, their reports, and the drives they suggest."""

from typing import Annotated, Any

import msgspec
from msgspec import Meta

from scm.records.body import Body
from scm.records.fields import (
    CarName,
    CarNames,
    Name,
    OwnerName,
    RecordingNames,
    SourceName,
    VehicleName,
    VerdictText,
)

BUDGET_S = 1800.0  # as `scm mismatch` has it


class Job(msgspec.Struct, kw_only=True, frozen=True):
    """What a report was made from.

    Attributes:
        recordings: Of the repository, or uploads: paths below its folders.
        told: Drives that earlier reports suggested, recorded since: likewise.
        source: The same in words.
        vehicle: Which car of the recordings; empty: all.
        car: The car file's name; empty: the recording's own.
        budget_s: Time allowed for the search; what is not found in it is not looked for.
        from_s: Part of the recording, seconds since its begin; None: its start.
        to_s: None: its end.
        asked_ns: When.
        owner: Who requested it.
    """

    recordings: RecordingNames
    source: SourceName
    told: Annotated[tuple[str, ...], msgspec.Meta(examples=[["told_1"]])] = ()
    vehicle: VehicleName = ""
    car: CarName = ""
    budget_s: float = BUDGET_S
    from_s: float | None = None
    to_s: float | None = None
    asked_ns: int = 0
    owner: OwnerName = ""


class ReportRow(msgspec.Struct, kw_only=True, frozen=True):
    """A report in the list.

    Attributes:
        name: Below `/mismatch/reports`, and the page's address `/mismatch/NAME`.
        made_ns: When it was written, since 1970.
        verdict: `none`, `mismatch`, `undecided`, or `unreadable` where its files are damaged.
        said: The verdict in a sentence.
        effects: What was found, in words.
        vehicle: The car file's name.
        source: What it was made from, in words.
        before_m: Position error of free runs on unseen parts with the car as given; None: unknown.
        after_m: The same with what was found.
        runtime_s: Of the search.
        cut_short: Whether time ran out before everything was tried.
    """

    name: Name
    made_ns: int
    verdict: Annotated[str, Meta(examples=["mismatch"])]
    said: VerdictText
    effects: Annotated[tuple[str, ...], Meta(examples=[["tyre grip"]])] = ()
    vehicle: VehicleName = ""
    source: SourceName = ""
    before_m: float | None = None
    after_m: float | None = None
    runtime_s: float = 0.0
    cut_short: bool = False


class Together(msgspec.Struct, kw_only=True, frozen=True):
    """What the cars of one search have in common.

    Attributes:
        said: In a sentence.
        conclusions: A sentence or two on each effect that several may share.
        cars: Names of their reports, this one's among them.
    """

    said: VerdictText
    conclusions: Annotated[tuple[str, ...], Meta(examples=[["Both see it alike."]])]
    cars: CarNames


class Offers(msgspec.Struct, kw_only=True, frozen=True):
    """What a search can be run on.

    Attributes:
        recordings: Recorded runs of the city, newest first.
        cars: Names of car files.
        most_upload_bytes: The largest zip that is taken.
    """

    recordings: RecordingNames
    cars: CarNames
    most_upload_bytes: int


class Report(msgspec.Struct, kw_only=True, frozen=True):
    """One report.

    Attributes:
        row: As in the list.
        report: The fields of `report.json`, as docs/mismatch.md lists them; None: damaged.
        drawn: What its pictures draw and the words beside them; None of an older report.
        job: What it was made from; None: unknown.
        drives: Names of the drives it suggests.
        told: How many of them were driven and recorded since.
        files: What can be downloaded.
        together: What its car has in common with others of the search; None: it was alone.
    """

    row: ReportRow
    report: Annotated[dict[str, Any], Meta(examples=[{"verdict": "mismatch"}])] | None
    drawn: (
        Annotated[
            dict[str, Any], Meta(examples=[{"said": "The car grips less than its file says."}])
        ]
        | None
    )
    job: Job | None
    drives: Annotated[tuple[str, ...], Meta(examples=[["next_drive"]])]
    told: int
    files: Annotated[tuple[str, ...], Meta(examples=[["report.json"]])]
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


class Upload(msgspec.Struct, kw_only=True, frozen=True):
    """A recording that was sent.

    Attributes:
        upload: Its id, for a mismatch job; the newest twenty are stored.
        files: Of how many files it is.
        size_bytes: Unpacked.
        vehicles: Car files or cars that its description names; empty of a city's run.
    """

    upload: Annotated[str, Meta(examples=["drive-1f2e3d4c"])]
    files: int
    size_bytes: int
    vehicles: Annotated[tuple[str, ...], Meta(examples=[["n1"]])]


class JobBody(Body, kw_only=True, frozen=True):
    """A search: of a stored recording, of an upload, or again with what was driven since."""

    recording: Annotated[
        str,
        Meta(
            max_length=128,
            description="name of a stored recording",
            examples=["city-120000.mcap"],
        ),
    ] = ""
    upload: Annotated[
        str,
        Meta(max_length=64, description="id of an upload, instead", examples=["drive-1f2e3d4c"]),
    ] = ""
    again: Annotated[
        str,
        Meta(
            max_length=130,
            description="a report, instead: its recordings and drives since",
            examples=["again-n1"],
        ),
    ] = ""
    vehicle: Annotated[
        str,
        Meta(
            pattern="^[A-Za-z0-9_-]{0,64}$",
            description="which car of it; empty: all",
            examples=["n1"],
        ),
    ] = ""
    car: Annotated[
        str,
        Meta(
            pattern=r"^[a-z0-9_-]{0,32}$",
            description="its car file's name; empty: as in the recording",
            examples=["nigel"],
        ),
    ] = ""
    budget_s: (
        Annotated[
            float,
            Meta(
                ge=5.0,
                le=4 * BUDGET_S,
                description=(
                    "time allowed for the search; it reports what it found by then "
                    "[s]; null: 1800, of a search again as before"
                ),
                examples=[120.0],
            ),
        ]
        | None
    ) = None
    from_s: (
        Annotated[
            float,
            Meta(
                ge=0.0, description="leave out what is before, since its begin [s]", examples=[10.0]
            ),
        ]
        | None
    ) = None
    to_s: (
        Annotated[float, Meta(gt=0.0, description="leave out what is after [s]", examples=[100.0])]
        | None
    ) = None

    def __post_init__(self) -> None:
        """Refuse more than one source, and an end before the begin."""
        given = [name for name in ("recording", "upload", "again") if getattr(self, name)]
        if len(given) != 1:
            msg = f"got {' and '.join(given) or 'nothing'}, expected recording, upload or again"
            raise ValueError(msg)
        if self.from_s is not None and self.to_s is not None and self.to_s <= self.from_s:
            msg = f"to_s: got {self.to_s:g}, expected more than from_s, {self.from_s:g}"
            raise ValueError(msg)


class PlayBody(Body, kw_only=True, frozen=True):
    """Who drives."""

    vehicle: Annotated[
        str, Meta(pattern="^[a-z0-9_-]{1,32}$", description="a car of the city", examples=["n1"])
    ]
    part: Annotated[
        int,
        Meta(
            ge=1,
            le=99,
            description="of a drive in parts, between which the car is changed",
            examples=[1],
        ),
    ] = 1
