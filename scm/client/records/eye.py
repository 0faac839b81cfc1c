"""Records of eye.

Written by docs/make/client.py: do not change it here.
"""

import msgspec

from scm.client.records.shared import Residual


class TagSeen(msgspec.Struct, kw_only=True, frozen=True):
    """One tag: centre and corners in pixels of the raw frame, first pixel's centre at (0, 0).

    Attributes:
        tag_id: Number of an AprilTag.
        centre_px: Middle of the tag in the raw picture: column, row [px].
        corners_px: Lower left, lower right, upper right, upper left of the printed tag.
        margin: Decision margin of the detector.
    """

    tag_id: int
    centre_px: tuple[float, float]
    corners_px: tuple[
        tuple[float, float], tuple[float, float], tuple[float, float], tuple[float, float]
    ]
    margin: float


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
        seen: What is seen.
        good: Whether its poses can be trusted, by its own account; None: not said.
        complaints: What is wrong, in sentences.
    """

    camera: str
    frame_t_ns: str | None
    width_px: int | None
    height_px: int | None
    age_s: float | None
    latency_ms: float | None
    tags: tuple[TagSeen, ...]
    seen: tuple[SeenRow, ...]
    good: bool | None
    complaints: tuple[str, ...]


class Overhead(msgspec.Struct, kw_only=True, frozen=True):
    """The Eye's cameras, with what each sees.

    Attributes:
        cameras: Cameras.
    """

    cameras: tuple[CameraRow, ...]


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
