"""The floor's picture: slippery and soft places, hills, ramps, plates, and the wind, all faint.

Blue: less grip; orange: more rolling resistance; light: higher, dark: lower ground.
"""

import itertools
import math

import numpy as np

from scm.arrays import Floats
from scm.geometry import Pose2
from scm.maps.floor_shapes import outline_of, ramp_outline
from scm.maps.grey import full_scale, unpack
from scm.maps.svg import element, label, layer, outline, placed
from scm.records.city_map import CityMap
from scm.records.floor import Floor, FrictionMap, HeightMap, Patch, Plate, Ramp

ICE, SAND, LIGHT, DARK, INK = "#8fd3ff", "#e0a35a", "#ffffff", "#000000", "#23272e"
MAX_CELLS = 72  # a side of a drawn picture
SHADES = 8
MAX_OPACITY = 0.55  # of a surface over the lanes
FULL_ROLLING = 0.1
CHEVRON_M = 0.05


def floor_layers(city_map: CityMap) -> str:
    """Return what the floor is like, as layers above the road and below its paint."""
    floor = city_map.floor
    pictures = []
    if floor.height_map is not None:
        pictures += _hills(floor.height_map)
    if floor.friction_map is not None:
        pictures += _ice(floor.friction_map, floor)
    return (
        layer("floor-maps", pictures)
        + layer("patches", map(_patch, floor.patches))
        + layer("plates", map(_plate, floor.plates))
        + layer("ramps", map(_ramp, floor.ramps))
    )


def wind_arrow(city_map: CityMap, x: float, y: float) -> str:
    """Return an arrow the way the wind blows, with its speed; empty in still air."""
    wind = city_map.wind
    speed = math.hypot(wind.x_mps, wind.y_mps)
    if not speed and not wind.gust_mps:
        return ""
    yaw = math.atan2(wind.y_mps, wind.x_mps)
    shaft = element("path", d="M-0.05 0H0.03", stroke="#7f8792", stroke_width=0.012)
    head = element("path", d="M0.02 -0.026L0.065 0L0.02 0.026Z", fill="#7f8792")
    text = f"wind {speed:g} m/s" + (f", gusts {wind.gust_mps:g} m/s" if wind.gust_mps else "")
    caption = label(text, x - 0.09, y, 0.055, fill="#7f8792", text_anchor="end")
    arrow = element("g", shaft, head, transform=placed(Pose2(x, y, yaw)))
    return element("g", arrow, caption, class_="wind")


def _patch(patch: Patch) -> str:
    data = outline(outline_of(patch), closed=True)
    fill, strength = _tint(patch.grip, patch.rolling)
    caption = [f"grip {patch.grip:g}"] if patch.grip != 1.0 else []
    caption += [f"rolling {patch.rolling:g}"] if patch.rolling else []
    shape = element(
        "path", d=data, fill=fill, fill_opacity=strength, stroke=fill, stroke_opacity=0.8,
        stroke_width=0.006, stroke_dasharray="0.03 0.02",
    )  # fmt: skip
    title = element("title", f"{patch.name}: {', '.join(caption) or 'as usual'}")
    return element("g", title, shape, class_="patch", id=f"patch-{patch.name}")


def _tint(grip: float, rolling: float) -> tuple[str, float]:
    """Return colour and opacity of a floor that holds and rolls like this."""
    slippery, soft = min(abs(1.0 - grip), 1.0), min(rolling / FULL_ROLLING, 1.0)
    return (ICE if slippery >= soft else SAND), MAX_OPACITY * max(slippery, soft, 0.2)


def _plate(plate: Plate) -> str:
    shape = element(
        "path", d=outline(outline_of(plate), closed=True), fill=LIGHT, fill_opacity=0.16,
        stroke=LIGHT, stroke_opacity=0.75, stroke_width=0.006,
    )  # fmt: skip
    title = element("title", f"{plate.name}: {1e3 * plate.height_m:g} mm high")
    return element("g", title, shape, class_="plate", id=f"plate-{plate.name}")


def _ramp(ramp: Ramp) -> str:
    """Return a ramp with chevrons that point uphill."""
    up = 1.0 if ramp.to_m >= ramp.from_m else -1.0
    a, b = 0.5 * ramp.length_m, 0.5 * ramp.width_m
    half, count = min(0.6 * b, 0.12), max(1, round(ramp.length_m / 0.16))
    chevrons = "".join(
        f"M{x - up * CHEVRON_M:.4f} {-half:.4f}L{x + up * CHEVRON_M:.4f} 0"
        f"L{x - up * CHEVRON_M:.4f} {half:.4f}"
        for x in (-a + (k + 0.5) * ramp.length_m / count for k in range(count))
    )
    shape = element(
        "path", d=outline(ramp_outline(ramp), closed=True), fill=LIGHT, fill_opacity=0.1,
        stroke=LIGHT, stroke_opacity=0.6, stroke_width=0.006,
    )  # fmt: skip
    marks = element(
        "path", d=chevrons, fill="none", stroke=LIGHT, stroke_opacity=0.45, stroke_width=0.012,
        transform=placed(Pose2(ramp.x_m, ramp.y_m, ramp.yaw_rad)),
    )  # fmt: skip
    text = f"{ramp.name}: from {1e3 * ramp.from_m:g} mm to {1e3 * ramp.to_m:g} mm"
    title = element("title", text)
    return element("g", title, shape, marks, class_="ramp", id=f"ramp-{ramp.name}")


def _ice(picture: FrictionMap, floor: Floor) -> list[str]:
    """Return a friction map as rows of faint rectangles, by how far it is from the usual floor."""
    if picture.samples is None:
        return []
    grey = _coarse(unpack(picture.samples) / full_scale(picture.samples))
    grip = picture.grip[0] + grey * (picture.grip[1] - picture.grip[0])
    rolling = picture.rolling[0] + grey * (picture.rolling[1] - picture.rolling[0])
    slippery = np.clip(1.0 - grip, 0.0, 1.0)
    soft = np.clip((rolling - floor.rolling) / FULL_ROLLING, 0.0, 1.0)
    drawn = _shaded(slippery, picture, ICE, "friction-map")
    return drawn + _shaded(soft, picture, SAND, "rolling-map")


def _hills(picture: HeightMap) -> list[str]:
    if picture.samples is None:
        return []
    heights = _coarse((unpack(picture.samples) - picture.zero_grey) * picture.m_per_grey)
    most = max(float(np.abs(heights).max()), 1e-9)
    up, down = np.clip(heights / most, 0.0, 1.0), np.clip(-heights / most, 0.0, 1.0)
    drawn = _shaded(up, picture, LIGHT, "height-map")
    return drawn + _shaded(down, picture, DARK, "height-map")


def _coarse(picture: Floats) -> Floats:
    """Return a picture of at most `MAX_CELLS` a side, each the mean of what it covers."""
    for axis in (0, 1):
        size = picture.shape[axis]
        edges = np.linspace(0, size, min(size, MAX_CELLS) + 1).astype(int)
        widths = np.diff(edges).reshape((-1, 1) if axis == 0 else (1, -1))
        picture = np.add.reduceat(picture, edges[:-1], axis=axis) / widths
    return picture


def _shaded(strength: Floats, picture: FrictionMap | HeightMap, fill: str, name: str) -> list[str]:
    """Return runs of cells of one shade as rectangles; rows from the lowest up."""
    rows, columns = strength.shape
    (x0, x1), (y0, y1) = picture.x_m, picture.y_m
    wide, high = (x1 - x0) / columns, (y1 - y0) / rows
    shades: dict[int, list[str]] = {}
    for row, line in enumerate(np.rint(strength * SHADES).astype(int).tolist()):
        at, top = 0, -(y0 + (row + 1) * high)
        for shade, run in itertools.groupby(line):
            length = len(list(run))
            if shade:
                start, run_m = f"M{x0 + at * wide:.4f} {top:.4f}", length * wide
                shades.setdefault(shade, []).append(f"{start}h{run_m:.4f}v{high:.4f}h{-run_m:.4f}z")
            at += length
    return [
        element(
            "path",
            d="".join(data),
            fill=fill,
            fill_opacity=MAX_OPACITY * shade / SHADES,
            class_=name,
        )
        for shade, data in sorted(shades.items())
    ]
