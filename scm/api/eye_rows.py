"""The overhead cameras as they are shown: which frame is newest, its tags, and pose residuals."""

from typing import TypedDict

import msgspec

from scm.api.picture import Held, Picture
from scm.api.residual import Residual
from scm.v2x.messages.eye_frame import EyeFrame
from scm.v2x.messages.eye_status import EyeStatus
from scm.v2x.messages.eye_tags import EyeTags, TagSeen

POSE_SHOWN_S = 2.0
SILENT_S = 2.0


class _Status(TypedDict):
    good: bool | None
    complaints: tuple[str, ...]


class SeenRow(msgspec.Struct, kw_only=True, frozen=True):
    """One car as a camera sees it."""

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
        frame_t_ns: Exposure of the newest frame, as text: it names the picture exactly, and is
            too long for a number in a browser. None: no frame yet.
        tags: Those of that frame, or of the newest detection when that frame was skipped.
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


def camera_rows(picture: Picture) -> tuple[CameraRow, ...]:
    """Return all cameras that were heard, by name."""
    names = sorted({*picture.frames, *picture.tags, *picture.eye_statuses})
    return tuple(_row(name, picture) for name in names)


def frame_of(picture: Picture, camera: str, t_ns: int | None = None) -> Held[EyeFrame] | None:
    """Return a camera's frame exposed at `t_ns`, or its newest one."""
    frames = picture.frames.get(camera, ())
    exact = next((held for held in frames if held.message.t_ns == t_ns), None)
    return exact or (frames[-1] if frames else None)


def tags_of(picture: Picture, camera: str) -> Held[EyeTags] | None:
    """Return the tags found in the newest frame, or else the newest tags found."""
    found = picture.tags.get(camera, ())
    frame = frame_of(picture, camera)
    if frame is not None:
        for held in reversed(found):
            if held.message.t_ns == frame.message.t_ns:
                return held
    return found[-1] if found else None


def _row(camera: str, picture: Picture) -> CameraRow:
    frame, tags = frame_of(picture, camera), tags_of(picture, camera)
    said = picture.eye_statuses.get(camera)
    return CameraRow(
        camera=camera,
        frame_t_ns=None if frame is None else str(frame.message.t_ns),
        width_px=None if frame is None else frame.message.width_px,
        height_px=None if frame is None else frame.message.height_px,
        age_s=None if frame is None else round(frame.age_s(picture.now_ns), 1),
        latency_ms=None if tags is None else round(tags.message.latency_ms, 1),
        tags=() if tags is None else tags.message.tags,
        seen=tuple(_seen(camera, picture)),
        **_status(said, picture.now_ns),
    )


def _status(said: Held[EyeStatus] | None, now_ns: int) -> _Status:
    """Return what a camera says of itself; one that says nothing any more is not good."""
    if said is None:
        return {"good": None, "complaints": ()}
    age_s, complaints = said.age_s(now_ns), tuple(one.said for one in said.message.complaints)
    if age_s > SILENT_S:
        return {"good": False, "complaints": (f"no word from this camera for {age_s:.0f} s",)}
    return {"good": said.message.good, "complaints": complaints}


def _seen(camera: str, picture: Picture) -> list[SeenRow]:
    rows = []
    for (seen_by, vehicle), seen in sorted(picture.poses.items()):
        pose, age_s = seen.held.message, seen.held.age_s(picture.now_ns)
        if seen_by != camera or age_s > POSE_SHOWN_S:
            continue
        rows.append(
            SeenRow(
                vehicle=vehicle,
                tag_id=pose.tag_id,
                x_m=round(pose.x_m, 4),
                y_m=round(pose.y_m, 4),
                yaw_rad=round(pose.yaw_rad, 4),
                age_s=round(age_s, 1),
                residual=seen.residual,
            )
        )
    return rows
