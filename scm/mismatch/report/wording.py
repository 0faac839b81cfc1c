"""Names, numbers and doubts in the words of the report."""

import math
from collections.abc import Sequence

from scm.mismatch.findings import Effect, Equation, Estimate, Located, Place, Span
from scm.vehicles.describe_effects import all_effects

PARTS_OF_CAR = {
    Equation.DRIVE: "In the drive",
    Equation.STEERING: "In the steering",
    Equation.TYRE: "In the tyres",
    Equation.BODY: "On the body",
    Equation.SURFACE: "From the floor",
    Equation.SENSOR: "In the measuring",
}
_SCALES = {  # smallest value of each unit, and how many of it one SI unit is
    "m": ((1.0, "m", 1.0), (0.01, "cm", 100.0), (0.0, "mm", 1000.0)),
    "s": ((1.0, "s", 1.0), (0.0, "ms", 1000.0)),
    "kg": ((1.0, "kg", 1.0), (0.0, "g", 1000.0)),
    "rad": ((0.0, "°", 180.0 / math.pi),),
}
_SURE = ((0.99, "Practically certain"), (0.9, "Very likely"), (0.7, "Likely"))
_MOST_SPANS = 4


def title_of(name: str) -> str:
    """Return an effect's name as a person would say it."""
    effect = all_effects().get(name)
    if effect is None:
        return name.replace("_", " ") if name.isidentifier() else name
    head, colon, _ = effect.about.partition(": ")
    if not colon or len(head) > len(name) + 12:
        return name.replace("_", " ")
    return head if head[1:2].isupper() else head[:1].lower() + head[1:]


def capital(text: str) -> str:
    """Return the text with a capital first letter."""
    return text[:1].upper() + text[1:]


def unit_text(unit: str) -> str:
    """Return a unit as it is printed; nothing for 1."""
    return "" if unit == "1" else unit.replace("*", "·").replace("^2", "²")


def quantity(value: float, unit: str) -> str:
    """Return a value with a unit that suits its size: 0.012 m is 1.2 cm."""
    if not math.isfinite(value):
        return "unknown"
    scales = _SCALES.get(unit, ((0.0, unit_text(unit), 1.0),))
    name, factor = next((name, per) for least, name, per in scales if abs(value) >= least)
    space = "" if name == "°" else " "
    return f"{short(value * factor)}{space}{name}".rstrip()


def short(value: float) -> str:
    """Return three digits, without an exponent where people would write none."""
    text = f"{value:.3g}"
    return (text if "e" not in text else f"{value:.2e}").replace("-", "\N{MINUS SIGN}")


def interval(estimate: Estimate) -> str:
    """Return a value with its 90 % interval in one unit."""
    low, high = short(estimate.low), short(estimate.high)
    unit = unit_text(estimate.unit)
    degrees = ""
    if estimate.unit == "rad" and math.isfinite(estimate.value):
        degrees = f" = {short(math.degrees(estimate.value))}°"
    return f"{short(estimate.value)} {unit}".rstrip() + f"{degrees} (90 %: {low} to {high})"


def percent(share: float) -> str:
    """Return a share in percent, never 0 or 100 %."""
    if not math.isfinite(share):
        return "unknown"
    if share > 0.999:
        return "over 99.9 %"
    if share < 0.001:
        return "under 0.1 %"
    return f"{100.0 * share:.1f} %" if share > 0.985 or share < 0.01 else f"{100.0 * share:.0f} %"


def sureness(effect: Effect) -> str:
    """Return how sure an effect is, and what else it might be."""
    words = next((said for least, said in _SURE if effect.probability >= least), "Possible")
    said = f"{words}, {percent(effect.probability)}"
    if effect.rivals:
        best = max(effect.rivals, key=lambda rival: rival.probability)
        said += f"; next best: {title_of(best.name)}, {percent(best.probability)}"
    return said + "."


def where_and_when(found: Sequence[Located]) -> str:
    """Return where and when the error lies."""
    return " ".join(_one_place(located) for located in found)


def _one_place(located: Located) -> str:
    where = place(located.where) if located.where else "everywhere on the floor"
    when = spans(located.when_s) if located.when_s else "all the time"
    said = f"{PARTS_OF_CAR[located.equation]}, {where}, {when}."
    if located.channels:
        said += f" Seen in {joined(located.channels)}."
    if located.depends_on:
        said += f" It depends on {joined(located.depends_on)}."
    return f"{said} It makes {percent(located.share_of_error)} of the error."


def place(box: Place) -> str:
    """Return a box of the floor."""
    (x0, x1), (y0, y1) = box.x_m, box.y_m
    return f"at x {short(x0)} to {short(x1)} m, y {short(y0)} to {short(y1)} m"


def spans(when_s: Sequence[Span]) -> str:
    """Return spans of time, the first few by their numbers."""
    shown = [f"{a:.1f} to {b:.1f} s" for a, b in when_s[:_MOST_SPANS]]
    more = len(when_s) - len(shown)
    return "at " + ", ".join(shown) + (f" and {more} more times" if more else "")


def joined(names: Sequence[str], word: str = "and") -> str:
    """Return names as a sentence lists them."""
    if len(names) < 2:
        return "".join(names)
    return ", ".join(names[:-1]) + f" {word} {names[-1]}"
