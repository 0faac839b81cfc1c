"""Pictures of what stands beside the road: signal heads and traffic signs."""

import math
from collections.abc import Callable

from scm.geometry import Pose2
from scm.maps.signs import SPEED_LIMIT, TURNS
from scm.maps.svg import element, label, placed
from scm.records.city_map import Light, Sign

LAMPS = (("red", 0.046, "#5c2a2a"), ("yellow", 0.0, "#5a4a22"), ("green", -0.046, "#234a33"))
RED, BLUE, INK, PAPER = "#c62f35", "#2b5ea8", "#23272e", "#fbfbf8"


def light(head: Light) -> str:
    """Return a head as seen from the road: three dark lamps, its number, and where it looks.

    The group has id `light-N`, its lamps `light-N-red` and so on, with class `lamp`.
    """
    name = f"light-{head.light_id}"
    beside = -math.copysign(0.066, math.cos(head.yaw_rad))  # the number stands behind the head
    beam = element(
        "path",
        d="M0 0L0.15 -0.065A0.165 0.165 0 0 1 0.15 0.065Z",
        fill=PAPER,
        fill_opacity=0.4,
        class_="beam",
        transform=f"rotate({-math.degrees(head.yaw_rad):.2f})",
    )
    housing = element(
        "rect",
        x=-0.036,
        y=-0.079,
        width=0.072,
        height=0.158,
        rx=0.022,
        fill=INK,
        stroke=PAPER,
        stroke_width=0.006,
        class_="housing",
    )
    lamps = [
        element(
            "circle",
            id=f"{name}-{colour}",
            class_=f"lamp {colour}",
            cx=0.0,
            cy=-up,
            r=0.019,
            fill=dark,
        )
        for colour, up, dark in LAMPS
    ]
    return element(
        "g",
        element("title", f"Light {head.light_id}: {head.junction}, {head.group}"),
        beam,
        housing,
        *lamps,
        label(str(head.light_id), beside, 0.0, 0.055, fill=INK, font_weight="700"),
        id=name,
        class_="light",
        data_light=str(head.light_id),
        data_junction=head.junction,
        data_group=head.group,
        transform=placed(Pose2(head.x_m, head.y_m, 0.0)),
    )


def sign(post: Sign) -> str:
    """Return a sign's face, upright, with the way it looks."""
    beam = element(
        "path",
        d="M0 0L0.1 -0.04A0.11 0.11 0 0 1 0.1 0.04Z",
        fill=PAPER,
        fill_opacity=0.4,
        class_="beam",
        transform=f"rotate({-math.degrees(post.yaw_rad):.2f})",
    )
    if post.kind in TURNS:
        face = _turn_plate(post.kind)
    elif post.kind == SPEED_LIMIT:
        face = _limit(post.value_mps or 0.0)
    else:
        face = _FACES.get(post.kind, _unknown)()
    return element(
        "g",
        element("title", f"Sign {post.sign_id}: {post.kind.replace('_', ' ')}"),
        beam,
        face,
        id=f"sign-{post.sign_id}",
        class_=f"sign {post.kind}",
        transform=placed(Pose2(post.x_m, post.y_m, 0.0)),
    )


def _triangle(up: float) -> str:
    """Return the white triangle with a red border; `up` is 1, or -1 to stand on its tip."""
    points = " ".join(f"{x},{-up * y}" for x, y in ((-0.05, -0.034), (0.05, -0.034), (0.0, 0.052)))
    return element(
        "polygon",
        points=points,
        fill=PAPER,
        stroke=RED,
        stroke_width=0.013,
        stroke_linejoin="round",
    )


def _curve(side: float) -> str:
    """Return a curve warning; `side` is 1 for left."""
    x = -side
    bend = element(
        "path",
        d=f"M{0.008 * x:.3f} 0.025V0.006Q{0.008 * x:.3f} -0.008 {0.018 * x:.3f} -0.008",
        fill="none",
        stroke=INK,
        stroke_width=0.009,
    )
    tip = element(
        "path", d=f"M{0.015 * x:.3f} -0.02L{0.03 * x:.3f} -0.008L{0.015 * x:.3f} 0.004Z", fill=INK
    )
    shift = element("g", bend, tip, transform=f"translate({-0.013 * x:.3f} 0.006)")
    return _triangle(1.0) + shift


def _stop() -> str:
    corners = [math.radians(22.5 + 45.0 * k) for k in range(8)]
    points = " ".join(f"{0.05 * math.cos(a):.4f},{0.05 * math.sin(a):.4f}" for a in corners)
    plate = element("polygon", points=points, fill=RED, stroke=PAPER, stroke_width=0.006)
    return plate + label("STOP", 0.0, 0.0, 0.026, fill=PAPER, font_weight="700")


def _limit(value_mps: float) -> str:
    """Return a speed limit in metres a second."""
    plate = element("circle", r=0.044, fill=PAPER, stroke=RED, stroke_width=0.013)
    text = f"{value_mps:.2f}".rstrip("0").rstrip(".").removeprefix("0")
    return plate + label(text, 0.0, 0.0, 0.034, fill=INK, font_weight="700")


def _turn_plate(kind: str) -> str:
    """Return an arrow: white on blue where one must turn so, black and crossed out where not."""
    rule, way = kind.split("_")
    only = rule == "only"
    ring = {"fill": BLUE, "stroke": PAPER} if only else {"fill": PAPER, "stroke": RED}
    ink = PAPER if only else INK
    plate = element("circle", r=0.046, stroke_width=0.008, **ring)
    shaft = element("path", d="M0 0.028V-0.012", fill="none", stroke=ink, stroke_width=0.01)
    tip = element("path", d="M-0.016 -0.01L0 -0.032L0.016 -0.01Z", fill=ink)
    turned = {"left": "rotate(-90)", "right": "rotate(90)", "straight": None}[way]
    arrow = element("g", shaft, tip, transform=turned)
    bar = element("path", d="M-0.032 -0.032L0.032 0.032", stroke=RED, stroke_width=0.009)
    return plate + arrow + ("" if only else bar)


def _unknown() -> str:
    plate = element("circle", r=0.045, fill=PAPER, stroke=INK, stroke_width=0.006)
    return plate + label("?", 0.0, 0.0, 0.05, fill=INK)


_FACES: dict[str, Callable[[], str]] = {
    "left_curve": lambda: _curve(1.0),
    "right_curve": lambda: _curve(-1.0),
    "stop": _stop,
    "give_way": lambda: _triangle(-1.0),
}
