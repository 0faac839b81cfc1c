"""The overhead cameras as they are shown: which frame is newest, its tags, and pose residuals."""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Annotated, Literal, TypedDict

import msgspec

from scm.api.picture import Held, Picture, TagSighting
from scm.api.residual import Residual
from scm.clock import seconds
from scm.records.city_map import MapTag
from scm.v2x.messages.eye_frame import EyeFrame
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.messages.eye_status import EyeStatus, InForce
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


class TagRow(msgspec.Struct, kw_only=True, frozen=True):
    """One tag that a camera saw within the last minute.

    Attributes:
        what: `car`; `map`: it lies on the floor, known to the map; `other`: nobody's.
        vehicle: The car that wears it; empty: none does.
        margin: Decision margin of the detector, higher is clearer.
        hamming: Bits of 36 that were read wrong and corrected; null: not told.
        size_px: Mean side of its black square in the picture [px].
        seen_s: How long ago the camera saw it last [s].
        x_m, y_m, yaw_rad: Of the car, by this camera; of a map tag as its map has it; null: not
            known.
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


class PoseRow(msgspec.Struct, kw_only=True, frozen=True):
    """One car's pose as one camera measured it last.

    Attributes:
        t_ns: When the frame was exposed.
        std_x_m, std_y_m, std_yaw_rad: Standard deviations, as the Eye tells them.
        map_tag_age_ms: Since the camera last saw the map's tag.
        flags: What is wrong with the camera, by its own account: do not trust it.
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
    tags_t_ns: Annotated[str | None, msgspec.Meta(examples=["120000000000"])]
    known: tuple[TagRow, ...]
    seen: tuple[SeenRow, ...]
    good: bool | None
    complaints: tuple[str, ...]
    in_force: InForce | None


def camera_rows(
    picture: Picture, floor: Mapping[int, MapTag] = MappingProxyType({})
) -> tuple[CameraRow, ...]:
    """Return all cameras that were heard, by name; `floor`: the map's tags, by id."""
    names = sorted({*picture.frames, *picture.tags, *picture.eye_statuses})
    return tuple(_row(name, picture, floor) for name in names)


def pose_rows(picture: Picture) -> tuple[PoseRow, ...]:
    """Return the newest pose of each camera and car of the last minute, by their names."""
    return tuple(
        _pose(seen.held.message, seen.held.age_s(picture.now_ns), seen.residual)
        for _, seen in sorted(picture.poses.items())
    )


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


def _row(camera: str, picture: Picture, floor: Mapping[int, MapTag]) -> CameraRow:
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
        tags_t_ns=None if tags is None else str(tags.message.t_ns),
        known=tuple(_known(camera, picture, floor)),
        seen=tuple(_seen(camera, picture)),
        **_status(said, picture.now_ns),
        in_force=None if said is None else said.message.in_force,
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


def _known(camera: str, picture: Picture, floor: Mapping[int, MapTag]) -> list[TagRow]:
    told = () if picture.snapshot is None else picture.snapshot.message.vehicles
    cars = {car.tag_id: car.vehicle for car in told}
    return [
        _tag(one, picture, camera, cars.get(tag_id, ""), floor.get(tag_id))
        for (seen_by, tag_id), one in sorted(picture.tags_seen.items())
        if seen_by == camera
    ]


def _tag(
    one: TagSighting, picture: Picture, camera: str, vehicle: str, on_floor: MapTag | None
) -> TagRow:
    at: MapTag | EyePose | None = on_floor
    if on_floor is None:
        pose = picture.poses.get((camera, vehicle or f"tag-{one.tag.tag_id}"))
        at = None if pose is None else pose.held.message
    corners = one.tag.corners_px
    sides = [math.dist(corners[i - 1], corners[i]) for i in range(len(corners))]
    return TagRow(
        tag_id=one.tag.tag_id,
        what="map" if on_floor is not None else "car" if vehicle else "other",
        vehicle="" if on_floor is not None else vehicle,
        margin=round(one.tag.margin, 1),
        hamming=one.tag.hamming,
        size_px=round(sum(sides) / len(sides), 1),
        seen_s=round(max(0.0, seconds(picture.now_ns - one.arrived_ns)), 1),
        x_m=None if at is None else round(at.x_m, 4),
        y_m=None if at is None else round(at.y_m, 4),
        yaw_rad=None if at is None else round(at.yaw_rad, 4),
    )


def _pose(pose: EyePose, age_s: float, residual: Residual | None) -> PoseRow:
    x, y, yaw = (math.sqrt(max(0.0, pose.covariance[i])) for i in (0, 4, 8))
    return PoseRow(
        camera=pose.camera,
        vehicle=pose.vehicle,
        tag_id=pose.tag_id,
        t_ns=pose.t_ns,
        x_m=round(pose.x_m, 4),
        y_m=round(pose.y_m, 4),
        yaw_rad=round(pose.yaw_rad, 4),
        std_x_m=round(x, 5),
        std_y_m=round(y, 5),
        std_yaw_rad=round(yaw, 5),
        map_tag_age_ms=round(pose.map_tag_age_ms, 1),
        age_s=round(age_s, 1),
        flags=pose.flags,
        residual=residual,
    )
