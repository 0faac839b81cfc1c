"""The overhead cameras as they are shown: which frame is newest, its tags, and pose residuals."""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import TypedDict

from scm.api.picture import Held, Picture, TagSighting
from scm.clock import seconds
from scm.records.city_map import MapTag
from scm.records.eye import CameraRow, PoseRow, Residual, SeenRow, TagRow
from scm.v2x.messages.eye_frame import EyeFrame
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.messages.eye_status import EyeStatus
from scm.v2x.messages.eye_tags import EyeTags

POSE_SHOWN_S = 2.0
SILENT_S = 2.0


class _Status(TypedDict):
    good: bool | None
    complaints: tuple[str, ...]


def camera_rows(
    picture: Picture, floor: Mapping[int, MapTag] = MappingProxyType({})
) -> tuple[CameraRow, ...]:
    """Return all cameras that have reported, by name; `floor`: the map's tags, by id."""
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
    status = picture.eye_statuses.get(camera)
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
        **_status(status, picture.now_ns),
        in_force=None if status is None else status.message.in_force,
    )


def _status(status: Held[EyeStatus] | None, now_ns: int) -> _Status:
    """Return what a camera reports of itself; one that no longer reports is not good."""
    if status is None:
        return {"good": None, "complaints": ()}
    age_s, complaints = status.age_s(now_ns), tuple(one.said for one in status.message.complaints)
    if age_s > SILENT_S:
        return {"good": False, "complaints": (f"no word from this camera for {age_s:.0f} s",)}
    return {"good": status.message.good, "complaints": complaints}


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
    vehicles = () if picture.snapshot is None else picture.snapshot.message.vehicles
    cars = {car.tag_id: car.vehicle for car in vehicles}
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
