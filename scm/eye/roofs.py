"""Predicts where the roof tags of cars appear in a frame, from their tracks.

A rolling shutter exposes rows one after the other: a car at 0.3 m/s is 3 mm further on in the last
row than in the first of 10 ms, and its tag is distorted. The image velocity of a tag is predicted,
so its corners can be moved to where they were when the middle row was exposed.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from scm.arrays import Floats
from scm.eye.camera import CameraModel
from scm.eye.track.sighting import Track
from scm.records.city_map import Camera
from scm.scenery.bodies import NIGEL, CarBody
from scm.scenery.tags import CORNERS

NEAR_PX = 20.0
"""A tag's centre may be this far outside the frame: part of it may be inside."""


def expected_tags(
    model: CameraModel, tracks: Sequence[Track], bodies: Mapping[str, CarBody]
) -> dict[int, Floats]:
    """Return the predicted corners of tags, (4, 2) [px] by id, of tracks this camera may see.

    Args:
        model: The camera.
        tracks: At the time of the exposure.
        bodies: Of the known vehicles; others are assumed to be Nigels.
    """
    if not tracks:
        return {}
    known = [bodies.get(track.vehicle, NIGEL) for track in tracks]
    offsets = np.array([body.tag_position for body in known])
    sizes = np.array([body.tag_size for body in known])
    pose = np.array([(track.x_m, track.y_m, track.yaw_rad) for track in tracks])
    on_car = CORNERS * sizes[:, None, None] + offsets[:, None, :2]
    c, s = np.cos(pose[:, 2])[:, None], np.sin(pose[:, 2])[:, None]
    points = np.empty((len(tracks), 4, 3))
    points[..., 0] = pose[:, :1] + c * on_car[..., 0] - s * on_car[..., 1]
    points[..., 1] = pose[:, 1:2] + s * on_car[..., 0] + c * on_car[..., 1]
    points[..., 2] = offsets[:, 2:]
    corners = model.project(points)
    return {
        track.tag_id: found
        for track, found in zip(tracks, corners, strict=True)
        if np.isfinite(found).all() and model.sees(found.mean(axis=0), -NEAR_PX)
    }


def at_middle_row(corners: Floats, pixels_per_s: Floats, camera: Camera) -> Floats:
    """Return a moving tag's corners at the time when the middle row was exposed.

    Args:
        corners: As detected, (4, 2) [px].
        pixels_per_s: Image velocity of each, (4, 2).
        camera: With a rolling shutter.
    """
    late_s = camera.rolling_s * ((corners[:, 1:] + 0.5) / camera.height_px - 0.5)
    return corners - late_s * pixels_per_s
