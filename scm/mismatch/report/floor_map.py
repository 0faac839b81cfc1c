"""The floor map of a residual: the car's path, coloured and widened by the force left out."""

from collections.abc import Iterator, Sequence

import numpy as np

from scm.arrays import Floats, Ints
from scm.maps.svg import element
from scm.mismatch.evidence import Residual
from scm.mismatch.findings import Located, Place
from scm.mismatch.report.plot import (
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

WIDTH, HEIGHT = 520.0, 430.0
_MARGINS = (14.0, 14.0, 14.0, 62.0)
_MOST_POINTS = 4000
_CLASSES = 9
_WIDTHS = (5.5, 4.4, 3.4, 2.6, 1.8)  # by distance from the ends of the scale


def floor_map(residual: Residual, located: Sequence[Located], number: int) -> Picture:
    """Return the map of one residual with the places that were found."""
    bound = colour_bound(residual.before)
    x, y = residual.x_m, residual.y_m
    places = [found.where for found in located if found.where is not None]
    corners = np.array([c for p in places for c in zip(p.x_m, p.y_m, strict=True)]).reshape(-1, 2)
    room = on_a_floor(
        frame(
            span_of(x, corners[:, 0]),
            span_of(y, corners[:, 1]),
            (WIDTH, HEIGHT),
            margins=_MARGINS,
        )
    )
    parts = [
        *(_place(room, place) for place in places),
        *_path(room, residual, bound),
        *scale_bar(room),
        *_colour_bar(residual, bound),
    ]
    where = "; the boxes are where the error was found to lie" if places else ""
    return Picture(
        name=f"floor_{number}",
        title=f"Where: {residual.channel} that the simulator leaves out",
        said="The car's way on the floor, seen from above. Grey and thin: the simulator is right "
        f"there. Blue or orange and wide: something else acts on the car{where}.",
        svg=picture_svg(WIDTH, HEIGHT, parts, f"Floor map of {residual.channel}"),
    )


def colour_bound(values: Floats) -> float:
    """Return the value at which colours end: the 98th percentile, so that one outlier is none."""
    known = np.abs(values[np.isfinite(values)])
    return float(np.percentile(known, 98)) or 1.0 if len(known) else 1.0


def colour_class(values: Floats, bound: float) -> Ints:
    """Return 0 (far below zero) to 8 (far above); 4 is about zero."""
    share = np.nan_to_num(np.clip(values / bound, -1.0, 1.0))
    return np.rint((share + 1.0) * 0.5 * (_CLASSES - 1)).astype(np.int64)


def _path(room: Frame, residual: Residual, bound: float) -> Iterator[str]:
    """Yield the way, one path a colour, the strongest drawn last."""
    keep = slice(None, None, max(1, len(residual.t_s) // _MOST_POINTS))
    x, y, t_s = residual.x_m[keep], residual.y_m[keep], residual.t_s[keep]
    kinds = colour_class(residual.before[keep], bound)
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


def _colour_bar(residual: Residual, bound: float) -> Iterator[str]:
    """Yield the scale of colours with its unit."""
    left, wide, y = 130.0, 28.0, HEIGHT - 38.0
    for kind in range(_CLASSES):
        x = left + wide * kind
        data = f"M{x:.1f} {y:.1f}h{wide:.1f}"
        yield element("path", d=data, class_=f"d{kind}", stroke_width=11, stroke_linecap="butt")
    ends = ((0.0, -bound), (0.5, 0.0), (1.0, bound))
    for share, value in ends:
        number = f"{value:+.2g}".replace("-", "\N{MINUS SIGN}") if value else "0"
        yield text(left + wide * _CLASSES * share, y + 23, number, "middle")
    yield text(left + wide * _CLASSES + 10, y + 4, f"{residual.channel} [{residual.unit}]")
