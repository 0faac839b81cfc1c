"""Records of eye.

Written by docs/make/client.py: do not change it here.
"""

from typing import Any, Literal

import msgspec

from scm.client.records.eye_parts import InForce


class TrackRow(msgspec.Struct, kw_only=True, frozen=True):
    """Where a car is by all overhead cameras together.

    Attributes:
        vehicle: Name of a car.
        tag_id: Number of an AprilTag.
        t_ns: The time that it holds for, on the Eye's clock.
        x_m: To the right on the map [m].
        y_m: Up on the map [m].
        yaw_rad: Direction, counter-clockwise from map x [rad].
        speed_mps: Along the car, + = forward.
        lateral_speed_mps: + = to the car's left.
        yaw_rate_radps: + = counter-clockwise.
        std_x_m: Standard deviations.
        std_y_m: Standard deviations.
        std_yaw_rad: Standard deviations.
        std_speed_mps: Standard deviations.
        age_s: Since a camera last saw it.
        stale: Not seen for so long that nobody should drive by it.
        flags: What is wrong with it; empty: nothing.
        cameras: Those that saw it last.
    """

    vehicle: str
    tag_id: int
    t_ns: int
    x_m: float
    y_m: float
    yaw_rad: float
    speed_mps: float
    lateral_speed_mps: float
    yaw_rate_radps: float
    std_x_m: float
    std_y_m: float
    std_yaw_rad: float
    std_speed_mps: float
    age_s: float
    stale: bool
    flags: tuple[str, ...]
    cameras: tuple[str, ...]


class TrackList(msgspec.Struct, kw_only=True, frozen=True):
    """The Eye's tracks, by name.

    Attributes:
        tracks: Where a car is by all overhead cameras together.
    """

    tracks: tuple[TrackRow, ...]


class ResidualStats(msgspec.Struct, kw_only=True, frozen=True):
    """What samples have in common; all null where there is none.

    Attributes:
        samples: How many.
        mean_mm: Mean distance from the truth [mm].
        p95_mm: 95 of 100 lie nearer [mm].
        worst_mm: The farthest [mm].
        bias_x_mm: Mean of measured minus true along map x and y [mm].
        bias_y_mm: Mean of measured minus true along map x and y [mm].
        bias_yaw_deg: Likewise of yaw, + = measured further left [degree].
        yaw_std_deg: Standard deviation of yaw around its bias [degree].
    """

    samples: int
    mean_mm: float | None
    p95_mm: float | None
    worst_mm: float | None
    bias_x_mm: float | None
    bias_y_mm: float | None
    bias_yaw_deg: float | None
    yaw_std_deg: float | None


class VehicleResiduals(msgspec.Struct, kw_only=True, frozen=True):
    """What one car's poses were off by.

    Attributes:
        vehicle: Name of a car.
        stats: What samples have in common; all null where there is none.
    """

    vehicle: str
    stats: ResidualStats


class ResidualSample(msgspec.Struct, kw_only=True, frozen=True):
    """One pose against the truth of its instant.

    Attributes:
        vehicle: Name of a car.
        t_ns: When the frame was exposed.
        x_m: Where the car was measured to be.
        y_m: Where the car was measured to be.
        x_mm: Measured minus true, along map x and y [mm].
        y_mm: Measured minus true, along map x and y [mm].
        yaw_deg: Likewise, + = measured further left [degree].
    """

    vehicle: str
    t_ns: int
    x_m: float
    y_m: float
    x_mm: float
    y_mm: float
    yaw_deg: float


class Residuals(msgspec.Struct, kw_only=True, frozen=True):
    """What a camera's poses were off by, against the truth of a simulated city.

    Attributes:
        camera: Name of a camera.
        window_s: Over how long it was counted [s].
        stats: Of all its cars together.
        vehicles: Of each car.
        samples: Poses with their residuals, two a second of each car, evenly thinned.
    """

    camera: str
    window_s: float
    stats: ResidualStats
    vehicles: tuple[VehicleResiduals, ...]
    samples: tuple[ResidualSample, ...]


class View(msgspec.Struct, kw_only=True, frozen=True):
    """One picture of a board.

    Attributes:
        name: Of its file.
        made_ns: When it came [ns since 1970].
        found: What was found in it last, as docs/dashboard/eye.md lists it; null: no board, or
            nobody looked.
    """

    name: str
    made_ns: int
    found: Any


class Views(msgspec.Struct, kw_only=True, frozen=True):
    """A camera's pictures of a board.

    Attributes:
        views: In the order they came.
        findings: Of all together, as docs/dashboard/eye.md lists them; null: nobody looked.
    """

    views: tuple[View, ...]
    findings: Any


class CalibrationRow(msgspec.Struct, kw_only=True, frozen=True):
    """One calibration.

    Attributes:
        name: What it is called.
        kind: `lens`: for `scm eye --calibration`; `place`: a `[[cameras]]` block for the map.
        camera: Whose place it is; empty: a lens does not say.
        made_ns: When its file was written [ns since 1970].
        width_px: Columns of the picture.
        height_px: Rows of the picture.
        rms_px: What was left at the board's points [px]; null: of a place.
        views: Pictures of the board it was made from; null: of a place.
        reported: Whether there is a report of how it was found.
    """

    name: str
    kind: Literal["lens", "place"]
    camera: str
    made_ns: int
    width_px: int
    height_px: int
    rms_px: float | None
    views: int | None
    reported: bool


class PageCalibrationRow(msgspec.Struct, kw_only=True, frozen=True):
    """Some rows of a list.

    Attributes:
        items: The rows of this page.
        next_: Cursor of those after them; null at the end.
    """

    items: tuple[CalibrationRow, ...]
    next_: str | None = msgspec.field(name="next")


class CalibrationFile(msgspec.Struct, kw_only=True, frozen=True):
    """One calibration with its text.

    Attributes:
        row: As in the list.
        toml: The file.
    """

    row: CalibrationRow
    toml: str


class CalibrationReply(msgspec.Struct, kw_only=True, frozen=True):
    """The wish was taken: what the camera sees by from its next frame on.

    Attributes:
        camera: Name of a camera.
        in_force: By which calibration a camera sees.
    """

    camera: str
    in_force: InForce
