"""Conversions between the Eye's results and messages."""

import numpy as np

from scm.arrays import Floats
from scm.eye.pose import PoseEstimate
from scm.eye.track.sighting import Sighting, Track
from scm.geometry import Pose2
from scm.v2x.messages.eye_pose import EyePose, Rows
from scm.v2x.messages.eye_track import EyeTrack, Row6


def pose_message(sighting: Sighting, map_tag_age_ms: float) -> EyePose:
    """Return one camera's pose of a car."""
    return EyePose(
        camera=sighting.camera,
        vehicle=sighting.vehicle,
        tag_id=sighting.tag_id,
        t_ns=sighting.t_ns,
        x_m=sighting.pose.x,
        y_m=sighting.pose.y,
        yaw_rad=sighting.pose.yaw,
        covariance=_rows(sighting.covariance),
        map_tag_age_ms=map_tag_age_ms,
        shared_covariance=None if sighting.shared is None else _rows(sighting.shared),
        lean_covariance=None if sighting.common_mode is None else _rows(sighting.common_mode),
        flags=sighting.flags,
    )


def sighting_of(message: EyePose) -> Sighting:
    """Return another camera's message as a sighting."""
    return Sighting(
        camera=message.camera,
        tag_id=message.tag_id,
        vehicle=message.vehicle,
        t_ns=message.t_ns,
        pose=Pose2(message.x_m, message.y_m, message.yaw_rad),
        covariance=_square(message.covariance),
        shared=None if message.shared_covariance is None else _square(message.shared_covariance),
        common_mode=None if message.lean_covariance is None else _square(message.lean_covariance),
        flags=message.flags,
    )


def sighting(
    camera: str, t_ns: int, tag_id: int, vehicle: str, found: PoseEstimate, flags: tuple[str, ...]
) -> Sighting:
    """Return one camera's pose of a car as a sighting."""
    return Sighting(camera, tag_id, vehicle, t_ns, found.pose, found.covariance, found.shared,
                    found.common_mode, flags)  # fmt: skip


def track_message(track: Track) -> EyeTrack:
    """Return a track as a message."""
    a, b, c, d, e, f = (_six(row) for row in track.covariance)
    return EyeTrack(
        vehicle=track.vehicle,
        tag_id=track.tag_id,
        t_ns=track.t_ns,
        x_m=track.x_m,
        y_m=track.y_m,
        yaw_rad=track.yaw_rad,
        speed_mps=track.speed_mps,
        lateral_speed_mps=track.lateral_speed_mps,
        yaw_rate_radps=track.yaw_rate_rad_s,
        covariance=(a, b, c, d, e, f),
        age_s=track.age_s,
        stale=track.stale,
        flags=track.flags,
        cameras=track.cameras,
    )


def _rows(covariance: Floats) -> Rows:
    a, b, c, d, e, f, g, h, i = (float(value) for value in covariance.flat)
    return a, b, c, d, e, f, g, h, i


def _six(row: Floats) -> Row6:
    a, b, c, d, e, f = (float(value) for value in row)
    return a, b, c, d, e, f


def _square(rows: Rows) -> Floats:
    return np.array(rows, dtype=np.float64).reshape(3, 3)
