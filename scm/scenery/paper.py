"""Pages in millimetres, written as PDF or SVG at true size: filled rectangles, lines and text.

The origin is the lower left corner of the page, y up. A PDF tells viewers not to scale it; an SVG
has its size in millimetres. Both have a ruler, because printers and viewers may still scale them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from xml.sax.saxutils import escape

PAPERS_MM = {
    "A4": (210.0, 297.0), "A3": (297.0, 420.0), "A2": (420.0, 594.0), "A1": (594.0, 841.0),
    "A0": (841.0, 1189.0), "letter": (215.9, 279.4), "tabloid": (279.4, 431.8),
}  # fmt: skip
POINTS_PER_MM = 72.0 / 25.4
RULER_MM = 100.0
RULER_NOTE = "This ruler is 100 mm long. If yours differs, print again at 100 % (actual size)."
Rectangle = tuple[float, float, float, float]
"""Left, bottom, width, height [mm]."""


@dataclass(slots=True)
class Page:
    """One page.

    Attributes:
        shapes: Black areas, each of rectangles that may touch but not overlap.
        lines: x, y of both ends and the width [mm].
        texts: x, y of the left end of the base line, size [mm], and ASCII text.
    """

    width_mm: float
    height_mm: float
    shapes: list[tuple[Rectangle, ...]] = field(default_factory=list)
    lines: list[tuple[float, float, float, float, float]] = field(default_factory=list)
    texts: list[tuple[float, float, float, str]] = field(default_factory=list)

    def arrow(self, x: float, y: float, length: float) -> None:
        """Draw an arrow to the right [mm]."""
        end = x + length
        self.lines.append((x, y, end, y, 0.6))
        self.lines += [(end, y, end - 3.0, y + side * 2.0, 0.6) for side in (1.0, -1.0)]

    def frame(self, x: float, y: float, edge: float) -> None:
        """Draw where to cut a square print out [mm]."""
        for dx, dy, across, up in ((0, 0, 1, 0), (0, 1, 1, 0), (0, 0, 0, 1), (1, 0, 0, 1)):
            left, bottom = x + dx * edge, y + dy * edge
            self.lines.append((left, bottom, left + across * edge, bottom + up * edge, 0.1))

    def ruler(self, x: float, y: float) -> None:
        """Draw a ruler of `RULER_MM` from a point to the right, and what it is for."""
        self.lines.append((x, y, x + RULER_MM, y, 0.2))
        for tenth in range(11):
            at = x + tenth * RULER_MM / 10.0
            self.lines.append((at, y, at, y + (4.0 if tenth % 5 == 0 else 2.5), 0.2))
        self.texts.append((x, y - 4.0, 3.0, RULER_NOTE))


def svg(page: Page) -> str:
    """Return a page as an SVG file."""
    high = page.height_mm
    parts = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{page.width_mm}mm" height="{high}mm" '
        f'viewBox="0 0 {page.width_mm} {high}">',
        f'<rect width="{page.width_mm}" height="{high}" fill="#fff"/>',
    ]
    for shape in page.shapes:
        outline = "".join(
            f"M{left:.4f} {high - bottom - up:.4f}h{across:.4f}v{up:.4f}h{-across:.4f}z"
            for left, bottom, across, up in shape
        )
        parts.append(f'<path d="{outline}"/>')
    parts += [
        f'<line x1="{x0:.4f}" y1="{high - y0:.4f}" x2="{x1:.4f}" y2="{high - y1:.4f}" '
        f'stroke="#000" stroke-width="{thick}"/>'
        for x0, y0, x1, y1, thick in page.lines
    ]
    parts += [
        f'<text x="{x:.4f}" y="{high - y:.4f}" font-family="Helvetica, Arial, sans-serif" '
        f'font-size="{size}">{escape(text)}</text>'
        for x, y, size, text in page.texts
    ]
    return "\n".join((*parts, "</svg>", ""))


def pdf(pages: Sequence[Page]) -> bytes:
    """Return pages as a PDF file."""
    first = 4
    kids = " ".join(f"{first + 2 * index} 0 R" for index in range(len(pages)))
    objects = [
        "<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
        f"<< /Type /Pages /Kids [{kids}] /Count {len(pages)} >>",
        "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>",
    ]
    for index, page in enumerate(pages):
        size = f"{page.width_mm * POINTS_PER_MM:.4f} {page.height_mm * POINTS_PER_MM:.4f}"
        content = _content(page)
        objects += [
            f"<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {size}] /Contents "
            f"{first + 2 * index + 1} 0 R /Resources << /Font << /F1 3 0 R >> >> >>",
            f"<< /Length {len(content)} >>\nstream\n{content}\nendstream",
        ]
    file, places = "%PDF-1.6\n", []
    for number, text in enumerate(objects, start=1):
        places.append(len(file))
        file += f"{number} 0 obj\n{text}\nendobj\n"
    table = "".join(f"{place:010d} 00000 n \n" for place in places)
    count = len(objects) + 1
    file += (
        f"xref\n0 {count}\n0000000000 65535 f \n{table}trailer\n"
        f"<< /Size {count} /Root 1 0 R >>\nstartxref\n{len(file)}\n%%EOF\n"
    )
    return file.encode("ascii")


def _content(page: Page) -> str:
    """Return what draws a page, in millimetres."""
    parts = [f"{POINTS_PER_MM:.8f} 0 0 {POINTS_PER_MM:.8f} 0 0 cm"]
    for shape in page.shapes:
        areas = " ".join(" ".join(f"{one:.4f}" for one in area) + " re" for area in shape)
        parts.append(f"{areas} f")
    parts += [
        f"{thick} w {x0:.4f} {y0:.4f} m {x1:.4f} {y1:.4f} l S"
        for x0, y0, x1, y1, thick in page.lines
    ]
    for x, y, size, text in page.texts:
        plain = text.encode("ascii", "replace").decode()
        safe = plain.replace("\\", "\\\\").replace("(", "\\(").replace(")", "\\)")
        parts.append(f"BT /F1 {size} Tf {x:.4f} {y:.4f} Td ({safe}) Tj ET")
    return "\n".join(parts)
