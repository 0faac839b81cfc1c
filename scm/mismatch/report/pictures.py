"""All pictures of a report, drawn once: the page shows them, and the folder holds them."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from msgspec import structs

from scm.maps.svg import element
from scm.mismatch.evidence import Curve, Evidence, RefittedParameter, Tried, without_pauses
from scm.mismatch.findings import Diagnosis, Effect, Estimate
from scm.mismatch.report.drive_pictures import error_pictures, floor_map, time_line, window_pictures
from scm.mismatch.report.plot import (
    TEXT_PX,
    Frame,
    Picture,
    band,
    frame,
    grid,
    line,
    picture_svg,
    span_of,
    text,
    ticks_across,
    whiskers,
)
from scm.mismatch.report.wording import bicycle_name, capital, quantities, title_of, unit_text

_WIDTH, _HEIGHT = 440.0, 270.0  # of a picture beside another [px]
_ROW, _BETTER_ROW = 25.0, 52.0
_MAX_TRIED = 14
_GAP_PX = 8.0  # between a bar's end or a mark and the words behind it
_MAX_LABEL = 270.0  # width of the names of parameters [px]
_MIN_STDS, _MAX_STDS = 2.5, 6.0  # that the axis of refitted parameters spans to either side
_FOUND = (
    " Blue bars are what was found; grey bars beyond their mark explain some of the same, and less "
    "well."
)
_MAX_MAPS = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class Pictures:
    """What there is to see; what the evidence does not hold is None or empty."""

    better: Picture | None
    maps: Sequence[Picture]
    time_line: Picture | None
    curves: Sequence[Picture]
    windows: Sequence[Picture]
    errors: Sequence[Picture]
    numbers: Picture | None
    tried: Picture | None

    def all(self) -> list[Picture]:
        """Return every picture."""
        single = (self.better, self.time_line, self.numbers, self.tried)
        several = (*self.maps, *self.curves, *self.windows, *self.errors)
        return [picture for picture in (*single, *several) if picture is not None]


def draw(diagnosis: Diagnosis, evidence: Evidence, start_s: float = 0.0) -> Pictures:
    """Return the pictures of a diagnosis; `start_s` was taken off its times already."""
    residuals = evidence.residuals  # strongest first
    on_floor = [r for r in residuals if (np.isfinite(r.x_m) & np.isfinite(r.y_m)).any()]
    after = "with what was found" if diagnosis.effects else "with its numbers refitted"
    clock = "time on the recording's clock [s]"
    if len(evidence.recordings) > 1:
        clock = "time, one recording after another [s]"
    elif evidence.pauses:
        clock = "time without pauses [s]"
    elif start_s:
        clock = f"time since {start_s:.0f} s of the recording's clock [s]"
    return Pictures(
        better=_better(diagnosis, evidence.retuned_m),
        maps=[
            floor_map(residual, diagnosis.located, i)
            for i, residual in enumerate(on_floor[:_MAX_MAPS], start=1)
        ],
        time_line=time_line(
            residuals,
            diagnosis.located,
            evidence.free_runs,
            after,
            clock,
            _moments_drawn(diagnosis.effects, evidence.pauses, start_s),
        ),
        curves=_curves(evidence.curves),
        windows=window_pictures(evidence.free_runs),
        errors=error_pictures(evidence.free_runs),
        numbers=_numbers(evidence.refitted),
        tried=_tried(evidence.tried, [effect.name for effect in diagnosis.effects]),
    )


def _moments_drawn(
    effects: Sequence[Effect], pauses: Sequence[tuple[float, float]], start_s: float
) -> list[Estimate]:
    """Return when effects changed, as it is drawn: without pauses."""

    def drawn(t_s: float) -> float:
        return without_pauses(t_s + start_s, pauses) - start_s

    moments = [at for one in effects for at in (one.since_s, one.until_s) if at is not None]
    return [
        structs.replace(at, value=drawn(at.value), low=drawn(at.low), high=drawn(at.high))
        for at in moments
    ]


def _better(diagnosis: Diagnosis, retuned_m: float | None = None) -> Picture | None:
    """Return position errors on the part that the fit did not see; None without an effect.

    `retuned_m` is that of the car with its own numbers refitted alone; None: not shown.
    """
    if diagnosis.fit is None or not (diagnosis.effects or diagnosis.failure):
        return None
    part = diagnosis.fit.confirm
    before, after = (side.get("position_m", math.nan) for side in (part.before, part.after))
    found = "with the likeliest of them" if diagnosis.undecided else "with what was found"
    found = found if diagnosis.effects else "with its own numbers refitted, no new physics"
    rows = [("before", "the simulator as it was", before), ("after", found, after)]
    if retuned_m is not None:
        rows.insert(1, ("retuned", "its own numbers refitted, no new physics", retuned_m))
    if (witness := diagnosis.fit.witness) is not None:
        rows.append(("witness", bicycle_name(witness), witness.position_m))
    values = [value for _, _, value in rows]
    if not all(map(math.isfinite, values)):
        return None
    floor = part.noise_floor.get("position_m", math.nan)
    long = 350.0 / (max(*values, floor if math.isfinite(floor) else 0.0) or 1.0)
    parts, foot = list[str](), _BETTER_ROW * len(rows)
    *labels, noise = quantities((*values, floor), "m")
    for i, (kind, words, value) in enumerate(rows):
        y = _BETTER_ROW * i
        parts += [text(0, y + 14, words, kind="title")]
        parts += [element("rect", x=0, y=y + 20, width=max(2.0, long * value), height=26, rx=3,
                          class_=f"bar-{kind}")]  # fmt: skip
        parts += [text(_label_x(long * value, long * floor, labels[i]), y + 38, labels[i],
                       kind="strong")]  # fmt: skip
    if math.isfinite(floor):
        x = long * floor
        marks = "".join(f"M{x:.1f} {_BETTER_ROW * i + 18:.0f}v30" for i in range(len(rows)))
        parts += [element("path", d=marks, class_="needed")]
        parts += [text(x, foot + 14, f"measurement noise alone: {noise}")]
    return Picture(
        name="better",
        title="",
        caption="",
        svg=picture_svg(
            460.0, foot + 24.0, parts, f"Position error {before:.3g} m before, {after:.3g} m after"
        ),
    )


def _label_x(end: float, mark: float, words: str) -> float:
    """Return where a bar's words begin: behind its end, and behind a mark that would cross them."""
    begin = end + _GAP_PX
    return mark + _GAP_PX if end < mark < begin + TEXT_PX * len(words) + _GAP_PX else begin


def _tried(tried: Sequence[Tried], found: Sequence[str]) -> Picture | None:
    """Return what each effect alone would explain, beside what chance may bring."""
    known = [t for t in tried if math.isfinite(t.gain) and math.isfinite(t.needed)]
    shown = sorted(known, key=lambda t: -t.gain)[:_MAX_TRIED]
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
        caption="A bar that does not pass its mark is what luck may bring when so many are tried."
        f"{_FOUND if found else ''}{more}",
        svg=picture_svg(_WIDTH, height, parts, "Gain of each effect tried"),
    )


def _stds(gain: float) -> float:
    """Return a gain in squared standard deviations as standard deviations."""
    return math.sqrt(max(0.0, gain))


def _numbers(refitted: Sequence[RefittedParameter]) -> Picture | None:
    """Return how far each number had to move; None where no number may."""
    shown = [o for o in refitted if o.given_std > 0.0 and math.isfinite(o.found.value)]
    if not shown:
        return None
    ends = [abs(_moved(o, v)) for o in shown for v in (o.found.value, o.found.low, o.found.high)]
    wide = min(_MAX_STDS, max(_MIN_STDS, 1.1 * max(e for e in ends if math.isfinite(e))))
    left = min(_MAX_LABEL, 14.0 + TEXT_PX * max(len(o.key) for o in shown))
    height = 30.0 + _ROW * len(shown) + 44.0
    room = frame((-wide, wide), (0.0, 1.0), (_WIDTH, height), margins=(left, 14, 26, 44))
    parts = []
    for stds, kind in ((2.0, "prior"), (1.0, "prior-core")):
        x = room.across.at(-stds)
        parts += [
            element("rect", x=x, y=room.top, width=room.across.at(stds) - x,
                    height=room.bottom - room.top, class_=kind)
        ]  # fmt: skip
    parts += ticks_across(room)
    rows = [
        (o.key, _moved(o, o.found.low), _moved(o, o.found.value), _moved(o, o.found.high))
        for o in shown
    ]
    parts += whiskers(room, rows, 40.0, _ROW)
    words = "moved [standard deviations of the car file]"
    parts += [text(room.right, height - 8, words, "end", "title")]
    return Picture(
        name="numbers",
        title="How far nominal parameters moved",
        caption="Dots: found, with 90 % intervals. Inner area: one standard deviation as the car "
        "file states it, outer area: two. Inside, the car file was right.",
        svg=picture_svg(_WIDTH, height, parts, "Nominal parameters, before and after"),
    )


def _moved(one: RefittedParameter, value: float) -> float:
    if math.isnan(value):
        return 0.0
    return (value - one.given) / one.given_std


def _curves(curves: Sequence[Curve]) -> list[Picture]:
    """Return a picture of each effect; a formula lies over what was measured without it."""
    found: dict[tuple[str, str, str], list[Curve]] = {}
    for curve in curves:
        if len(curve.x):
            key = (curve.effect, curve.x_name, curve.y_name)
            found.setdefault(key, []).append(_one_turn(curve))
    return [_curve(group, number) for number, group in enumerate(found.values(), start=1)]


def _curve(curves: Sequence[Curve], number: int) -> Picture:
    """Draw a line in its band, and dots with whiskers in their place if a formula is drawn too."""
    first, fitted = curves[0], curves[1:]
    room = frame(
        span_of(*(c.x for c in curves), room=0.0),
        span_of(*(side for c in curves for side in (c.y, c.low, c.high)), through_zero=True),
        (_WIDTH, _HEIGHT),
        margins=(58.0, 14.0, 34.0, 44.0),
    )
    x_unit, y_unit = unit_text(first.x_unit), unit_text(first.y_unit)
    parts = [
        *grid(room, _axis_title(first.x_name, x_unit), _axis_title(first.y_name, y_unit)),
        *(line(room, one.x, one.y, "after") for one in fitted),
    ]
    if fitted:
        parts += _dots(room, first)
    else:
        parts += [
            band(room, first.x, first.low, first.high, "band-after"),
            line(room, first.x, first.y, "after"),
        ]
    title = capital(title_of(first.effect))
    against = f"{capital(first.y_name)} against {first.x_name}"
    caption = "the area is its 90 % interval."
    if fitted:
        caption = "the line is the formula. Dots do not assume it; bars are 90 % intervals."
    return Picture(
        name=f"curve_{number}",
        title=title,
        caption=f"{against}; {caption}",
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
