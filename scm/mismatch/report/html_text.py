"""Pieces of HTML; every text that goes in is escaped here."""

import re
from collections.abc import Sequence
from html import escape

from scm.mismatch.report.plot import Picture

_CODE = re.compile(r"`([^`<>]+)`")
_KEY = re.compile(r"\w+\.[\w.*]+")  # such as `body.mass_kg`, which may be parted at its joints
_SCROLLS = ("scroll", "windows", "wide")
_JOINT = re.compile(r"([._])(?=\w)")
_BEFORE_UNIT = re.compile(r"(\d) (?=(?:%|[mcμ]?m|m?s|k?g|N|rad|m/s)\b|%)")


def tag(name: str, text: str, kind: str = "") -> str:
    """Return one element around a text; lines stay lines, and `this` is what to type."""
    lines = _BEFORE_UNIT.sub("\\1&nbsp;", escape(text)).replace("\n", "<br>")
    return around(name, _CODE.sub(r"<code>\1</code>", lines), kind)


def around(name: str, inner: str, kind: str = "") -> str:
    """Return one element around HTML that is safe already; what scrolls can get the focus."""
    kinds = f' class="{kind}"' if kind else ""
    kinds += ' tabindex="0"' if kind.partition(" ")[0] in _SCROLLS else ""
    return f"<{name}{kinds}>{inner}</{name}>"


def figure(picture: Picture | None) -> str:
    """Return a picture with its title and what to see; nothing for None."""
    if picture is None:
        return ""
    title = tag("h3", picture.title) if picture.title else ""
    caption = tag("figcaption", picture.caption) if picture.caption else ""
    return around(
        "figure",
        title + around("div", picture.svg, "wide canvas" if picture.wide else "canvas") + caption,
    )


def section(name: str, title: str, *inner: str) -> str:
    """Return a section; nothing where it would be empty."""
    body = "".join(inner)
    if not body:
        return ""
    return f'<section id="{name}">{tag("h2", title)}{body}</section>\n'


def table(head: Sequence[str], rows: Sequence[Sequence[str]], numbers: Sequence[int] = ()) -> str:
    """Return a table of texts; a row of one text heads those below it.

    Columns whose index is in `numbers` stand at the right.
    """
    if not rows:
        return ""
    top = "".join(_cell("th", text, i in numbers) for i, text in enumerate(head))
    body = "".join(_row(row, head, numbers) for row in rows)
    inner = around("thead", around("tr", top)) + around("tbody", body)
    return around("div", around("table", inner), "scroll")


def _row(row: Sequence[str], head: Sequence[str], numbers: Sequence[int]) -> str:
    if len(row) == 1 < len(head):
        words = tag("b", row[0])
        return around("tr", f'<td class="heads" colspan="{len(head)}">{words}</td>')
    cells = [_cell("td", text, i in numbers) for i, text in enumerate(row)]
    named = zip(head, cells, strict=True)  # a narrow screen shows cells below each other
    return around("tr", "".join(f'<td data-head="{escape(h)}"{cell[3:]}' for h, cell in named))


def _cell(name: str, text: str, is_number: bool) -> str:
    cell = tag(name, text, "number" if is_number else "")
    return _JOINT.sub("\\1<wbr>", cell) if _KEY.fullmatch(text) else cell
