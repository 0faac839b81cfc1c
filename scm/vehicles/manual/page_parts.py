"""Parts of every page of the manual: equation, text, headings, table of numbers."""

import inspect
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from scm.vehicles.describe_effects import Effect
from scm.vehicles.effect_text import HEADINGS
from scm.vehicles.jit import plain
from scm.vehicles.param import LogNormal, Normal, Param

EffectFunction = Callable[..., Any]


def equations(function: EffectFunction) -> Iterator[str]:
    """Yield the lines of the equation."""
    yield from (
        line.strip() for line in _document(function).splitlines() if line.startswith("    ")
    )


def story(function: EffectFunction) -> str:
    """Return the docstring's text without first line, equation and headings."""
    body = _document(function).partition("\n")[2].partition(f"{HEADINGS[0]}:")[0]
    return " ".join(line for line in body.splitlines() if line and not line.startswith("    "))


def headings(effect: Effect) -> Iterator[str]:
    """Yield a paragraph for each heading of the docstring."""
    for heading in HEADINGS:
        yield from (f"**{heading}:** {effect.doc_line(heading)}", "")


def parameter_table(params: Sequence[Param], neutral: Mapping[str, float]) -> Iterator[str]:
    """Yield the table of an effect's numbers, if it has any."""
    if not params:
        return
    yield "| key in the car file | meaning | unit | default | bounds | prior | neutral |"
    yield "|---|---|---|---|---|---|---|"
    for param in params:
        low, high = param.bounds
        nothing = f"{neutral[param.name]:g}" if param.name in neutral else ""
        unit = "" if param.unit == "1" else param.unit
        yield (
            f"| `{param.key}` | {param.about} | {unit} | {param.default:g} | {low:g} to {high:g} "
            f"| {_prior(param)} | {nothing} |"
        )
    yield ""


def _prior(param: Param) -> str:
    match param.prior:
        case Normal(mean, std):
            return f"{mean:g} ± {std:g}"
        case LogNormal(median, sigma):
            return f"about {median:g}, 68 % within a factor {math.exp(sigma):.2g}"
    return "anything inside the bounds" if param.fit else "a number of the method, never fitted"


def _document(function: EffectFunction) -> str:
    return inspect.getdoc(inspect.getmodule(plain(function))) or ""
