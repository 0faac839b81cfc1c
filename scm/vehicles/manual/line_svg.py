"""Line plots as small SVG pictures: no library, deterministic output."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from html import escape

from scm.arrays import Floats

WIDTH, HEIGHT = 640, 320
_LEFT, _RIGHT, _TOP, _BOTTOM = 64, 16, 40, 48
_MOST_POINTS = 240
COLOURS = ("#8b93a1", "#1d5fd1", "#d1571d")


@dataclass(frozen=True, slots=True)
class Line:
    """One curve: its name in the legend and its points, equally long."""

    label: str
    x: Floats
    y: Floats


@dataclass(frozen=True, slots=True)
class Axis:
    """Values from `low` to `high` along a picture, from pixel `start` over `length` (negative: up).

    Attributes:
        wanted: Approximate number of ticks.
    """

    low: float
    high: float
    start: float
    length: float
    wanted: int = 6

    def at(self, value: float) -> float:
        """Return the pixel of a value."""
        return self.start + (value - self.low) / (self.high - self.low) * self.length

    @property
    def step(self) -> float:
        """A round distance between ticks that gives about the wanted number."""
        spacing = (self.high - self.low) / self.wanted
        power = 10.0 ** math.floor(math.log10(spacing))
        return next(m * power for m in (1.0, 2.0, 5.0, 10.0) if m * power >= spacing * 0.999)

    def ticks(self) -> Iterator[float]:
        """Yield round values."""
        first = math.ceil(self.low / self.step - 1e-9)
        last = math.floor(self.high / self.step + 1e-9)
        yield from (i * self.step for i in range(first, last + 1))


def draw_lines(
    lines: Sequence[Line], x_title: str, y_title: str, *, equal_scale: bool = False
) -> str:
    """Return the picture; with `equal_scale` both axes have the same scale."""
    across = _axis([line.x for line in lines], _LEFT, WIDTH - _LEFT - _RIGHT)
    up = _axis([line.y for line in lines], HEIGHT - _BOTTOM, -(HEIGHT - _TOP - _BOTTOM))
    if equal_scale:
        across, up = equally_scaled(across, up)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}"'
        f' width="{WIDTH}" height="{HEIGHT}" font-family="system-ui,sans-serif" font-size="12">',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#ffffff"/>',
        *_grid(across, up),
        *_titles(x_title, y_title),
    ]
    for i, line in enumerate(lines):
        parts += _curve(line, across, up, COLOURS[i % len(COLOURS)], i)
    return "\n".join([*parts, "</svg>\n"])


def _axis(values: Sequence[Floats], start: float, length: float) -> Axis:
    low = min(float(v.min()) for v in values)
    high = max(float(v.max()) for v in values)
    room = 0.06 * (high - low) or max(0.1 * abs(high), 1e-3)
    return Axis(low - room if low != 0.0 else low, high + room, start, length)


def equally_scaled(across: Axis, up: Axis) -> tuple[Axis, Axis]:
    """Return both axes with the same scale, one of them widened."""
    scale = max(
        (across.high - across.low) / abs(across.length), (up.high - up.low) / abs(up.length)
    )
    return _widen(across, scale), _widen(up, scale)


def _widen(axis: Axis, scale: float) -> Axis:
    middle, half = 0.5 * (axis.low + axis.high), 0.5 * scale * abs(axis.length)
    return replace(axis, low=middle - half, high=middle + half)


def _grid(across: Axis, up: Axis) -> Iterator[str]:
    right, bottom = WIDTH - _RIGHT, HEIGHT - _BOTTOM
    for value in across.ticks():
        x = across.at(value)
        yield f'<path d="M{x:.1f} {_TOP}V{bottom}" stroke="#e6e8ec"/>'
        yield _text(x, bottom + 18, f"{value:.6g}", "middle")
    for value in up.ticks():
        y = up.at(value)
        colour = "#b4b9c2" if abs(value) < 1e-12 else "#e6e8ec"
        yield f'<path d="M{_LEFT} {y:.1f}H{right}" stroke="{colour}"/>'
        yield _text(_LEFT - 8, y + 4, f"{value:.6g}", "end")


def _titles(x_title: str, y_title: str) -> Iterator[str]:
    yield _text(WIDTH - _RIGHT, HEIGHT - 10, x_title, "end")
    yield _text(_LEFT - 48, 22, y_title, "start")


def _curve(line: Line, across: Axis, up: Axis, colour: str, place: int) -> Iterator[str]:
    keep = max(1, len(line.x) // _MOST_POINTS)
    points = zip(line.x[::keep].tolist(), line.y[::keep].tolist(), strict=True)
    path = "L".join(f"{across.at(x):.1f} {up.at(y):.1f}" for x, y in points)
    dash = ' stroke-dasharray="6 4"' if place == 0 else ""
    yield f'<path d="M{path}" fill="none" stroke="{colour}" stroke-width="2"{dash}/>'
    x = 200 + 190 * place
    yield f'<path d="M{x} 18h26" stroke="{colour}" stroke-width="2"{dash}/>'
    yield _text(x + 32, 22, line.label, "start")


def _text(x: float, y: float, text: str, align: str) -> str:
    at = f'x="{x:.1f}" y="{y:.1f}"'
    return f'<text {at} text-anchor="{align}" fill="#3a414d">{escape(text)}</text>'
