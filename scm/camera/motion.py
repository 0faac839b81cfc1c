"""Motion blur: what a camera shows that moves while it is exposed.

The floor seen from another pose of the car is the picture under a homography, and so is all else
for a turn. A car's motion is an arc, whose homographies are powers of one: the mean of 2^n pictures
along it takes n warps, each twice as far as the last. So one picture is rendered, not 2^n.

Holds: floor, and everything else as far as the car turns; what stands above the floor is smeared as
the floor at its pixel, what is above the horizon as a ceiling as far up. Other cars' own motion and
the body's roll and pitch do not smear.
"""

import cmath
import math

import cv2
import numpy as np

from scm.arrays import Floats, Image
from scm.camera.lens import Lens, View
from scm.geometry import Pose2

STILL = Pose2(0.0, 0.0, 0.0)
STEP_PX = 2.0
MAX_DOUBLINGS = 6
_WARP = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP


def along(motion: Pose2, share: float) -> Pose2:
    """Return a share of a motion along its arc; a negative one is the way back."""
    x, y, yaw = motion
    if abs(yaw) < 1e-9:
        return Pose2(share * x, share * y, share * yaw)
    at = complex(x, y) * (cmath.exp(1j * yaw * share) - 1.0) / (cmath.exp(1j * yaw) - 1.0)
    return Pose2(at.real, at.imag, share * yaw)


def doublings(lens: Lens, view: View, car: Pose2, motion: Pose2) -> int:
    """Return how many warps a motion needs, so that pictures are `STEP_PX` apart at most."""
    if motion == STILL:
        return 0
    width, height = lens.canvas_size
    pixels = np.array([[x, y, 1.0] for x in (0, width / 2, width) for y in (0, height)]).T
    moved = _warp(lens, view, car, motion) @ pixels
    farthest = float(np.hypot(*(moved[:2] / moved[2] - pixels[:2])).max())
    return min(MAX_DOUBLINGS, max(0, math.ceil(math.log2(max(farthest / STEP_PX, 1.0)))))


def smear(canvas: Image, lens: Lens, view: View, car: Pose2, motion: Pose2, count: int) -> None:
    """Make a picture from where the motion began the mean over it.

    Args:
        canvas: The picture.
        lens: The camera's.
        view: Where it was when the motion began.
        car: Where the car was then, map frame.
        motion: Its pose at the end, seen from there.
        count: Of `doublings`.
    """
    for step in range(count, 0, -1):
        warp = _warp(lens, view, car, along(motion, 0.5**step))
        later = cv2.warpPerspective(
            canvas, warp, lens.canvas_size, flags=_WARP, borderMode=cv2.BORDER_REPLICATE
        )
        cv2.addWeighted(canvas, 0.5, later, 0.5, 0.0, canvas)


def begin(car: Pose2, motion: Pose2, count: int) -> Pose2:
    """Return where a car was that is in the middle of the pictures of `smear`."""
    return car @ along(motion, -0.5 * (1.0 - 0.5**count))


def _warp(lens: Lens, view: View, car: Pose2, motion: Pose2) -> Floats:
    """Return the homography from pixels after a motion to those before."""
    from_map = np.column_stack((view.camera_R_map[:, :2], -view.camera_R_map @ view.position))
    from_floor = lens.canvas_matrix @ from_map @ _matrix(car)
    warp: Floats = from_floor @ _matrix(motion) @ np.linalg.inv(from_floor)
    return warp


def _matrix(pose: Pose2) -> Floats:
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    return np.array([[c, -s, pose.x], [s, c, pose.y], [0.0, 0.0, 1.0]])
