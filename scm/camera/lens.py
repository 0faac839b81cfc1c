"""The lens of a car's camera: a pinhole with Brown-Conrady distortion.

    p_camera = camera_R_body (body_R_map (p_map - car) - mount)      a, b = p_x / p_z, p_y / p_z
    pixel = K distort(a, b)        distort: radial k1 k2 k3, tangential p1 p2 (OpenCV's five)

The scene is rendered on an undistorted canvas slightly larger than the frame; `bend` then looks up
each pixel of the frame there. Camera axes: x to the picture's right, y to its bottom, z out of the
lens. The centre of the first pixel is (0, 0).
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np

from scm.arrays import Floats, Image
from scm.camera.optics import Optics
from scm.errors import CarError

WIDEST = 1.6
"""How much larger than the frame a canvas may be, in each direction."""
_UNTIL = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 60, 1e-12)


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """Where a lens is at one instant.

    Attributes:
        camera_R_map: Turns map directions into camera directions, (3, 3).
        position: Of the optical centre, map frame, (3,) [m].
    """

    camera_R_map: Floats  # noqa: N815  a_R_b: the frame on the right turned into the one on the left
    position: Floats

    def seen(self, points: Floats) -> Floats:
        """Return map points in the camera's frame, (n, 3) [m]."""
        turned: Floats = (points - self.position) @ self.camera_R_map.T
        return turned


class Lens:
    """One camera's lens.

    Attributes:
        optics: From the car file.
        matrix: K of the frame, (3, 3) [px].
        canvas_matrix: K of the canvas, (3, 3) [px].
        canvas_size: Its width and height [px].

    Raises:
        CarError: when the distortion folds the picture over.
    """

    def __init__(self, optics: Optics) -> None:
        self.optics = optics
        width, height, f = optics.width_px, optics.height_px, optics.focal_px
        self.matrix = np.array([[f, 0, (width - 1) / 2], [0, f, (height - 1) / 2], [0, 0, 1.0]])
        self.distortion = np.array(optics.distortion)
        self.canvas_matrix = self.matrix
        self.canvas_size = (width, height)
        self._maps: tuple[Image, Image] | None = None
        if self.distortion.any():
            self._prepare_bending()

    def view(self, map_R_body: Floats, origin: Floats) -> View:  # noqa: N803
        """Return the view from a car: its rotation (3, 3) and its place (3,) [m] in the map."""
        optics = self.optics
        c, s = math.cos(optics.pitch_down), math.sin(optics.pitch_down)
        ahead = np.array([[0.0, -1.0, 0.0], [-s, 0.0, -c], [c, 0.0, -s]])
        cy, sy = math.cos(optics.yaw), math.sin(optics.yaw)
        turn = np.array([[cy, sy, 0.0], [-sy, cy, 0.0], [0.0, 0.0, 1.0]])
        if optics.roll:
            cr, sr = math.cos(optics.roll), math.sin(optics.roll)
            ahead = np.array([[cr, sr, 0.0], [-sr, cr, 0.0], [0.0, 0.0, 1.0]]) @ ahead
        rotation = ahead @ turn @ map_R_body.T
        return View(rotation, origin + map_R_body @ np.array(optics.position))

    def on_canvas(self, seen: Floats) -> Floats:
        """Return where points in front of the lens are on the canvas, (n, 3) [m] to (n, 2) [px]."""
        k = self.canvas_matrix
        pixels: Floats = seen[..., :2] / seen[..., 2:] * k[0, 0] + k[:2, 2]
        return pixels

    def project(self, seen: Floats) -> Floats:
        """Return where points in front of the lens are in the frame, (n, 3) [m] to (n, 2) [px]."""
        ideal = seen[..., :2] / seen[..., 2:]
        pixels: Floats = self._distorted(ideal) * self.matrix[0, 0] + self.matrix[:2, 2]
        return pixels

    def bend(self, canvas: Image) -> Image:
        """Return the frame of a canvas: itself when nothing is distorted."""
        if self._maps is None:
            return canvas
        bent = cv2.remap(canvas, *self._maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        return np.asarray(bent, dtype=np.uint8)

    def _distorted(self, ideal: Floats) -> Floats:
        a, b = ideal[..., 0], ideal[..., 1]
        k1, k2, p1, p2, k3 = self.distortion
        r2 = a * a + b * b
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        x = a * radial + 2.0 * p1 * a * b + p2 * (r2 + 2.0 * a * a)
        y = b * radial + 2.0 * p2 * a * b + p1 * (r2 + 2.0 * b * b)
        return np.stack((x, y), axis=-1)

    def _prepare_bending(self) -> None:
        """Find the canvas that holds all the frame shows, and each frame pixel's place on it."""
        width, height = self.canvas_size
        pixels = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1)
        flat = pixels.reshape(-1, 1, 2).astype(np.float64)
        ideal = cv2.undistortPoints(flat, self.matrix, self.distortion, None, None, None, _UNTIL)
        ideal = np.asarray(ideal, dtype=np.float64).reshape(-1, 2)
        back = self._distorted(ideal) * self.matrix[0, 0] + self.matrix[:2, 2]
        at = ideal * self.matrix[0, 0] + self.matrix[:2, 2]
        low = np.floor(np.minimum(at.min(axis=0), 0.0)) - 1.0
        size = np.ceil(np.maximum(at.max(axis=0), (width - 1, height - 1))) - low + 2.0
        # A polynomial that folds back sends some pixels far away, or not back to where they were.
        if (
            np.abs(back - flat[:, 0]).max() > 0.1
            or (size > WIDEST * np.array(self.canvas_size)).any()
        ):
            msg = (
                f"camera.distortion: got {list(self.optics.distortion)}, expected coefficients "
                "that show every pixel of the frame at one place, at most "
                f"{WIDEST} times as far out as without them"
            )
            raise CarError(msg)
        self.canvas_size = (int(size[0]), int(size[1]))
        self.canvas_matrix = self.matrix.copy()
        self.canvas_matrix[:2, 2] -= low
        where = (at - low).reshape(height, width, 2).astype(np.float32)
        maps = cv2.convertMaps(where[..., 0], where[..., 1], cv2.CV_16SC2)
        self._maps = (maps[0], maps[1])
