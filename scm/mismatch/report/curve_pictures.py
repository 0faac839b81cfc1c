"""An effect as a curve: what it does against what it depends on."""

from scm.mismatch.evidence import Curve
from scm.mismatch.report.plot import Picture, band, frame, grid, line, picture_svg, span_of
from scm.mismatch.report.wording import capital, title_of, unit_text

_WIDTH, _HEIGHT = 440.0, 270.0


def curve_picture(curve: Curve, number: int) -> Picture | None:
    """Return the picture; None for a curve without points."""
    if not len(curve.x):
        return None
    room = frame(
        span_of(curve.x, room=0.0),
        span_of(curve.y, curve.low, curve.high, through_zero=True),
        (_WIDTH, _HEIGHT),
        margins=(58.0, 14.0, 34.0, 44.0),
    )
    x_unit, y_unit = unit_text(curve.x_unit), unit_text(curve.y_unit)
    parts = [
        *grid(room, _axis_title(curve.x_name, x_unit), _axis_title(curve.y_name, y_unit)),
        band(room, curve.x, curve.low, curve.high, "band-after"),
        line(room, curve.x, curve.y, "after"),
    ]
    title = capital(title_of(curve.effect))
    return Picture(
        name=f"curve_{number}",
        title=title,
        said=f"{capital(curve.y_name)} against {curve.x_name}; the area holds the truth with 90 %.",
        svg=picture_svg(_WIDTH, _HEIGHT, parts, title),
    )


def _axis_title(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name
