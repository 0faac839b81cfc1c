"""Bars: how much better it got, and how much each effect that was tried would explain."""

import math
from collections.abc import Sequence

from scm.maps.svg import element
from scm.mismatch.evidence import Tried
from scm.mismatch.findings import Diagnosis
from scm.mismatch.report.plot import TEXT_PX, Picture, frame, picture_svg, text, ticks_across
from scm.mismatch.report.wording import quantities, title_of

_WIDTH = 440.0
_ROW, _BETTER_ROW = 25.0, 52.0
_MOST_TRIED = 14
_ROOM = 8.0  # between a bar's end or a mark and the words behind it
_FOUND = (
    " Blue bars are what was found; grey bars beyond their mark explain some of the same, and less "
    "well."
)


def better_picture(diagnosis: Diagnosis, retuned_m: float | None = None) -> Picture | None:
    """Return position errors on the part that the fit did not see; None without an effect.

    Args:
        diagnosis: Its errors before and after.
        retuned_m: Of the car with its own numbers refitted alone; None: not shown.
    """
    if diagnosis.fit is None or not diagnosis.effects:
        return None
    part = diagnosis.fit.confirm
    before, after = (side.get("position_m", math.nan) for side in (part.before, part.after))
    found = "with the likeliest of them" if diagnosis.undecided else "with what was found"
    rows = [("before", "the simulator as it was", before), ("after", found, after)]
    if retuned_m is not None:
        rows.insert(1, ("retuned", "its own numbers refitted, no new physics", retuned_m))
    values = [value for _, _, value in rows]
    if not all(map(math.isfinite, values)):
        return None
    floor = part.noise_floor.get("position_m", math.nan)
    long = 350.0 / (max(*values, floor if math.isfinite(floor) else 0.0) or 1.0)
    parts, foot = list[str](), _BETTER_ROW * len(rows)
    *said, noise = quantities((*values, floor), "m")
    for i, (kind, words, value) in enumerate(rows):
        y = _BETTER_ROW * i
        parts += [text(0, y + 14, words, kind="title")]
        parts += [element("rect", x=0, y=y + 20, width=max(2.0, long * value), height=26, rx=3,
                          class_=f"bar-{kind}")]  # fmt: skip
        parts += [text(_label_x(long * value, long * floor, said[i]), y + 38, said[i],
                       kind="strong")]  # fmt: skip
    if math.isfinite(floor):
        x = long * floor
        marks = "".join(f"M{x:.1f} {_BETTER_ROW * i + 18:.0f}v30" for i in range(len(rows)))
        parts += [element("path", d=marks, class_="needed")]
        parts += [text(x, foot + 14, f"noise of measuring alone: {noise}")]
    return Picture(
        name="better",
        title="",
        said="",
        svg=picture_svg(
            460.0, foot + 24.0, parts, f"Position error {before:.3g} m before, {after:.3g} m after"
        ),
    )


def _label_x(end: float, mark: float, words: str) -> float:
    """Return where a bar's words begin: behind its end, and behind a mark that would cross them."""
    begin = end + _ROOM
    return mark + _ROOM if end < mark < begin + TEXT_PX * len(words) + _ROOM else begin


def tried_picture(tried: Sequence[Tried], found: Sequence[str]) -> Picture | None:
    """Return what each effect alone would explain, beside what chance may bring."""
    known = [t for t in tried if math.isfinite(t.gain) and math.isfinite(t.needed)]
    shown = sorted(known, key=lambda t: -t.gain)[:_MOST_TRIED]
    if not shown:
        return None
    names = [title_of(t.name) for t in shown]
    left = min(190.0, 14.0 + TEXT_PX * max(map(len, names)))
    high = max(max(_stds(t.gain), _stds(t.needed)) for t in shown)
    height = 30.0 + _ROW * len(shown) + 44.0
    room = frame((0.0, 1.08 * high), (0.0, 1.0), (_WIDTH, height), margins=(left, 14, 30, 44))
    parts = list(ticks_across(room))
    for i, (t, name) in enumerate(zip(shown, names, strict=True)):
        y = 34.0 + _ROW * i
        kind = "bar-after" if t.name in found else "bar"
        width = max(1.0, room.across.at(_stds(t.gain)) - room.left)
        parts += [element("rect", x=room.left, y=y, width=width, height=16, class_=kind)]
        parts += [
            text(left - 8, y + 13, name, "end", "strong" if t.name in found else "title"),
            element("path", d=f"M{room.across.at(_stds(t.needed)):.1f} {y - 3:.1f}v22",
                    class_="needed"),
        ]  # fmt: skip
    parts += [text(room.right, height - 8, "gain [standard deviations]", "end", "title")]
    parts += [element("path", d=f"M{left:.1f} 8v14", class_="needed")]
    parts += [text(left + 8, 20, "chance may bring this much")]
    rest = len(known) - len(shown)
    more = f" {rest} more explained less." if rest else ""
    return Picture(
        name="tried",
        title="Each effect alone",
        said="A bar that does not pass its mark is what luck may bring when so many are tried."
        f"{_FOUND if found else ''}{more}",
        svg=picture_svg(_WIDTH, height, parts, "Gain of each effect tried"),
    )


def _stds(gain: float) -> float:
    """Return a gain in squared standard deviations as standard deviations."""
    return math.sqrt(max(0.0, gain))
