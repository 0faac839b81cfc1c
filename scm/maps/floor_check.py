"""Doubts a map's floor data: grip, rolling, heights and wind that no car could drive on or in."""

from collections.abc import Iterator

import numpy as np

from scm.maps.floor_shapes import is_convex, signed_area, slope_of
from scm.maps.grey import unpack
from scm.records.city_map import CityMap
from scm.records.floor import Floor, FrictionMap, HeightMap, Patch, Plate, Samples

MOST_GRIP, MOST_ROLLING = 2.0, 0.5
MAX_SLOPE = 0.35  # of a ramp; no car climbs more
MAX_PIXEL_SLOPE = 1.0  # of a height picture, at a single edge
MAX_HEIGHT_M = 2.0
MAX_RIM_HEIGHT_M = 0.001  # so that the floor has no step around a picture
MAX_WIND_MPS = 50.0


def floor_problems(city_map: CityMap) -> Iterator[str]:
    """Yield every problem of the floor and the wind, as `key (name): expected .., got ..`."""
    floor = city_map.floor
    yield from _holds("floor", floor.grip, floor.rolling)
    for index, patch in enumerate(floor.patches):
        where = f"floor.patches[{index}] ({patch.name})"
        yield from _holds(where, patch.grip, patch.rolling)
        yield from _one_shape(where, patch)
    for index, plate in enumerate(floor.plates):
        where = f"floor.plates[{index}] ({plate.name})"
        yield from _one_shape(where, plate)
        yield from _within(f"{where}.height_m", plate.height_m, 0.0, MAX_HEIGHT_M)
        if len(plate.points) > 2 and not is_convex(plate.points):
            yield f"{where}.points: expected a convex outline, got a corner that points inwards"
    yield from _ramps(floor)
    if floor.friction_map is not None:
        yield from _friction_map(floor.friction_map)
    if floor.height_map is not None:
        yield from _height_map(floor.height_map, floor)
    for key in ("x_mps", "y_mps"):
        speed = getattr(city_map.wind, key)
        yield from _within(f"wind.{key}", speed, -MAX_WIND_MPS, MAX_WIND_MPS)
    yield from _within("wind.gust_mps", city_map.wind.gust_mps, 0.0, MAX_WIND_MPS)


def _within(where: str, value: float, low: float, high: float) -> Iterator[str]:
    if not low <= value <= high:
        yield f"{where}: expected {low:g} to {high:g}, got {value:g}"


def _holds(where: str, grip: float, rolling: float) -> Iterator[str]:
    yield from _within(f"{where}.grip", grip, 0.0, MOST_GRIP)
    yield from _within(f"{where}.rolling", rolling, 0.0, MOST_ROLLING)


def _one_shape(where: str, shape: Patch | Plate) -> Iterator[str]:
    """Doubt that exactly one shape is given, whole."""
    kinds = {
        "points": bool(shape.points),
        "radius_m": getattr(shape, "radius_m", None) is not None,
        "length_m and width_m": shape.length_m is not None or shape.width_m is not None,
    }
    given = [kind for kind, is_given in kinds.items() if is_given]
    choice = "points, or x_m and y_m with "
    choice += "radius_m or " if isinstance(shape, Patch) else ""
    if len(given) != 1:
        yield (
            f"{where}: expected {choice}length_m and width_m; got {' and '.join(given) or 'none'}"
        )
    elif shape.points:
        if len(shape.points) < 3 or signed_area(shape.points) == 0.0:
            yield f"{where}.points: expected at least 3 around an area, got {len(shape.points)}"
    else:
        sizes = () if given == ["radius_m"] else ("length_m", "width_m")
        missing = [key for key in ("x_m", "y_m", *sizes) if getattr(shape, key) is None]
        if missing:
            yield f"{where}: key {', '.join(missing)} is missing"


def _ramps(floor: Floor) -> Iterator[str]:
    for index, ramp in enumerate(floor.ramps):
        where = f"floor.ramps[{index}] ({ramp.name})"
        for key in ("from_m", "to_m"):
            yield from _within(f"{where}.{key}", getattr(ramp, key), -MAX_HEIGHT_M, MAX_HEIGHT_M)
        if ramp.length_m > 0.0 and abs(slope_of(ramp)) > MAX_SLOPE:
            yield (
                f"{where}: expected a slope of at most {MAX_SLOPE:g}, got {slope_of(ramp):.3g} "
                "(to_m - from_m over length_m): make it longer, or a step with a plate"
            )


def _extent(where: str, picture: FrictionMap | HeightMap) -> Iterator[str]:
    for key, (low, high) in (("x_m", picture.x_m), ("y_m", picture.y_m)):
        if not low < high:
            yield f"{where}.{key}: expected [low, high], got [{low}, {high}]"


def _friction_map(picture: FrictionMap) -> Iterator[str]:
    where = "floor.friction_map"
    yield from _extent(where, picture)
    for key, most in (("grip", MOST_GRIP), ("rolling", MOST_ROLLING)):
        for shade, value in zip(("black", "white"), getattr(picture, key), strict=True):
            yield from _within(f"{where}.{key} ({shade})", value, 0.0, most)


def _height_map(picture: HeightMap, floor: Floor) -> Iterator[str]:
    where = "floor.height_map"
    extent = list(_extent(where, picture))
    yield from extent
    if picture.samples is not None and not extent:
        yield from _heights(where, picture, picture.samples)
        yield from _rim(where, picture, picture.samples, floor)


def _rim(where: str, picture: HeightMap, samples: Samples, floor: Floor) -> Iterator[str]:
    """Doubt that the picture ends level, unless it covers all of the floor."""
    sides = ((picture.x_m, floor.x_m), (picture.y_m, floor.y_m))
    if all(low <= begin and end <= high for (low, high), (begin, end) in sides):
        return
    heights = (unpack(samples) - picture.zero_grey) * picture.m_per_grey
    rim = (heights[0], heights[-1], heights[:, 0], heights[:, -1])
    highest = max(float(np.abs(edge).max()) for edge in rim)
    if highest > MAX_RIM_HEIGHT_M:
        yield (
            f"{where}.zero_grey: expected the picture's rim at height 0 "
            f"within {MAX_RIM_HEIGHT_M:g} m, for "
            f"the floor around it is level; got up to {highest:.3g} m"
        )


def _heights(where: str, picture: HeightMap, samples: Samples) -> Iterator[str]:
    """Doubt the heights that the picture gives."""
    heights = (unpack(samples) - picture.zero_grey) * picture.m_per_grey
    low, high = float(heights.min()), float(heights.max())
    if max(-low, high) > MAX_HEIGHT_M:
        yield (
            f"{where}.m_per_grey: expected heights within {MAX_HEIGHT_M:g} m, "
            f"got {low:.3g} to {high:.3g} m"
        )
    rows, columns = heights.shape
    across = (picture.x_m[1] - picture.x_m[0]) / columns
    along = (picture.y_m[1] - picture.y_m[0]) / rows
    steepest = max(
        float(np.abs(np.diff(heights, axis=1)).max()) / across,
        float(np.abs(np.diff(heights, axis=0)).max()) / along,
    )
    if steepest > MAX_PIXEL_SLOPE:
        yield (
            f"{where}.m_per_grey: expected slopes of at most {MAX_PIXEL_SLOPE:g} between pixels, "
            f"got {steepest:.3g}: for a step, use a plate"
        )
