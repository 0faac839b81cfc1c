"""A request to an overhead camera: use this calibration from the next frame on."""

from typing import ClassVar, Literal

import msgspec

from scm.records.city_map import Camera
from scm.records.eye import InForce
from scm.records.fields import CameraName
from scm.v2x.message import Message, Request


class MeasuredLens(msgspec.Struct, kw_only=True, frozen=True):
    """A lens as `scm eye calibrate` measures it.

    Attributes:
        distortion: k1, k2, p1, p2, k3; of a fisheye k1, k2, k3, k4, 0.
        covariance: Of fx, fy, cx, cy and the distortion, nine rows of nine.
        rms_px: Of what was left at the board's points.
        views: Pictures of the board it was made from.
    """

    lens: Literal["pinhole", "fisheye"]
    width_px: int
    height_px: int
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    distortion: tuple[float, float, float, float, float]
    covariance: tuple[tuple[float, ...], ...]
    rms_px: float
    views: int


class CalibrationReply(Message, kw_only=True, frozen=True):
    """The request was accepted: what the camera uses from its next frame on."""

    KEY: ClassVar[str] = "eye/{camera}/req/reply"

    camera: CameraName
    in_force: InForce


class CalibrationRequest(Request, kw_only=True, frozen=True):
    """Use a lens, a place, or the calibration before; with who requests it and why.

    It is checked first, and refused where the floor's tags, as they are seen now, contradict it.

    Attributes:
        verb: `use` what follows; `back`: what was in force before, whatever the tags show.
        calibration: What it is called.
        place: Where the camera hangs, and the lens it was found with: the map file's block.
        lens: Alone: in place of the lens in force. With a place: covariance of its lens.
        accept_unsure: Whether it is meant although its poses would be flagged `unsure`; without,
            such a calibration is refused with the code `unsure`.
    """

    KEY: ClassVar[str] = "eye/{camera}/req"
    REPLY: ClassVar[type[Message]] = CalibrationReply
    SERVER: ClassVar[str] = "the Eye at camera {camera}"

    camera: str
    verb: Literal["use", "back"] = "use"
    calibration: str = ""
    place: Camera | None = None
    lens: MeasuredLens | None = None
    by: str
    reason: str = ""
    accept_unsure: bool = False


MESSAGE = CalibrationRequest
