"""Fits how a rendered camera looks to real frames.

Colour: quantiles of red, green and blue on the floor, in rings about the frame's middle, are moved
onto the real ones by exposure, white balance, gamma and vignetting; least absolute differences, by
weighted least squares. Then the lens's blur, by the sharpness of edges; then noise, by what frames
with known noise show after the same compression.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import cv2
import numpy as np

from scm.arrays import Floats, Image
from scm.camera.calibrate.counterparts import Counterparts, small
from scm.camera.calibrate.measures import BIN, colour_distance, colours, noise, sharpness
from scm.camera.calibrate.real_frames import RealFrames
from scm.camera.look import squared_radius
from scm.camera.optics import Optics
from scm.camera.sensor import Noise
from scm.geometry import Pose2

RINGS = 3
MAX_FULL_FRAMES = 8
"""Frames at full size that noise and sharpness are measured in."""
NOISES = np.array([0.0, 0.7, 1.0, 1.5, 2.0, 3.0, 4.5, 7.0, 10.0, 15.0, 25.0])
BLURS_PX = np.array([0.0, 0.4, 0.6, 0.8, 1.0, 1.3, 1.7, 2.2, 3.0, 4.0, 6.0])
VISIBLE = 1.03
"""By how much noise or blur must change what is measured to be seen."""
GAMMA_STD, VIGNETTING_STD = 0.5, 0.3
UNKNOWN = 0.5
"""A number that the frames determine no better than this share of what was known is unknown."""
_STEPS = 80
_LEAST_OFF = 1.0  # grey levels: nearer than this, differences count as their squares


@dataclass(frozen=True, slots=True)
class Figures:
    """How frames differ from held-out real ones.

    Attributes:
        colour: Distance of the colours [grey levels].
        noise: Standard deviation where frames are even [grey levels]; None: not measured.
        sharpness: Of edges; None likewise.
    """

    colour: float
    noise: float | None
    sharpness: float | None


@dataclass(frozen=True, slots=True)
class Fitted:
    """The look that was found.

    Attributes:
        optics: With the look.
        real, before, after: Of held-out frames: real ones, and rendered ones by the car file as it
            was and as fitted. `real.colour` is what chance makes of equal looks.
        remarks: What these frames do not determine.
        sheet: Three rows of held-out frames: before, after, real.
    """

    optics: Optics
    real: Figures
    before: Figures
    after: Figures
    remarks: tuple[str, ...]
    sheet: Image


def fit(
    real: RealFrames, scene: Counterparts, optics: Optics, notify: Callable[[str], None]
) -> Fitted:
    """Fit the look of a camera to every other frame, and compare it with those between.

    Args:
        real: The frames.
        scene: What renders the same camera.
        optics: The camera as the car file has it.
        notify: Receives what is done now.
    """
    notify("looking for places that look alike")
    little = small(real.images)
    places = scene.places_like(little)
    fitted, held = slice(0, None, 2), slice(1, None, 2)
    notify("fitting colours")
    plain = small(scene.frames(places[fitted], scene.plain))
    look, remarks = _coloured(scene, scene.floor_of(little[fitted]), scene.floor_of(plain))
    look = replace(
        look, gain=optics.gain, exposure=look.exposure / optics.gain,
        read_noise=optics.read_noise, shot_noise=optics.shot_noise,
    )  # fmt: skip
    is_full = real.images.shape[2] == optics.width_px
    if is_full:
        notify("fitting sharpness and noise")
        full = _Full(scene, real, places, fitted)
        look, more = full.fit(look)
        remarks += more
    else:
        remarks.append("noise, blur_px: the frames were made smaller, which hides both")
    if real.jpeg_quality is not None and is_full:
        look = replace(look, jpeg_quality=float(real.jpeg_quality))
    notify("comparing with frames held out")
    return _compared(real, scene, places[held], held, (optics, look), remarks)


def as_delivered(image: Image, quality: int | None) -> Image:
    """Return a frame as its file has it."""
    if quality is None:
        return image
    packed = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
    return np.asarray(cv2.imdecode(packed, cv2.IMREAD_COLOR), dtype=np.uint8)


def _coloured(scene: Counterparts, real: Image, plain: Image) -> tuple[Optics, list[str]]:
    """Return the camera with exposure, white balance, gamma and vignetting fitted.

    Parameters, in this order: logarithms of exposure, of red's and blue's factor, of gamma; and the
    vignetting.
    """
    height, width = real.shape[1:3]
    whole = round(height / (1.0 - scene.floor))
    r2 = squared_radius(width, whole)[-height:]
    rings = np.minimum((RINGS * np.argsort(np.argsort(r2, axis=None)) / r2.size), RINGS - 1)
    rings = rings.astype(int).reshape(r2.shape)
    r2_of = np.array([r2[rings == i].mean() for i in range(RINGS)])[:, None, None]
    wanted, given = colours(real, rings, RINGS), colours(plain, rings, RINGS) / 255.0
    x = np.zeros(5)
    x[0] = np.log(np.median(wanted) / 255.0 / np.median(given))
    prior = np.diag([0.0, 0.0, 0.0, GAMMA_STD**-2, VIGNETTING_STD**-2])
    for _ in range(_STEPS):
        off, slopes = _misfit(x, wanted, given, r2_of)
        weights = 1.0 / np.maximum(np.abs(off), _LEAST_OFF)
        information = (slopes * weights[:, None]).T @ slopes + prior + 1e-9 * np.eye(5)
        step = np.linalg.solve(information, slopes.T @ (weights * off) - prior @ x)
        x = x + np.clip(step, -0.3, 0.3)
        x[4] = np.clip(x[4], 0.0, 0.9)
    stds = np.sqrt(np.diag(np.linalg.inv(information)))
    remarks = []
    if stds[3] > UNKNOWN * GAMMA_STD:
        remarks.append("gamma: the floor has hardly more than one brightness")
    if stds[4] > UNKNOWN * VIGNETTING_STD:
        remarks.append("vignetting: too little of the frame is lit floor")
    exposure, red, blue, gamma = (float(value) for value in np.exp(x[:4]))
    look = replace(
        scene.plain, exposure=exposure, white_balance=(red, 1.0, blue), gamma=gamma,
        vignetting=float(x[4]),
    )  # fmt: skip
    return look, remarks


def _misfit(x: Floats, wanted: Floats, given: Floats, r2: Floats) -> tuple[Floats, Floats]:
    """Return wanted less shown grey levels, (n,), and what each parameter adds to them, (n, 5)."""
    balance = np.exp([x[1], 0.0, x[2]])
    gamma, lost = np.exp(x[3]), x[4]
    exposed = np.exp(x[0]) * given
    light = balance * (1.0 - lost * r2) * np.minimum(exposed, 1.0)
    shown = np.clip(light, 1e-4, 1.0)
    grey = 255.0 * shown**gamma
    rise = np.where(light < 1.0, gamma * grey, 0.0)  # of the logarithm of the light
    columns = (
        np.where(exposed < 1.0, rise, 0.0), rise * (1.0, 0.0, 0.0), rise * (0.0, 0.0, 1.0),
        grey * np.log(shown) * gamma, -rise * r2 / (1.0 - lost * r2),
    )  # fmt: skip
    return (wanted - grey).ravel(), np.stack([column.ravel() for column in columns], axis=1)


class _Full:
    """Frames at full size, real ones and their counterparts, of which noise is measured."""

    def __init__(
        self, scene: Counterparts, real: RealFrames, places: list[Pose2], which: slice
    ) -> None:
        count = len(places[which])
        few = np.unique(np.linspace(0, count - 1, min(MAX_FULL_FRAMES, count)).astype(int))
        self._scene, self._quality = scene, real.jpeg_quality
        self._places = [places[which][i] for i in few]
        self._real = scene.floor_of(real.images[which][few])

    def fit(self, look: Optics) -> tuple[Optics, list[str]]:
        """Return the camera with blur and noise fitted; and what the frames do not determine."""
        remarks = list[str]()
        blur_px = self._blur_px(look)
        if blur_px is None:
            remarks.append("blur_px: the real frames are sharper than what is rendered")
        look = replace(look, blur_px=blur_px or 0.0)
        read, shot, is_visible = self._noise(look)
        if not is_visible:
            remarks.append("read_noise, shot_noise: hidden by the compression, or by the texture")
        return replace(look, read_noise=read, shot_noise=shot), remarks

    def _blur_px(self, look: Optics) -> float | None:
        wanted = sharpness(self._real)
        clean = replace(look, read_noise=0.0, shot_noise=0.0)
        found = []
        for blur_px in BLURS_PX:
            frames = self._scene.frames(self._places, replace(clean, blur_px=float(blur_px)))
            found.append(sharpness(self._delivered(self._scene.floor_of(frames))))
            if found[-1] < wanted:
                break
        if VISIBLE * found[0] < wanted:
            return None
        falling = np.minimum.accumulate(found)[::-1]
        return float(np.interp(wanted, falling, BLURS_PX[: len(found)][::-1]))

    def _noise(self, look: Optics) -> tuple[float, float, bool]:
        """Return read and shot noise, and whether any is visible."""
        clean = self._scene.floor_of(
            self._scene.frames(self._places, replace(look, read_noise=0.0, shot_noise=0.0))
        )
        seen = np.array([noise(self._delivered(self._noisy(clean, look, s)))[0] for s in NOISES])
        wanted, pixels = noise(self._real)
        known = np.flatnonzero(np.isfinite(wanted) & np.isfinite(seen).all(axis=0))
        if not len(known):
            return look.read_noise, look.shot_noise, False
        added: Floats = np.array([_inverted(wanted[i], seen[:, i]) for i in known])
        grey = (known.astype(np.float64) + 0.5) * BIN / 255.0
        variance: Floats = added**2
        weights: Floats = np.sqrt(pixels[known]) / (variance + 0.25) ** 2
        read2, shot2 = _two_not_negative(grey, variance, weights)
        gain = look.gain
        return read2**0.5 / gain, (shot2 / gain) ** 0.5, bool(added.any())

    def _delivered(self, images: Image) -> list[Image]:
        return [as_delivered(np.ascontiguousarray(one), self._quality) for one in images]

    def _noisy(self, clean: Image, look: Optics, sigma: float) -> Image:
        height, width = clean.shape[1:3]
        even = replace(
            look, gain=1.0, read_noise=sigma, shot_noise=0.0, height_px=height, width_px=width
        )
        sensor, noisy = Noise(even, 0), clean.copy()
        for number, frame in enumerate(noisy):
            sensor.add(frame, "camera", "front", number)
        return noisy


def _inverted(wanted: float, seen: Floats) -> float:
    """Return the noise that makes what is wanted of what is seen; 0 if there is none to find."""
    rising = np.maximum.accumulate(seen)
    if wanted < VISIBLE * rising[0]:
        return 0.0
    return float(np.interp(wanted, rising, NOISES))


def _two_not_negative(grey: Floats, variance: Floats, weights: Floats) -> tuple[float, float]:
    """Return a and b, neither below 0, of the variance a + b grey."""
    columns = np.stack((np.ones_like(grey), grey), axis=1) * np.sqrt(weights)[:, None]
    target = variance * np.sqrt(weights)
    both = np.linalg.lstsq(columns, target, rcond=None)[0]
    if both.min() >= 0.0:
        return float(both[0]), float(both[1])
    alone = [float(c @ target / max(float(c @ c), 1e-12)) for c in columns.T]
    off = [float(np.sum((c * a - target) ** 2)) for c, a in zip(columns.T, alone, strict=True)]
    return (alone[0], 0.0) if off[0] <= off[1] else (0.0, alone[1])


def _compared(
    real: RealFrames, scene: Counterparts, places: list[Pose2], held: slice,
    looks: tuple[Optics, Optics], remarks: list[str],
) -> Fitted:  # fmt: skip
    """Return the comparison of real frames with those rendered before and after the fit."""
    images, size = real.images[held], real.images.shape[2:0:-1]
    few = slice(0, MAX_FULL_FRAMES)
    is_full = size[0] == scene.plain.width_px
    rendered = []
    for look in looks:
        frames = scene.frames(places, look)
        if not is_full:
            frames = np.stack([cv2.resize(f, size, interpolation=cv2.INTER_AREA) for f in frames])
        rendered.append(np.stack([as_delivered(one, real.jpeg_quality) for one in frames]))
    little = scene.floor_of(small(images))
    half = len(little) // 2
    sets = [(images, colour_distance(little[:half], little[half:]))]
    sets += [(one, colour_distance(scene.floor_of(small(one)), little)) for one in rendered]
    figures = [
        Figures(
            distance,
            _overall(*noise(scene.floor_of(frames[few]))) if is_full else None,
            sharpness(scene.floor_of(frames[few])) if is_full else None,
        )
        for frames, distance in sets
    ]  # fmt: skip
    shown = np.unique(np.linspace(0, len(images) - 1, 4).astype(int))
    rows = [np.hstack([_thumb(frames[i]) for i in shown]) for frames in (*rendered, images)]
    measured, before, after = figures
    return Fitted(looks[1], measured, before, after, tuple(remarks), np.vstack(rows))


def _overall(sigma: Floats, pixels: Floats) -> float:
    """Return the noise of all grey levels."""
    known = np.isfinite(sigma)
    return float(np.sqrt(np.average(sigma[known] ** 2, weights=pixels[known])))


def _thumb(image: Image) -> Image:
    size = (320, round(320 * image.shape[0] / image.shape[1]))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
