"""Records of eye_parts.

Written by docs/make/client.py: do not change it here.
"""

from typing import Literal

import msgspec

from scm.client.records.shared import Camera, Residual


class TagSeen(msgspec.Struct, kw_only=True, frozen=True):
    """One tag: centre and corners in pixels of the raw frame, first pixel's centre at (0, 0).

    Attributes:
        tag_id: Number of an AprilTag.
        centre_px: Middle of the tag in the raw picture: column, row [px].
        corners_px: Lower left, lower right, upper right, upper left of the printed tag.
        margin: Decision margin of the detector.
        hamming: Bits of 36 that were read wrong and corrected; None: not told.
    """

    tag_id: int
    centre_px: tuple[float, float]
    corners_px: tuple[
        tuple[float, float], tuple[float, float], tuple[float, float], tuple[float, float]
    ]
    margin: float
    hamming: int | None = None


class TagRow(msgspec.Struct, kw_only=True, frozen=True):
    """One tag that a camera saw within the last minute.

    Attributes:
        tag_id: Number of an AprilTag.
        what: `car`; `map`: it lies on the floor, known to the map; `other`: nobody's.
        vehicle: The car that wears it; empty: none does.
        margin: Decision margin of the detector, higher is clearer.
        hamming: Bits of 36 that were read wrong and corrected; null: not told.
        size_px: Mean side of its black square in the picture [px].
        seen_s: How long ago the camera saw it last [s].
        x_m: Of the car, by this camera; of a map tag as its map has it; null: not known.
        y_m: Of the car, by this camera; of a map tag as its map has it; null: not known.
        yaw_rad: Of the car, by this camera; of a map tag as its map has it; null: not known.
    """

    tag_id: int
    what: Literal["car", "map", "other"]
    vehicle: str
    margin: float
    hamming: int | None
    size_px: float
    seen_s: float
    x_m: float | None
    y_m: float | None
    yaw_rad: float | None


class SeenRow(msgspec.Struct, kw_only=True, frozen=True):
    """One car as a camera sees it.

    Attributes:
        vehicle: Name of a car.
        tag_id: Number of an AprilTag.
        x_m: To the right on the map [m].
        y_m: Up on the map [m].
        yaw_rad: Direction, counter-clockwise from map x [rad].
        age_s: How long ago it was heard last [s].
        residual: What it differs from the truth by; null: no truth of that time.
    """

    vehicle: str
    tag_id: int
    x_m: float
    y_m: float
    yaw_rad: float
    age_s: float
    residual: Residual | None


class Calibrated(msgspec.Struct, kw_only=True, frozen=True):
    """Names of calibrations.

    Attributes:
        lens: Of the lens alone; empty: the one that the place was found with.
        place: Of the place and its lens; empty: as the camera was started, by the map file.
    """

    lens: str = ""
    place: str = ""


class InForce(msgspec.Struct, kw_only=True, frozen=True):
    """By which calibration a camera sees.

    Attributes:
        now: What it sees by.
        since_ns: When that was put in force, on the Eye's clock; None: it was started so.
        by: Who did, and `reason` why.
        reason: Why.
        before: What can be put back; None: nothing.
    """

    now: Calibrated
    since_ns: int | None = None
    by: str = ""
    reason: str = ""
    before: Calibrated | None = None


class CameraRow(msgspec.Struct, kw_only=True, frozen=True):
    """One camera.

    Attributes:
        camera: Name of a camera.
        frame_t_ns: Exposure of the newest frame, as text: it names the picture exactly, and is too
            long for a number in a browser. None: no frame yet.
        width_px: Columns of the picture.
        height_px: Rows of the picture.
        age_s: How long ago it was heard last [s].
        latency_ms: From exposure to being taken up [ms].
        tags: Those of that frame, or of the newest detection when that frame was skipped.
        tags_t_ns: Exposure of the frame that they were found in, as text; None: none yet.
        known: Tags of the last minute, whose they are, and where.
        seen: What is seen.
        good: Whether its poses can be trusted, by its own account; None: not said.
        complaints: What is wrong, in sentences.
        in_force: By which calibration it sees; null: not said.
    """

    camera: str
    frame_t_ns: str | None
    width_px: int | None
    height_px: int | None
    age_s: float | None
    latency_ms: float | None
    tags: tuple[TagSeen, ...]
    tags_t_ns: str | None
    known: tuple[TagRow, ...]
    seen: tuple[SeenRow, ...]
    good: bool | None
    complaints: tuple[str, ...]
    in_force: InForce | None


class Overhead(msgspec.Struct, kw_only=True, frozen=True):
    """The Eye's cameras, with what each sees.

    Attributes:
        cameras: Cameras.
    """

    cameras: tuple[CameraRow, ...]


class PageCameraRow(msgspec.Struct, kw_only=True, frozen=True):
    """Some rows of a list.

    Attributes:
        items: The rows of this page.
        next_: Cursor of those after them; null at the end.
    """

    items: tuple[CameraRow, ...]
    next_: str | None = msgspec.field(name="next")


class CameraState(msgspec.Struct, kw_only=True, frozen=True):
    """One camera.

    Attributes:
        state: As in the list.
        mounted: Its lens and where it hangs, by the map; null: the map does not know it.
    """

    state: CameraRow
    mounted: Camera | None


class EyeTags(msgspec.Struct, kw_only=True, frozen=True):
    """All tags of the frame taken at `t_ns`, which the Eye took up `latency_ms` after ....

    Attributes:
        camera: Name of a camera.
        t_ns: When it was true, by the clock of who tells it [ns].
        tags: One tag: centre and corners in pixels of the raw frame, first pixel's centre at (0,
            0).
        latency_ms: From exposure to being taken up [ms].
    """

    camera: str
    t_ns: int
    tags: tuple[TagSeen, ...]
    latency_ms: float


class PoseRow(msgspec.Struct, kw_only=True, frozen=True):
    """One car's pose as one camera measured it last.

    Attributes:
        camera: Name of a camera.
        vehicle: Name of a car.
        tag_id: Number of an AprilTag.
        t_ns: When the frame was exposed.
        x_m: To the right on the map [m].
        y_m: Up on the map [m].
        yaw_rad: Direction, counter-clockwise from map x [rad].
        std_x_m: Standard deviations, as the Eye tells them.
        std_y_m: Standard deviations, as the Eye tells them.
        std_yaw_rad: Standard deviations, as the Eye tells them.
        map_tag_age_ms: Since the camera last saw the map's tag.
        age_s: How long ago it was heard last [s].
        flags: What is wrong with the camera, by its own account: do not trust it.
        residual: What it differs from the truth by; null: no truth of that time.
    """

    camera: str
    vehicle: str
    tag_id: int
    t_ns: int
    x_m: float
    y_m: float
    yaw_rad: float
    std_x_m: float
    std_y_m: float
    std_yaw_rad: float
    map_tag_age_ms: float
    age_s: float
    flags: tuple[str, ...]
    residual: Residual | None


class PagePoseRow(msgspec.Struct, kw_only=True, frozen=True):
    """Some rows of a list.

    Attributes:
        items: The rows of this page.
        next_: Cursor of those after them; null at the end.
    """

    items: tuple[PoseRow, ...]
    next_: str | None = msgspec.field(name="next")
