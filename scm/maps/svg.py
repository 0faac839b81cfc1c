"""Writes pieces of SVG in map metres: x right, y up (an SVG's y runs down, so it is negated here).

Only presentation attributes, no style and no script, so that a page with a strict content policy
may show it.
"""

import math
from collections.abc import Iterable
from xml.sax.saxutils import escape, quoteattr

from scm.geometry import Pose2
from scm.maps.polyline import advance, extent
from scm.records.city_map import Lane, Point

ARC_PIECE_RAD = math.radians(120.0)


def number(value: float) -> str:
    """Return a length [m] to a tenth of a millimetre, as short as it can be written."""
    return f"{round(value, 4) + 0.0:.4f}".rstrip("0").rstrip(".")


def element(tag: str, /, *children: str, **attributes: str | float | None) -> str:
    """Return one element; `_` in an attribute's name becomes `-`, None leaves it out."""
    written = "".join(
        f" {key.rstrip('_').replace('_', '-')}="
        + quoteattr(number(value) if isinstance(value, (int, float)) else value)
        for key, value in attributes.items()
        if value is not None
    )
    if not children:
        return f"<{tag}{written}/>"
    return f"<{tag}{written}>{''.join(children)}</{tag}>"


def layer(name: str, children: Iterable[str], **attributes: str | float) -> str:
    """Return a group of one kind of thing, one a line; empty if there is none of it."""
    drawn = list(children)
    if not drawn:
        return ""
    return element("g", "\n", "\n".join(drawn), "\n", class_=name, **attributes) + "\n"


def placed(pose: Pose2) -> str:
    """Return the transform that puts a thing drawn at the origin, facing +x, at a pose."""
    turn = number(-math.degrees(pose.yaw))
    return f"translate({number(pose.x)} {number(-pose.y)}) rotate({turn})"


def label(
    text: str, x: float, y: float, height: float, *, yaw_rad: float = 0.0, **attributes: str | float
) -> str:
    """Return text about its middle; drawn large and shrunk, for browsers refuse tiny fonts."""
    style = {"text_anchor": "middle", **attributes}
    turn = f" rotate({number(-math.degrees(yaw_rad))})" if yaw_rad else ""
    where = f"translate({number(x)} {number(-y)}){turn} scale(0.001)"
    return element(
        "text",
        escape(text),
        transform=where,
        font_size=number(height * 1000.0),
        font_family="system-ui, 'Segoe UI', 'DejaVu Sans', sans-serif",
        dy="0.35em",
        **style,
    )


def outline(points: Iterable[Point], *, closed: bool) -> str:
    """Return path data through points."""
    data = " L".join(f"{number(x)} {number(-y)}" for x, y in points)
    return f"M{data}{'Z' if closed else ''}"


def lane_data(lane: Lane) -> str:
    """Return path data along a lane's centre line, its arcs as true arcs.

    It ends 1 cm into what follows, so that no seam shows between two lanes.
    """
    pose = Pose2(*lane.start)
    data = [f"M{number(pose.x)} {number(-pose.y)}"]
    for segment in lane.segments:
        length, curvature = extent(segment)
        pieces = max(1, math.ceil(abs(curvature * length) / ARC_PIECE_RAD - 1e-9))
        for _ in range(pieces):
            pose = advance(pose, length / pieces, curvature)
            if curvature:
                radius = number(1.0 / abs(curvature))
                # A left turn runs against the clock, in the picture too.
                data.append(f"A{radius} {radius} 0 0 {0 if curvature > 0 else 1} ")
            else:
                data.append("L")
            data.append(f"{number(pose.x)} {number(-pose.y)}")
    if lane.next:
        beyond = advance(pose, 0.01, 0.0)
        data.append(f"L{number(beyond.x)} {number(-beyond.y)}")
    return "".join(data)
