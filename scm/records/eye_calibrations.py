"""Calibrations of overhead cameras, and the pictures they are made from."""

from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from scm.records.body import Body, By
from scm.records.fields import CameraName, HeightPx, Name, WidthPx

NAME = r"^[a-z0-9_-]{1,48}$"
LARGEST_TOML = 64 * 1024
SaveAs = Annotated[
    str,
    Meta(
        pattern=NAME,
        description=("what the result is called, with a number where it is taken by then"),
        examples=["overhead-2025"],
    ),
]


class CalibrationRow(msgspec.Struct, kw_only=True, frozen=True):
    """One calibration.

    Attributes:
        kind: `lens`: for `scm eye --calibration`; `place`: a `[[cameras]]` block for the map.
        camera: Whose place it is; empty: it is a lens alone.
        made_ns: When its file was written [ns since 1970].
        rms_px: What was left at the board's points [px]; null: of a place.
        views: Pictures of the board it was made from; null: of a place.
        reported: Whether there is a report of how it was found.
    """

    name: Name
    kind: Literal["lens", "place"]
    camera: CameraName
    made_ns: int
    width_px: WidthPx
    height_px: HeightPx
    rms_px: float | None
    views: int | None
    reported: bool


class CalibrationFile(msgspec.Struct, kw_only=True, frozen=True):
    """One calibration with its text.

    Attributes:
        row: As in the list.
        toml: The file.
    """

    row: CalibrationRow
    toml: Annotated[str, msgspec.Meta(examples=['[[cameras]]\nname = "overhead"\nx_m = 1.384\n'])]


class View(msgspec.Struct, kw_only=True, frozen=True):
    """One picture of a board.

    Attributes:
        name: Of its file.
        made_ns: When it came [ns since 1970].
        found: What was found in it last, as docs/dashboard/eye.md lists it; null: no board, or
            not searched.
    """

    name: Name
    made_ns: int
    found: Annotated[Any, msgspec.Meta(examples=[{"points": 40, "sharpness": 3.1}])]


class Views(msgspec.Struct, kw_only=True, frozen=True):
    """A camera's pictures of a board.

    Attributes:
        views: In the order they came.
        findings: Of all together, as docs/dashboard/eye.md lists them; null: not searched.
    """

    views: tuple[View, ...]
    findings: Annotated[Any, msgspec.Meta(examples=[{"size_px": [1280, 720], "refused": []}])]


class LensBody(Body, kw_only=True, frozen=True):
    """What was printed, and whether the lens is to be measured or the board only found."""

    board: Annotated[
        Literal["chessboard", "charuco", "tags"],
        Meta(description="what was printed", examples=["chessboard"]),
    ] = "chessboard"
    columns: Annotated[int, Meta(ge=2, le=60, description="squares, or tags, across", examples=[9])]
    rows: Annotated[int, Meta(ge=2, le=60, description="squares, or tags, down", examples=[6])]
    square_m: Annotated[
        float,
        Meta(
            gt=0.0,
            le=2.0,
            description="edge of a square; of tags middle to middle",
            examples=[0.03],
        ),
    ]
    marker_m: (
        Annotated[
            float,
            Meta(gt=0.0, le=2.0, description="black edge of a marker or tag", examples=[0.022]),
        ]
        | None
    ) = None
    dictionary: Annotated[
        str,
        Meta(
            pattern="^DICT_[A-Za-z0-9_]{1,40}$",
            description="markers of a ChArUco board",
            examples=["DICT_4X4_50"],
        ),
    ] = "DICT_4X4_50"
    first_id: Annotated[
        int, Meta(ge=0, le=586, description="of the tag at the lower left", examples=[0])
    ] = 0
    fisheye: Annotated[
        bool, Meta(description="a lens of more than about 100 degrees", examples=[False])
    ] = False
    save_as: Annotated[
        SaveAs | None,
        Meta(
            description="what the lens is called, as with a place; null: only look",
            examples=["overhead-lens"],
        ),
    ] = None


class PlaceBody(Body, kw_only=True, frozen=True):
    """From what the camera's place is to be found, and what the result is called."""

    lens: Annotated[
        SaveAs | None,
        Meta(description="a stored lens; null: the map's", examples=["overhead-lens"]),
    ] = None
    tags: Annotated[
        tuple[dict[str, float], ...],
        Meta(
            max_length=40,
            description=(
                "tags on the floor beside the map's: id, x_m, y_m, yaw_rad, size_m of each"
            ),
            examples=[[{"id": 100, "x_m": 0.2, "y_m": 0.08, "yaw_rad": 0.0, "size_m": 0.12}]],
        ),
    ] = ()
    save_as: SaveAs


class CalibrationBody(Body, kw_only=True, frozen=True):
    """A calibration's text."""

    toml: Annotated[
        str,
        Meta(
            min_length=1,
            max_length=LARGEST_TOML,
            description="a lens of `scm eye calibrate`, or one [[cameras]] block",
            examples=['[[cameras]]\nname = "overhead"\nx_m = 1.384\n'],
        ),
    ]


class BackBody(Body, kw_only=True, frozen=True):
    """Who wants what was in force before, and why: both end up in the log."""

    by: By = ""
    reason: Annotated[
        str,
        Meta(min_length=1, max_length=200, description="why", examples=["the camera was moved"]),
    ]


class InForceBody(BackBody, kw_only=True, frozen=True):
    """Which calibration is to be in force, who wants it, and why."""

    calibration: Annotated[
        str,
        Meta(pattern=NAME, description="a stored calibration", examples=["overhead-place"]),
    ]
    accept_unsure: Annotated[
        bool,
        Meta(
            description=(
                "whether it is meant although the Eye would flag its poses as unsure "
                "and guarded cars would stop; without it such a calibration is a 409 "
                "of code `unsure`"
            ),
            examples=[False],
        ),
    ] = False
