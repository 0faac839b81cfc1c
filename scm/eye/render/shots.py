"""Frames of an overhead camera with ground truth: where things are, and how much is visible.

    shots = Studio(load_map("driving_school"), camera, Look(exposure_s=0.004, noise_sigma=8.0))
    shot = shots.shoot([tour.at(t_s) for tour in tours(...)], t_ns)

Static scenery is drawn once; per frame only the windows around cars and hands are redrawn.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import msgspec
import numpy as np
from numpy.typing import NDArray

from scm.arrays import Floats, Image
from scm.eye.camera import CameraModel
from scm.eye.render import effects
from scm.eye.render.car import gain_at, hide_behind, tag_on_roof
from scm.eye.render.covers import Hand, Layer, make_cable, make_hand
from scm.eye.render.floor import Obstacle, draw_scenery
from scm.eye.render.motion import CarLayer, Driven, Rect, Shutter, paint_moving, seen_at
from scm.eye.render.visible import Hiding, visible_share
from scm.eye.source import grey_of
from scm.geometry import Pose2
from scm.records.city_map import CityMap
from scm.scenery.bodies import car_body
from scm.scenery.tags import PRINT_SCALE, tag_corners

Light = NDArray[np.float32]
COVER_HEIGHT_M = 0.35
MID_GREY = 128.0


@dataclass(frozen=True, slots=True)
class Look:
    """Effects of camera, light and people on the picture; 0 each: none.

    Attributes:
        exposure_s: Exposure of each row.
        rolling_s: From the first row's exposure to the last's.
        blur_px: Motion blur of the whole picture, as of a shaking camera, along `blur_rad`.
        defocus_px: Radius of the blur disc.
        vignetting: Share of the light lost at the corners.
        gradient: How much brighter one side is than the other, as a share.
        lamps: Number of lamps that light their surroundings more, at random places.
        glares: Number of reflections of lamps on floor and tags, likewise.
        noise_sigma: Noise of a pixel of grey 128, half its variance from the light; it is
            `sigma^2 = read^2 + shot^2 grey / 255` with both from that.
        hands, cables: How many are in view.
        jpeg: Quality from 1 to 100; None: not compressed.
        colour: False: frames are grey, (height, width), which costs less.
    """

    exposure_s: float = 0.0
    rolling_s: float = 0.0
    blur_px: float = 0.0
    blur_rad: float = 0.0
    defocus_px: float = 0.0
    vignetting: float = 0.0
    gradient: float = 0.0
    lamps: int = 0
    glares: int = 0
    noise_sigma: float = 0.0
    hands: int = 0
    cables: int = 0
    jpeg: int | None = None
    colour: bool = True


@dataclass(frozen=True, slots=True, eq=False)
class TagTruth:
    """Ground truth of a tag in the picture.

    Attributes:
        corners_px: As `TagSeen` orders them, each at the middle of the exposure of its own row;
            (4, 2), inside the frame or not.
        visible: Visible share of its print, margin included.
        smear_px: Its movement in the picture during a row's exposure.
    """

    corners_px: Floats
    visible: float
    smear_px: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Shot:
    """A frame with its ground truth.

    Attributes:
        image: (height, width, 3) blue, green, red, or (height, width) grey.
        t_ns: The middle of the exposure of the middle row.
        cars: Each car's pose and motion at `t_ns`.
        tags: By id, the map's included, also those out of view.
        camera: The true one.
    """

    image: Image
    t_ns: int
    cars: tuple[Driven, ...]
    tags: Mapping[int, TagTruth]
    camera: CameraModel


class Studio:
    """Takes pictures of cars on a map.

    Args:
        city_map: Any; movable boxes stand where the map has them.
        model: The camera.
        look: Effects on the picture.
        seed: Of all random choices.
    """

    def __init__(
        self, city_map: CityMap, model: CameraModel, look: Look | None = None, seed: int = 0
    ) -> None:
        self.model, self.look, self._tag = model, look or Look(), city_map.tag
        width, height = model.camera.width_px, model.camera.height_px
        look_rng, floor_rng, noise_rng = (np.random.default_rng([seed, k]) for k in range(3))
        boxes = tuple(msgspec.structs.replace(box, mass_kg=None) for box in city_map.boxes)
        fixed = msgspec.structs.replace(city_map, boxes=boxes)
        self._scenery = draw_scenery(fixed, model, floor_rng)
        self._raw = self._scenery.picture.copy()
        self._shutter = Shutter(self.look.exposure_s, self.look.rolling_s, height)
        self._car_layer = CarLayer(width, height)
        self._kernel = _kernel(self.look)
        self._gain = _light(self.look, width, height, look_rng)
        self._added = _glares(self.look, width, height, look_rng)
        self._cables, self._hands = _covers(self.look, model, city_map, look_rng)
        self._noise = _noise(self.look, width, height, noise_rng)
        self._still = self._raw.copy()
        for top in range(0, height, 256):
            self._develop(self._still, (0, top, width, min(height, top + 256)), self._cables)
        self._out = self._still.copy()
        self._used: list[Rect] = []

    def shoot(self, cars: Sequence[Driven], t_ns: int = 0) -> Shot:
        """Return a picture of cars at a time; its image belongs to the caller."""
        for left, top, right, bottom in self._used:
            part = slice(top, bottom), slice(left, right)
            self._raw[part] = self._scenery.picture[part]
            self._out[part] = self._still[part]
        layers = (*self._cables, *(hand.at(t_ns * 1e-9) for hand in self._hands))
        hidings = self._paint(cars)
        pad = 0 if self._kernel is None else len(self._kernel) // 2
        rects = [hiding.rect for hiding in hidings.values()]
        rects += [layer.rect() for layer in layers[len(self._cables) :]]
        camera = self.model.camera
        self._used = [
            clipped
            for rect in rects
            if (clipped := _inside(rect, pad, camera.width_px, camera.height_px))
        ]
        for rect in self._used:
            self._develop(self._out, rect, layers)
        tags = self._tags(cars, hidings, layers)
        return Shot(self._finished(), t_ns, tuple(cars), tags, self.model)

    def _paint(self, cars: Sequence[Driven]) -> dict[str, Hiding]:
        """Paint all cars, the farthest first; return by name what each hides."""
        x, y, _ = self.model.position
        far_first = sorted(cars, key=lambda one: -math.hypot(one.pose.x - x, one.pose.y - y))
        found: dict[str, Hiding] = {}
        for order, driven in enumerate(far_first):
            foot = self.model.project(np.array([driven.pose.x, driven.pose.y, 0.0]))
            gain = gain_at(self._scenery, foot)
            painted = paint_moving(
                self._raw, self._car_layer, self.model, driven, self._shutter, gain
            )
            if painted is None:
                continue
            (left, top, right, bottom), placed = painted
            window = self._raw[top:bottom, left:right]
            corner = np.array([left, top], dtype=np.float64)
            hide_behind(window, corner, self._scenery, placed.outline, self.model)
            hull = np.asarray(
                cv2.convexHull(placed.solid.astype(np.float32))[:, 0], dtype=np.float32
            )
            found[driven.car.vehicle] = Hiding(order, painted[0], hull, placed.outline)
        return found

    def _develop(self, onto: Image, rect: Rect, layers: Sequence[Layer]) -> None:
        """Apply covers, lens and light to a window of the raw picture."""
        left, top, right, bottom = rect
        window = onto[top:bottom, left:right]
        height, width = self._raw.shape[:2]
        pad = 0 if self._kernel is None else len(self._kernel) // 2
        wide = _inside(rect, pad, width, height) or rect
        patch = self._raw[wide[1] : wide[3], wide[0] : wide[2]].copy()
        if self._added is not None:
            light = patch + self._added[wide[1] : wide[3], wide[0] : wide[2], None]
            patch = np.minimum(np.rint(light), 255.0).astype(np.uint8)
        for layer in layers:
            layer.over(patch, wide[:2])
        if self._kernel is not None:
            patch = effects.filtered(patch, self._kernel)
        patch = patch[top - wide[1] :, left - wide[0] :][: bottom - top, : right - left]
        if self._gain is not None:
            light = patch * self._gain[top:bottom, left:right, None]
            patch = np.minimum(np.rint(light), 255.0).astype(np.uint8)
        window[:] = patch

    def _finished(self) -> Image:
        image = self._out if self.look.colour else grey_of(self._out)
        if self._noise is not None:
            image = self._noise.on(image)
        if self.look.jpeg is not None:
            image = effects.jpeg(image, self.look.jpeg)
        return image.copy() if image is self._out else image

    def _tags(
        self, cars: Sequence[Driven], hidings: Mapping[str, Hiding], layers: Sequence[Layer]
    ) -> dict[int, TagTruth]:
        tag, size = self._tag, (self.model.camera.width_px, self.model.camera.height_px)
        place = Pose2(tag.x_m, tag.y_m, tag.yaw_rad)

        def on_floor(scale: float) -> Floats:
            flat = tag_corners(tag.size_m * scale)
            return self.model.project(np.array([(*place.apply(x, y), 0.0) for x, y in flat]))

        outline = np.array([place.apply(x, y) for x, y in tag_corners(tag.size_m * PRINT_SCALE)])
        share = visible_share(
            on_floor(PRINT_SCALE), size, list(hidings.values()), layers, self._before(outline)
        )
        truths = {tag.tag_id: TagTruth(on_floor(1.0), share)}
        for driven in cars:
            if not car_body(driven.car.car).has_tag:
                continue
            corners = tag_on_roof(driven.car), tag_on_roof(driven.car, PRINT_SCALE)
            seen, whole = (seen_at(self.model, driven, self._shutter, points) for points in corners)
            own = hidings.get(driven.car.vehicle)
            share = 0.0
            if own is not None:
                nearer = [one for one in hidings.values() if one.order > own.order]
                before = self._before(own.outline)
                share = visible_share(whole, size, nearer, layers, before)
            truths[driven.car.tag_id] = TagTruth(seen, share, self._smear(driven))
        return truths

    def _before(self, outline: Floats) -> list[Obstacle]:
        """Return the obstacles between the camera and an outline, (n, 2) [m]."""
        eye = self.model.position[:2]
        return [one for one in self._scenery.obstacles if one.is_before(outline, eye)]

    def _smear(self, driven: Driven) -> float:
        half = self._shutter.exposure_s / 2.0
        ends = [self.model.project(tag_on_roof(driven.after(t))) for t in (-half, half)]
        return float(np.hypot(*(ends[1] - ends[0]).T).mean())


def _inside(rect: Rect, pad: int, width: int, height: int) -> Rect | None:
    left, top = max(0, rect[0] - pad), max(0, rect[1] - pad)
    right, bottom = min(width, rect[2] + pad), min(height, rect[3] + pad)
    return None if right <= left or bottom <= top else (left, top, right, bottom)


def _kernel(look: Look) -> Floats | None:
    """Return the kernel of motion blur and defocus together, None if there is neither."""
    kernel: Floats | None = None
    if look.blur_px > 0.0:
        kernel = effects.line_kernel(look.blur_px, look.blur_rad)
    if look.defocus_px > 0.0:
        disc = effects.disc_kernel(look.defocus_px)
        if kernel is None:
            return disc
        pad = len(disc) // 2
        both = cv2.filter2D(np.pad(kernel, pad), -1, disc, borderType=cv2.BORDER_CONSTANT)
        kernel = np.asarray(both, dtype=np.float64)
    return kernel


def _light(look: Look, width: int, height: int, rng: np.random.Generator) -> Light | None:
    angle = float(rng.uniform(0.0, 2.0 * math.pi))
    places = rng.uniform(0.15, 0.85, (look.lamps, 2)) * (width, height)
    spots = [effects.LampSpot(float(x), float(y), 0.16 * width, 0.3) for x, y in places]
    if not (look.vignetting or look.gradient or spots):
        return None
    gain = effects.vignette_gain(width, height, look.vignetting)
    gain = gain * effects.light_gain(width, height, look.gradient, angle, spots)
    return gain.astype(np.float32)


def _glares(look: Look, width: int, height: int, rng: np.random.Generator) -> Light | None:
    if look.glares == 0:
        return None
    spots = [
        effects.Glare(
            float(rng.uniform(0.2, 0.8)) * width, float(rng.uniform(0.2, 0.8)) * height,
            0.06 * width, 0.014 * width, float(rng.uniform(-0.4, 0.4)),
        )
        for _ in range(look.glares)
    ]  # fmt: skip
    return effects.glare_light(width, height, spots).astype(np.float32)


def _noise(
    look: Look, width: int, height: int, rng: np.random.Generator
) -> effects.NoiseSheet | None:
    if look.noise_sigma == 0.0:
        return None
    half = look.noise_sigma / math.sqrt(2.0)
    return effects.NoiseSheet(width, height, half, half * math.sqrt(255.0 / MID_GREY), rng)


def _covers(
    look: Look, model: CameraModel, city_map: CityMap, rng: np.random.Generator
) -> tuple[tuple[Layer, ...], tuple[Hand, ...]]:
    camera = model.camera
    width, height = camera.width_px, camera.height_px
    px_per_m = camera.fx_px / max(camera.z_m - COVER_HEIGHT_M, 0.3)
    cables = []
    for _ in range(look.cables):
        ends = rng.uniform(0.1, 0.9, (2, 2)) * (width, height)
        along = int(rng.integers(2))
        ends[:, along] = (-0.02 * width, 1.02 * (width, height)[along])
        cables.append(make_cable(ends[0], ends[1], px_per_m, width, height, rng))
    hands = []
    for _ in range(look.hands):
        tip = rng.uniform(0.25, 0.75, 2) * (width, height)
        up = tip[1] > height / 2.0
        inwards = (-math.pi / 2.0 if up else math.pi / 2.0) + float(rng.uniform(-0.5, 0.5))
        hands.append(make_hand(tip, inwards, px_per_m, 0.9 * height, rng))
    return tuple(cables), tuple(hands)
