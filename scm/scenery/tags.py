"""The pattern of a printed tag36h11 tag and the positions of its corners.

A printed tag is a white margin one cell wide around a black square of 8 x 8 cells. Its size is the
edge of the black square. The order of corners is lower left, lower right, upper right, upper left
of the print. Its right is the x of the tag's frame (a car's front, the map's x), its top the y (a
car's left).
"""

from functools import lru_cache

import cv2
import numpy as np

from scm.arrays import Floats, Image
from scm.errors import EyeError
from scm.geometry import Pose2
from scm.records.city_map import MapTag

CELLS = 8
MARGIN_CELLS = 1
TAG_COUNT = 587
CORNERS = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
"""Corners of the black square of a tag of size 1 in its own frame, (4, 2)."""
PRINT_SCALE = (CELLS + 2 * MARGIN_CELLS) / CELLS
"""Edge of the print with its margin over the edge of the black square."""


def tag_corners(size: float) -> Floats:
    """Return the corners of the black square in the tag's frame, (4, 2) [m]."""
    return CORNERS * size


def floor_corners(tag: MapTag) -> Floats:
    """Return the corners of a tag that lies on the floor, in the map frame, (4, 3) [m]."""
    pose = Pose2(tag.x_m, tag.y_m, tag.yaw_rad)
    return np.array([(*pose.apply(x, y), 0.0) for x, y in tag_corners(tag.size_m)])


@lru_cache(maxsize=64)
def tag_picture(tag_id: int, cell_px: int = 16) -> Image:
    """Return the print of a tag, margin included, upright, `cell_px` pixels a cell.

    Raises:
        EyeError: The family has no such id.
    """
    if not 0 <= tag_id < TAG_COUNT:
        raise EyeError(f"tag36h11: expected an id from 0 to {TAG_COUNT - 1}, got {tag_id}")
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    marker = cv2.aruco.generateImageMarker(family, tag_id, CELLS * cell_px)
    # OpenCV draws the family half a turn from the AprilTag library's own upright.
    upright = np.asarray(marker, dtype=np.uint8)[::-1, ::-1]
    picture = np.pad(upright, MARGIN_CELLS * cell_px, constant_values=255)
    picture.setflags(write=False)
    return picture
