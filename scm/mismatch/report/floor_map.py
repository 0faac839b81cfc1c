"""The floor map of a residual: the car's path, coloured and widened by the force left out."""

from collections.abc import Iterator, Sequence

import numpy as np

from scm.arrays import Floats, Ints
from scm.data_quality.problem import Span
from scm.maps.svg import element
from scm.mismatch.evidence import Residual
from scm.mismatch.findings import Located, Place
from scm.mismatch.report.plot import (
    BAND_STDS,
    Frame,
    Picture,
    frame,
    line_data,
    on_a_floor,
    picture_svg,
    scale_bar,
    span_of,
    text,
)
from scm.mismatch.report.wording import short, unit_text

WIDTH = 440.0
_LOWEST, _HIGHEST = 130.0, 400.0  # of the floor in the picture
_MARGINS = (14.0, 14.0, 14.0, 82.0)
_MOST_POINTS = 4000
_CLASSES = 9
_WIDTHS = (5.5, 4.4, 3.4, 2.6, 1.8)  # by distance from the ends of the scale


def floor_map(residual: Residual, located: Sequence[Located], number: int) -> Picture:
    """Return the map of one residual with the places that were found."""
    bound = colour_bound(residual)
    x, y = residual.x_m, residual.y_m
    places = [found.where for found in located if found.where is not None]
    corners = np.array([c for p in places for c in zip(p.x_m, p.y_m, strict=True)]).reshape(-1, 2)
    spans = span_of(x, corners[:, 0]), span_of(y, corners[:, 1])
    height = _height(*spans)
    room = on_a_floor(frame(*spans, (WIDTH, height), margins=_MARGINS))
    parts = [
        *(_place(room, place) for place in places),
        *_path(room, residual, bound),
        *scale_bar(room),
        *_colour_bar(residual, bound, height - 36.0),
    ]
    return Picture(
        name=f"floor_{number}",
        title=f"Unexplained {residual.channel}",
        said="",
        svg=picture_svg(WIDTH, height, parts, f"Floor map of {residual.channel}"),
    )


def _height(x_span: Span, y_span: Span) -> float:
    """Return how tall the picture has to be for the floor's shape."""
    long = WIDTH - _MARGINS[0] - _MARGINS[1]
    tall = long * (y_span[1] - y_span[0]) / max(x_span[1] - x_span[0], 1e-9)
    return min(_HIGHEST, max(_LOWEST, tall)) + _MARGINS[2] + _MARGINS[3]


def colour_bound(residual: Residual) -> float:
    """Return the value at which colours end.

    That is the 98th percentile, so that one outlier is none, and at least three standard
    deviations.
    """
    values, stds = (a[np.isfinite(a)] for a in (residual.before, residual.std))
    strong = float(np.percentile(np.abs(values), 98)) if len(values) else 0.0
    return max(strong, 3.0 * float(np.median(stds)) if len(stds) else 0.0) or 1.0


def colour_class(values: Floats, stds: Floats, bound: float) -> Ints:
    """Return 0 (far below zero) to 8 (far above); 4 is about zero, or no more than noise."""
    share = np.nan_to_num(np.clip(values / bound, -1.0, 1.0))
    kinds = np.rint((share + 1.0) * 0.5 * (_CLASSES - 1)).astype(np.int64)
    return np.where(np.abs(values) > BAND_STDS * np.nan_to_num(stds), kinds, _CLASSES // 2)


def _path(room: Frame, residual: Residual, bound: float) -> Iterator[str]:
    """Yield the way, one path a colour, the strongest drawn last."""
    keep = slice(None, None, max(1, len(residual.t_s) // _MOST_POINTS))
    x, y, t_s = residual.x_m[keep], residual.y_m[keep], residual.t_s[keep]
    kinds = colour_class(residual.before[keep], residual.std[keep], bound)
    known = np.isfinite(x) & np.isfinite(y) & np.isfinite(residual.before[keep])
    if not known.any():
        return
    usual = float(np.median(np.diff(t_s))) if len(t_s) > 1 else 0.0
    joined = known[1:] & known[:-1] & (np.diff(t_s) <= 5.0 * usual)
    for kind in sorted(range(_CLASSES), key=lambda k: abs(k - 4)):
        data = "".join(
            line_data(room.across, room.up, x[a:b], y[a:b]) for a, b in _runs(kinds, joined, kind)
        )
        if data:
            wide = _WIDTHS[min(kind, _CLASSES - 1 - kind)]
            yield element("path", d=data, class_=f"d{kind}", stroke_width=wide)
    first = int(np.argmax(known))
    across, up = room.across.at(float(x[first])), room.up.at(float(y[first]))
    yield element("circle", cx=f"{across:.1f}", cy=f"{up:.1f}", r="4", class_="start")
    yield text(across + 7, up - 6, "start")


def _runs(kinds: Ints, joined: np.ndarray, kind: int) -> Iterator[tuple[int, int]]:
    """Yield stretches of one colour, each with the point after it, so that no gap shows."""
    mine = np.concatenate(([False], (kinds[:-1] == kind) & joined, [False]))
    edges = np.flatnonzero(np.diff(mine.astype(np.int8)))
    yield from ((int(a), int(b) + 1) for a, b in zip(edges[::2], edges[1::2], strict=True))


def _place(room: Frame, place: Place) -> str:
    left, right = (room.across.at(x) for x in place.x_m)
    low, high = (room.up.at(y) for y in place.y_m)
    data = f"M{left:.1f} {low:.1f}H{right:.1f}V{high:.1f}H{left:.1f}Z"
    return element("path", d=data, class_="place")


def _colour_bar(residual: Residual, bound: float, y: float) -> Iterator[str]:
    """Yield the scale of colours with its unit."""
    left, wide = 30.0, 26.0
    for kind in range(_CLASSES):
        x = left + wide * kind
        data = f"M{x:.1f} {y:.1f}h{wide:.1f}"
        yield element("path", d=data, class_=f"butt d{kind}", stroke_width=11)
    ends = ((0.0, -bound), (0.5, 0.0), (1.0, bound))
    for share, value in ends:
        number = ("+" if value > 0.0 else "") + short(float(f"{value:.2g}"))
        yield text(left + wide * _CLASSES * share, y + 23, number, "middle")
    yield text(
        left + wide * _CLASSES + 10, y + 4, f"{residual.channel} [{unit_text(residual.unit)}]"
    )
