"""Effects of a real lens and sensor on a picture: pure functions, image to image.

Images are (height, width, 3) or (height, width), 0 to 255; none is changed in place. Brightness is
assumed proportional to light, as in the whole renderer.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from scm.arrays import Floats, Image
from scm.errors import EyeError

NOISE_STEP = 32.0
"""Steps of the sheet of noise per standard deviation."""
FULL_GREY = 255.0
_FINE = 8


@dataclass(frozen=True, slots=True)
class Glare:
    """The reflection of a lamp on a shiny surface: a core that saturates, and a halo.

    Attributes:
        x_px, y_px: Its middle.
        length_px, width_px: Of the core.
        angle_rad: Of its length, from the picture's right towards its bottom.
        strength: Grey levels added by the core.
    """

    x_px: float
    y_px: float
    length_px: float
    width_px: float
    angle_rad: float = 0.0
    strength: float = 320.0


@dataclass(frozen=True, slots=True)
class LampSpot:
    """A lamp that lights its surroundings more than the rest.

    Attributes:
        x_px, y_px: The brightest place.
        radius_px: Distance at which its light drops to 60 %.
        strength: Light added, as a share.
    """

    x_px: float
    y_px: float
    radius_px: float
    strength: float


def motion_blur(image: Image, length_px: float, angle_rad: float = 0.0) -> Image:
    """Smear a picture evenly along a line; the angle goes from the right towards the bottom."""
    if length_px <= 0.0:
        return image.copy()
    return filtered(image, line_kernel(length_px, angle_rad))


def defocus(image: Image, radius_px: float) -> Image:
    """Smear every point over an even disc."""
    if radius_px <= 0.0:
        return image.copy()
    return filtered(image, disc_kernel(radius_px))


def filtered(image: Image, kernel: Floats) -> Image:
    """Apply a kernel of odd size that sums to 1; edges are continued."""
    return np.asarray(cv2.filter2D(image, -1, kernel, borderType=cv2.BORDER_REPLICATE))


def line_kernel(length_px: float, angle_rad: float) -> Floats:
    """Return the kernel of an even smear of that length, odd and square."""
    half = math.ceil(length_px / 2.0) + 1
    count = max(3, 16 * math.ceil(length_px))
    along = ((np.arange(count) + 0.5) / count - 0.5) * length_px
    x, y = half + along * math.cos(angle_rad), half + along * math.sin(angle_rad)
    kernel = np.zeros((2 * half + 1, 2 * half + 1))
    left, top = np.floor(x).astype(int), np.floor(y).astype(int)
    for dx, dy in ((0, 0), (1, 0), (0, 1), (1, 1)):
        weight = (1.0 - np.abs(x - left - dx)) * (1.0 - np.abs(y - top - dy))
        inside = weight > 0.0
        np.add.at(kernel, (top[inside] + dy, left[inside] + dx), weight[inside])
    found: Floats = kernel / kernel.sum()
    return found


def disc_kernel(radius_px: float) -> Floats:
    """Return the kernel of an even disc, odd and square."""
    half = math.ceil(radius_px)
    fine = (np.arange((2 * half + 1) * _FINE) + 0.5) / _FINE - 0.5 - half
    disc = (fine[:, None] ** 2 + fine[None, :] ** 2 <= radius_px**2).astype(np.float64)
    kernel = disc.reshape(2 * half + 1, _FINE, 2 * half + 1, _FINE).sum(axis=(1, 3))
    if kernel.sum() == 0.0:
        kernel[half, half] = 1.0
    found: Floats = kernel / kernel.sum()
    return found


def rolling_shutter(image: Image, velocity_px_s: tuple[float, float], line_s: float) -> Image:
    """Shear a picture that moves as a whole while its rows are read one after the other.

    Args:
        image: As at the time of its middle row.
        velocity_px_s: Of everything in it, to the right and to the bottom.
        line_s: From one row to the next.
    """
    height, width = image.shape[:2]
    rows = np.arange(height, dtype=np.float64)
    late = (rows - (height - 1) / 2.0) * line_s
    x = np.arange(width)[None, :] - velocity_px_s[0] * late[:, None]
    y = np.broadcast_to((rows - velocity_px_s[1] * late)[:, None], (height, width))
    return np.asarray(
        cv2.remap(
            image, x.astype(np.float32), y.astype(np.float32), cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE,
        )
    )  # fmt: skip


def vignetting(image: Image, share: float) -> Image:
    """Darken a picture towards its corners, where `share` of the light is missing."""
    height, width = image.shape[:2]
    return lit(image, vignette_gain(width, height, share))


def vignette_gain(width: int, height: int, share: float) -> Floats:
    """Return the transmission of a lens: 1 in the middle, `1 - share` at the corner pixels.

    Raises:
        EyeError: The share is not within 0 to 1.
    """
    if not 0.0 <= share <= 1.0:
        raise EyeError(f"vignetting: expected a share from 0 to 1, got {share}")
    x, y = np.arange(width) - (width - 1) / 2.0, np.arange(height) - (height - 1) / 2.0
    corner = ((width - 1) ** 2 + (height - 1) ** 2) / 4.0
    gain: Floats = 1.0 - share * (x[None, :] ** 2 + y[:, None] ** 2) / corner
    return gain


def uneven_light(
    image: Image, gradient: float, angle_rad: float = 0.0, spots: Sequence[LampSpot] = ()
) -> Image:
    """Light a picture more on one side than on the other, and around lamps."""
    height, width = image.shape[:2]
    return lit(image, light_gain(width, height, gradient, angle_rad, spots))


def light_gain(
    width: int, height: int, gradient: float, angle_rad: float, spots: Sequence[LampSpot]
) -> Floats:
    """Return the light at each pixel: from `1 - gradient / 2` to `1 + gradient / 2`, plus lamps.

    The angle of the brighter side goes from the picture's right towards its bottom.
    """
    x, y = np.arange(width) - (width - 1) / 2.0, np.arange(height) - (height - 1) / 2.0
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    reach = max(abs(c) * (width - 1) + abs(s) * (height - 1), 1.0)
    gain: Floats = 1.0 + gradient * (c * x[None, :] + s * y[:, None]) / reach
    for spot in spots:
        gain = gain + spot.strength * _bell(width, height, spot.x_px, spot.y_px, spot.radius_px)
    return gain


def _bell(width: int, height: int, x: float, y: float, radius: float) -> Floats:
    across = np.exp(-0.5 * ((np.arange(width) - x) / radius) ** 2)
    down = np.exp(-0.5 * ((np.arange(height) - y) / radius) ** 2)
    return np.outer(down, across)


def lit(image: Image, gain: Floats) -> Image:
    """Multiply a picture by the light at each pixel, (height, width)."""
    each = gain if image.ndim == 2 else gain[..., None]
    return np.clip(np.rint(image * each), 0.0, FULL_GREY).astype(np.uint8)


def glare(image: Image, spots: Sequence[Glare]) -> Image:
    """Add the reflections of lamps."""
    height, width = image.shape[:2]
    added = glare_light(width, height, spots)
    each = added if image.ndim == 2 else added[..., None]
    return np.clip(np.rint(image + each), 0.0, FULL_GREY).astype(np.uint8)


def glare_light(width: int, height: int, spots: Sequence[Glare]) -> Floats:
    """Return the light added by reflections of lamps, (height, width) [grey levels]."""
    added = np.zeros((height, width))
    for spot in spots:
        c, s = math.cos(spot.angle_rad), math.sin(spot.angle_rad)
        x, y = np.arange(width)[None, :] - spot.x_px, np.arange(height)[:, None] - spot.y_px
        along, across = 2.0 * (c * x + s * y) / spot.length_px, 2.0 * (c * y - s * x)
        squared = along**2 + (across / spot.width_px) ** 2
        added += spot.strength * (0.8 * np.exp(-(squared**1.4)) + 0.2 / (1.0 + squared) ** 1.3)
    return added


def sensor_noise(
    image: Image, read_sigma: float, shot_sigma: float, rng: np.random.Generator
) -> Image:
    """Add a sensor's noise: `sigma = sqrt(read^2 + shot^2 grey / 255)`, the same in all colours.

    Args:
        image: The light.
        read_sigma: At black [grey levels].
        shot_sigma: What the light adds at white [grey levels].
        rng: Of the noise.
    """
    return NoiseSheet(image.shape[1], image.shape[0], read_sigma, shot_sigma, rng, 1).on(image)


class NoiseSheet:
    """Noise drawn once and used at a random offset for every picture: fresh noise costs far more.

    Args:
        width, height: Of the pictures.
        read_sigma, shot_sigma: As `sensor_noise` has them.
        rng: Of the noise and its offsets.
        sheets: Size of the sheet in pictures.
    """

    def __init__(
        self,
        width: int,
        height: int,
        read_sigma: float,
        shot_sigma: float,
        rng: np.random.Generator,
        sheets: int = 2,
    ) -> None:
        if min(read_sigma, shot_sigma) < 0.0:
            raise EyeError(f"noise: expected sigmas from 0 on, got {read_sigma} and {shot_sigma}")
        self._rng = rng
        normal = rng.standard_normal(sheets * width * height, dtype=np.float32)
        self._sheet = np.clip(np.rint(NOISE_STEP * normal), -127, 127).astype(np.int8)
        grey = np.arange(256) / FULL_GREY
        sigma = np.sqrt(read_sigma**2 + shot_sigma**2 * grey)
        self._sigma = np.clip(np.rint(8.0 * sigma), 0, 255).astype(np.uint8)

    def on(self, image: Image) -> Image:
        """Return a picture with noise on it, a new one."""
        pixels = image.shape[0] * image.shape[1]
        start = int(self._rng.integers(0, len(self._sheet) - pixels + 1))
        noise = self._sheet[start : start + pixels].reshape(image.shape[:2])
        if image.ndim == 3:
            noise = cv2.merge((noise, noise, noise))
        spread = cv2.LUT(image, self._sigma)
        added = cv2.multiply(noise, spread, scale=1.0 / (8.0 * NOISE_STEP), dtype=cv2.CV_16S)
        return np.asarray(cv2.add(image, added, dtype=cv2.CV_8U), dtype=np.uint8)


def jpeg(image: Image, quality: int) -> Image:
    """Return a picture after JPEG compression at a quality from 1 to 100.

    Raises:
        EyeError: There is no such quality.
    """
    if not 1 <= quality <= 100:
        raise EyeError(f"jpeg: expected a quality from 1 to 100, got {quality}")
    _, packed = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])
    how = cv2.IMREAD_GRAYSCALE if image.ndim == 2 else cv2.IMREAD_COLOR
    return np.asarray(cv2.imdecode(packed, how), dtype=np.uint8)
