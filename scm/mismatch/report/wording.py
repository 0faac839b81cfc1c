"""Names, numbers and probabilities as a report writes them."""

import math
import re
from collections.abc import Mapping, Sequence

from scm.mismatch.findings import Effect, Estimate, Witness
from scm.vehicles.describe_effects import all_effects

_SCALES = {  # smallest value of each unit, and how many of it one SI unit is
    "m": ((1.0, "m", 1.0), (0.01, "cm", 100.0), (0.0, "mm", 1000.0)),
    "s": ((1.0, "s", 1.0), (0.0, "ms", 1000.0)),
    "kg": ((1.0, "kg", 1.0), (0.0, "g", 1000.0)),
    "rad": ((0.0, "°", 180.0 / math.pi),),
}
_SURE = ((0.99, "Practically certain"), (0.9, "Very likely"), (0.7, "Likely"))
_MOST_DIGITS = 6
_INTEGERS, _FINEST, _TWO_DIGITS = 1000.0, 1e-4, 3.0
_ERROR_NAMES = {
    "yaw": "heading",
    "gyro": "yaw rate, gyro",
    "wheel": "distance, wheels",
    "accel_x": "forward acceleration, IMU",
    "accel_y": "sideways acceleration, IMU",
}
_ERROR_UNITS = {"m": "m", "rad": "rad", "mps": "m/s", "s": "s"}
MINUS = "\N{MINUS SIGN}"
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_NEGATIVE = re.compile(r"(^|[\s(])-(?=[\d.])")


def title_of(name: str) -> str:
    """Return the name of an effect, or of several joined by `and`, as a person would say it."""
    if " and " in name:
        return " and ".join(map(title_of, name.split(" and ")))
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


def quantities(values: Sequence[float], unit: str) -> list[str]:
    """Return values to be compared, all in the unit that suits the largest."""
    known = [abs(value) for value in values if math.isfinite(value)]
    largest = max(known, default=0.0)
    scales = _SCALES.get(unit, ((0.0, unit_text(unit), 1.0),))
    name, factor = next((name, per) for least, name, per in scales if largest >= least)
    space = "" if name == "°" else " "
    decimals = _decimals(largest * factor, 3)
    texts = []
    for value in values:
        if not math.isfinite(value):
            texts.append("unknown")
            continue
        number = f"{value * factor:.{max(decimals, _decimals(value * factor, 2))}f}"
        number = number if math.log10(largest * factor or 1.0) < _MOST_DIGITS else f"{value:.3g}"
        texts.append(f"{number.replace('-', MINUS)}{space}{name}".rstrip())
    return texts


def _decimals(value: float, digits: int) -> int:
    """Return how many decimals show so many digits of a value; none of zero."""
    if value == 0.0 or not math.isfinite(value):
        return 0
    return min(6, max(0, digits - 1 - math.floor(math.log10(abs(value)))))


def short(value: float) -> str:
    """Return three digits, without an exponent where people would write none."""
    text = f"{value:.3g}"
    digits, e, power = text.partition("e")
    if e and 0 < int(power) < _MOST_DIGITS:
        text = f"{float(text):.0f}"
    elif e:
        text = f"{digits}·10{str(int(power)).translate(_RAISED)}"
    return text.replace("-", MINUS)


def pretty(text: str) -> str:
    """Return a sentence with units and signs as they are printed."""
    text = text.replace("^2", "²").replace("^3", "³")
    return _NEGATIVE.sub(f"\\1{MINUS}", text)


def interval(estimate: Estimate) -> str:
    """Return a value with its 90 % interval in one unit, to the digits that the interval allows."""
    unit = unit_text(estimate.unit)
    value, low, high = _rounded(estimate, 1.0)
    degrees = ""
    if estimate.unit == "rad" and math.isfinite(estimate.value):
        degrees = f" = {_rounded(estimate, 180.0 / math.pi)[0]}°"
    return f"{value} {unit}".rstrip() + f"{degrees} (90 %: {low} to {high})"


def moment(at: Estimate) -> str:
    """Return a moment of a recording with its interval."""
    return f"{at.value:.1f} s ({at.low:.1f} to {at.high:.1f} s)"


def _rounded(estimate: Estimate, factor: float) -> tuple[str, str, str]:
    """Return value and ends times a factor, with the decimals that show the interval's width."""
    value, low, high = (v * factor for v in (estimate.value, estimate.low, estimate.high))
    half = 0.5 * (high - low)
    if not (math.isfinite(value) and math.isfinite(half) and half > _FINEST * abs(value)):
        return short(value), short(low), short(high)
    two = half / 10.0 ** math.floor(math.log10(half)) < _TWO_DIGITS
    decimals = _decimals(half, 2 if two else 1)
    if abs(value) + half >= _INTEGERS or decimals > _MOST_DIGITS - 1:
        return short(value), short(low), short(high)
    text, least, most = (f"{v:.{decimals}f}".replace("-", MINUS) for v in (value, low, high))
    return text, least, most


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
    words = next((words for least, words in _SURE if effect.probability >= least), "Possible")
    text = f"{words}: {percent(effect.probability)}"
    if effect.alternatives:
        best = max(effect.alternatives, key=lambda one: one.probability)
        text += f". Next best is {title_of(best.name)}, {percent(best.probability)}"
    return text + "."


def name_of(name: str, unit: str) -> str:
    """Return a parameter's name in words, without the unit that follows its value."""
    suffix = "_" + unit.replace("*", "").replace("/", "").replace("^", "").lower()
    ends = (suffix, "_mps2", "_rad_s", "_per_min") if unit != "1" else ()
    stem = next((name.removesuffix(end) for end in ends if name.endswith(end)), name)
    return stem.replace("_", " ")


def amounts(parameters: Mapping[str, Estimate]) -> list[str]:
    """Return each parameter with its value and interval."""
    return [f"{name_of(name, e.unit)} {interval(e)}" for name, e in parameters.items()]


def bicycle_name(witness: Witness) -> str:
    """Return what the plain model is called that a car is held against."""
    return f"kinematic bicycle with {len(witness.numbers)} numbers"


def error_name(key: str) -> tuple[str, str]:
    """Return the words and the unit of an error such as `position_m`."""
    stem, _, unit = key.rpartition("_")
    if unit not in _ERROR_UNITS:
        return key, "1"
    return _ERROR_NAMES.get(stem, stem.replace("_", " ")), _ERROR_UNITS[unit]


def joined(names: Sequence[str], word: str = "and") -> str:
    """Return names as a sentence lists them."""
    if len(names) < 2:
        return "".join(names)
    return ", ".join(names[:-1]) + f" {word} {names[-1]}"
