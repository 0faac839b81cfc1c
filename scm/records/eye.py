"""What an overhead camera sees, how it is calibrated, and how far it is from the truth."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from scm.records.city_map import Camera
from scm.records.fields import (
    XM,
    YM,
    AgeS,
    CameraName,
    HeightPx,
    LatencyMs,
    ReasonText,
    RequestedBy,
    SpeedMps,
    TagId,
    TNs,
    VehicleName,
    WidthPx,
    WindowS,
    YawRad,
)

Pixel = tuple[float, float]


class TagSeen(msgspec.Struct, kw_only=True, frozen=True):
    """One tag: centre and corners in pixels of the raw frame, first pixel's centre at (0, 0).

    Attributes:
        corners_px: Lower left, lower right, upper right, upper left of the printed tag.
        margin: Decision margin of the detector.
        hamming: Bits of 36 that were read wrong and corrected; None: not reported.
    """

    tag_id: TagId
    centre_px: Annotated[
        Pixel,
        Meta(
            description="Middle of the tag in the raw picture: column, row [px].",
            examples=[[320.4, 240.1]],
        ),
    ]
    corners_px: tuple[Pixel, Pixel, Pixel, Pixel]
    margin: float
    hamming: int | None = None


class Calibrated(msgspec.Struct, kw_only=True, frozen=True):
    """Names of calibrations.

    Attributes:
        lens: Of the lens alone; empty: the one that the place was found with.
        place: Of the place and its lens; empty: as the camera was started, by the map file.
    """

    lens: Annotated[str, Meta(examples=["overhead-lens"])] = ""
    place: Annotated[str, Meta(examples=["overhead-place"])] = ""


class InForce(msgspec.Struct, kw_only=True, frozen=True):
    """By which calibration a camera sees.

    Attributes:
        now: What it sees by.
        since_ns: When that was put in force, on the Eye's clock; None: it was started so.
        by: Who did, and `reason` why.
        before: What can be put back; None: nothing.
    """

    now: Calibrated
    since_ns: int | None = None
    by: RequestedBy = ""
    reason: ReasonText = ""
    before: Calibrated | None = None


class Residual(msgspec.Struct, kw_only=True, frozen=True):
    """Measured minus true: distance on the floor, and yaw (+ = measured further left).

    Attributes:
        position_mm: Distance from the truth, on the floor [mm].
        x_mm, y_mm: Along map x and y [mm].
        yaw_deg: Measured further left than the truth [degree].
    """

    position_mm: float
    x_mm: float
    y_mm: float
    yaw_deg: float


class ResidualSample(msgspec.Struct, kw_only=True, frozen=True):
    """One pose against the truth of its instant.

    Attributes:
        t_ns: When the frame was exposed.
        x_m, y_m: Where the car was measured to be.
        x_mm, y_mm: Measured minus true, along map x and y [mm].
        yaw_deg: Likewise, + = measured further left [degree].
    """

    vehicle: VehicleName
    t_ns: TNs
    x_m: XM
    y_m: YM
    x_mm: float
    y_mm: float
    yaw_deg: float


class ResidualStats(msgspec.Struct, kw_only=True, frozen=True):
    """What samples have in common; all null where there is none.

    Attributes:
        samples: How many.
        mean_mm: Mean distance from the truth [mm].
        p95_mm: 95 of 100 lie nearer [mm].
        worst_mm: The farthest [mm].
        bias_x_mm, bias_y_mm: Mean of measured minus true along map x and y [mm].
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


class SeenRow(msgspec.Struct, kw_only=True, frozen=True):
    """One car as a camera sees it.

    Attributes:
        residual: What it differs from the truth by; null: no truth of that time.
    """

    vehicle: VehicleName
    tag_id: TagId
    x_m: XM
    y_m: YM
    yaw_rad: YawRad
    age_s: AgeS
    residual: Residual | None


class TagRow(msgspec.Struct, kw_only=True, frozen=True):
    """One tag that a camera saw within the last minute.

    Attributes:
        what: `car`; `map`: it lies on the floor, known to the map; `other`: of no car.
        vehicle: The car that wears it; empty: none does.
        margin: Decision margin of the detector, higher is clearer.
        hamming: Bits of 36 that were read wrong and corrected; null: not reported.
        size_px: Mean side of its black square in the picture [px].
        seen_s: How long ago the camera saw it last [s].
        x_m, y_m, yaw_rad: Of the car, by this camera; of a map tag as its map has it; null: not
            known.
    """

    tag_id: TagId
    what: Literal["car", "map", "other"]
    vehicle: VehicleName
    margin: float
    hamming: int | None
    size_px: float
    seen_s: float
    x_m: XM | None
    y_m: YM | None
    yaw_rad: YawRad | None


class PoseRow(msgspec.Struct, kw_only=True, frozen=True):
    """One car's pose as one camera measured it last.

    Attributes:
        t_ns: When the frame was exposed.
        std_x_m, std_y_m, std_yaw_rad: Standard deviations, as the Eye reports them.
        map_tag_age_ms: Since the camera last saw the map's tag.
        flags: What is wrong with the camera, by its own account: do not trust it.
        residual: What it differs from the truth by; null: no truth of that time.
    """

    camera: CameraName
    vehicle: VehicleName
    tag_id: TagId
    t_ns: TNs
    x_m: XM
    y_m: YM
    yaw_rad: YawRad
    std_x_m: float
    std_y_m: float
    std_yaw_rad: float
    map_tag_age_ms: float
    age_s: AgeS
    flags: Annotated[tuple[str, ...], msgspec.Meta(examples=[["bumped"]])]
    residual: Residual | None


class CameraRow(msgspec.Struct, kw_only=True, frozen=True):
    """One camera.

    Attributes:
        frame_t_ns: Exposure of the newest frame, as text: it names the picture exactly, and is
            too long for a number in a browser. None: no frame yet.
        tags: Those of that frame, or of the newest detection when that frame was skipped.
        tags_t_ns: Exposure of the frame that they were found in, as text; None: none yet.
        known: Tags of the last minute, whose they are, and where.
        seen: What is seen.
        good: Whether its poses can be trusted, by its own report; None: not reported.
        complaints: What is wrong, in sentences.
        in_force: By which calibration it sees; null: not reported.
    """

    camera: CameraName
    frame_t_ns: Annotated[str, Meta(examples=["120000000000"])] | None
    width_px: WidthPx | None
    height_px: HeightPx | None
    age_s: AgeS | None
    latency_ms: LatencyMs | None
    tags: tuple[TagSeen, ...]
    tags_t_ns: Annotated[str | None, msgspec.Meta(examples=["120000000000"])]
    known: tuple[TagRow, ...]
    seen: tuple[SeenRow, ...]
    good: bool | None
    complaints: Annotated[tuple[str, ...], Meta(examples=[["the map tag was not seen for 3 s"]])]
    in_force: InForce | None


class TrackRow(msgspec.Struct, kw_only=True, frozen=True):
    """Where a car is by all overhead cameras together.

    Attributes:
        t_ns: The time that it holds for, on the Eye's clock.
        speed_mps: Along the car, + = forward.
        lateral_speed_mps: + = to the car's left.
        yaw_rate_radps: + = counter-clockwise.
        std_x_m, std_y_m, std_yaw_rad, std_speed_mps: Standard deviations.
        age_s: Since a camera last saw it.
        stale: Not seen for so long that it must not be used for driving.
        flags: What is wrong with it; empty: nothing.
        cameras: Those that saw it last.
    """

    vehicle: VehicleName
    tag_id: TagId
    t_ns: TNs
    x_m: XM
    y_m: YM
    yaw_rad: YawRad
    speed_mps: SpeedMps
    lateral_speed_mps: float
    yaw_rate_radps: float
    std_x_m: float
    std_y_m: float
    std_yaw_rad: float
    std_speed_mps: float
    age_s: AgeS
    stale: bool
    flags: Annotated[tuple[str, ...], msgspec.Meta(examples=[["roof_tag_size"]])]
    cameras: Annotated[tuple[str, ...], msgspec.Meta(examples=[["overhead"]])]


class Overhead(msgspec.Struct, kw_only=True, frozen=True):
    """The Eye's cameras, with what each sees.

    Attributes:
        cameras: Cameras.
    """

    cameras: tuple[CameraRow, ...]


class CameraState(msgspec.Struct, kw_only=True, frozen=True):
    """One camera.

    Attributes:
        state: As in the list.
        mounted: Its lens and where it hangs, by the map; null: the map does not know it.
    """

    state: CameraRow
    mounted: Camera | None


class TrackList(msgspec.Struct, kw_only=True, frozen=True):
    """The Eye's tracks, by name."""

    tracks: tuple[TrackRow, ...]


class VehicleResiduals(msgspec.Struct, kw_only=True, frozen=True):
    """What one car's poses were off by."""

    vehicle: VehicleName
    stats: ResidualStats


class Residuals(msgspec.Struct, kw_only=True, frozen=True):
    """What a camera's poses were off by, against the truth of a simulated city.

    Attributes:
        stats: Of all its cars together.
        vehicles: Of each car.
        samples: Poses with their residuals, two a second of each car, evenly thinned.
    """

    camera: CameraName
    window_s: WindowS
    stats: ResidualStats
    vehicles: tuple[VehicleResiduals, ...]
    samples: tuple[ResidualSample, ...]
