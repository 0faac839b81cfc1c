"""An effect as a curve: what it does against what it depends on."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from scm.maps.svg import element
from scm.mismatch.evidence import Curve
from scm.mismatch.report.plot import Frame, Picture, band, frame, grid, line, picture_svg, span_of
from scm.mismatch.report.wording import capital, title_of, unit_text

_WIDTH, _HEIGHT = 440.0, 270.0


def curve_pictures(curves: Sequence[Curve]) -> list[Picture]:
    """Return a picture of each effect; a law's line lies over what was measured without it."""
    found: dict[tuple[str, str, str], list[Curve]] = {}
    for curve in curves:
        if len(curve.x):
            key = (curve.effect, curve.x_name, curve.y_name)
            found.setdefault(key, []).append(_one_turn(curve))
    return [_picture(group, number) for number, group in enumerate(found.values(), start=1)]


def _picture(curves: Sequence[Curve], number: int) -> Picture:
    """Draw a line in its band, and dots with whiskers in their place where a law is drawn too."""
    first, laws = curves[0], curves[1:]
    room = frame(
        span_of(*(c.x for c in curves), room=0.0),
        span_of(*(side for c in curves for side in (c.y, c.low, c.high)), through_zero=True),
        (_WIDTH, _HEIGHT),
        margins=(58.0, 14.0, 34.0, 44.0),
    )
    x_unit, y_unit = unit_text(first.x_unit), unit_text(first.y_unit)
    parts = [
        *grid(room, _axis_title(first.x_name, x_unit), _axis_title(first.y_name, y_unit)),
        *(line(room, law.x, law.y, "after") for law in laws),
    ]
    if laws:
        parts += _dots(room, first)
    else:
        parts += [
            band(room, first.x, first.low, first.high, "band-after"),
            line(room, first.x, first.y, "after"),
        ]
    title = capital(title_of(first.effect))
    against = f"{capital(first.y_name)} against {first.x_name}"
    said = "the area holds the truth with 90 %."
    if laws:
        said = "the line is the law. Dots are free of its form; bars hold the truth with 90 %."
    return Picture(
        name=f"curve_{number}",
        title=title,
        said=f"{against}; {said}",
        svg=picture_svg(_WIDTH, _HEIGHT, parts, title),
    )


def _dots(room: Frame, curve: Curve) -> Iterator[str]:
    for x, *sides in zip(curve.x, curve.low, curve.y, curve.high, strict=True):
        if math.isfinite(x) and all(map(math.isfinite, sides)):
            across = f"{room.across.at(float(x)):.1f}"
            low, y, high = (f"{room.up.at(float(side)):.1f}" for side in sides)
            yield element("path", d=f"M{across} {low}V{high}", class_="whisker")
            yield element("circle", cx=across, cy=y, r="3.5", class_="dot")


def _one_turn(curve: Curve) -> Curve:
    """Return a curve against heading over one turn, in degrees; any other as it is."""
    if curve.x_unit != "rad" or "heading" not in curve.x_name:
        return curve
    turned = np.degrees(np.arctan2(np.sin(curve.x), np.cos(curve.x)))
    order = np.argsort(turned, kind="stable")
    sides = {side: getattr(curve, side)[order] for side in ("y", "low", "high")}
    return replace(curve, x=turned[order], x_unit="°", **sides)


def _axis_title(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name
