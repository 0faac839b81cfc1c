"""An effect of the dictionary: how much of what kind of push, against what it depends on.

It is written as a file of its own, which `terms = [..., "my_effect.py"]` loads: an effect like any
other, with straight-line functions, parameters with units and its equation in the docstring. Its
numbers stand in the car file.
"""

import ast
import re
import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from scm.errors import TermError
from scm.mismatch.discovery.general_effect import GAIN, PREFIX, TRIM
from scm.mismatch.effect_catalogue import Candidate, Parameter
from scm.mismatch.findings import Equation
from scm.mismatch.recorded_range import NO_RANGES, Ranges, holds, limit
from scm.vehicles.own_term import SUFFIX, load_own_term
from scm.vehicles.physics_variables import Per
from scm.vehicles.term import Term

Values = tuple[float, ...]
ToNumbers = Callable[[Values], Mapping[str, float]]
_WIDE = 100
_WITH = {
    "sets steer_trimmed": ("offset", f'0.0, "rad", "{TRIM}", (-0.3, 0.3), "trim, + left"'),
    "sets steer_scaled": ("gain", f'1.0, "1", "{GAIN}", (0.2, 2.0), "gain of the steering"'),
}
"""What a variable's own effect does, by target: the function that takes its place does it too."""

_PULL = "pull_n_m"
_GROWING = frozenset({"line", "size", "square", "cube", "heavy", "ramp", _PULL})
"""The general effect's shapes without a bound, and its force that grows with the place."""


@dataclass(frozen=True, slots=True)
class Channel:
    """Where an effect acts.

    Attributes:
        word: As in `drive force against heading`.
        response: The general effect's number whose comb asks the same of each moment.
        parameters: How much; the first is the amount.
        numbers: Of the general effect, from the parameters' values.
        sentence: The sentence's beginning; braces take the parameters.
        formula: Of the effect; braces take the parameters, `{g}` the shape.
        text: Of the written effect, by the sum or variable it acts on; `g` is the shape.
    """

    word: str
    response: str
    equation: Equation
    parameters: tuple[Parameter, ...]
    numbers: ToNumbers
    sentence: str
    formula: str
    text: tuple["Written", ...]


@dataclass(frozen=True, slots=True)
class Written:
    """One function to write.

    Attributes:
        target: `adds force_x` or `sets steer_trimmed`.
        variables: It reads, beside the shape's.
        returns: The expression.
        about: What it returns.
        suffix: Of the function's name.
        per: Once a body or once a wheel.
        keeps: Where the variable starts that it sets from its own last value; None: it has no past.
    """

    target: str
    variables: tuple[str, ...]
    returns: str
    about: str
    suffix: str = ""
    per: Per = Per.BODY
    keeps: float | None = None


@dataclass(frozen=True, slots=True)
class Shape:
    """What an effect depends on, and how.

    Attributes:
        word: What it depends on, as reported.
        numbers: Of the general effect, from the parameters' values.
        text: Line that gives `g` from `variables` and the parameters.
        rare: What it must gain beyond others: it looks like something simpler.
        also: A variable that it reads and no car has.
    """

    name: str
    word: str
    parameters: tuple[Parameter, ...]
    numbers: ToNumbers
    sentence: str
    formula: str
    variables: tuple[str, ...]
    text: str
    equation: Equation | None = None
    rare: float = 0.0
    also: Written | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class DictionaryEffect(Candidate):
    """An effect outside the catalogue, a candidate like those in it.

    Attributes:
        channel: Where it acts; `shape`: what it depends on. Their parameters follow each other.
    """

    channel: Channel
    shape: Shape

    @property
    def written(self) -> tuple[Written, ...]:
        """The functions that its file holds."""
        return (*self.channel.text, *filter(None, (self.shape.also,)))

    @property
    def growing(self) -> frozenset[str]:
        """The general effect's numbers of this one that grow with a variable, without a bound."""
        start = (1.0,) * len(self.parameters)
        return _GROWING.intersection(key.removeprefix(PREFIX) for key in self.numbers(start))

    def numbers(self, values: Values) -> dict[str, float]:
        """Return the general effect's numbers, by key, at these values of the parameters."""
        n = len(self.channel.parameters)
        found = {**self.shape.numbers(values[n:]), **self.channel.numbers(values[:n])}
        return {PREFIX + name: value for name, value in found.items()}

    def formula(self, values: Values) -> str:
        """Return the formula with its numbers and units."""
        words = {
            parameter.name: f"{value:.3g}" + ("" if parameter.unit == "1" else f" {parameter.unit}")
            for parameter, value in zip(self.parameters, values, strict=True)
        }
        text = self.channel.formula.format(**words, g=self.shape.formula.format(**words))
        return text.replace("--", "").replace("- -", "+ ").replace("+ -", "- ")


def dictionary_effect(channel: Channel, shape: Shape) -> DictionaryEffect:
    """Return the effect that a channel and a shape make."""
    return DictionaryEffect(
        name=f"{channel.word} against {shape.word}",
        equation=shape.equation or channel.equation,
        depends_on=(shape.word,),
        parameters=(*channel.parameters, *shape.parameters),
        starts=(),
        sentence=f"{channel.sentence} {shape.sentence}.",
        rare=shape.rare,
        channel=channel,
        shape=shape,
    )


def file_name(effect: DictionaryEffect) -> str:
    """Return the name of an effect's file: `drive_force_against_heading`."""
    return re.sub(r"\W+", "_", effect.name)


def number_keys(effect: DictionaryEffect) -> dict[str, str]:
    """Return the car file's key of each parameter of an effect."""
    return {
        parameter.name: f"{file_name(effect)}.{parameter.name}" for parameter in effect.parameters
    }


def as_term(
    effect: DictionaryEffect, values: Values, folder: Path, ranges: Ranges = NO_RANGES
) -> tuple[Term, dict[str, float]]:
    """Write an effect's file, and return the effect it holds and the car file's numbers for it.

    Args:
        effect: To be written.
        values: Of its parameters.
        folder: Of the file.
        ranges: To which it is limited, by what it depends on.

    Raises:
        TermError: when what was written does not load; then it is our fault.
    """
    write_effect_file(effect, values, folder / (file_name(effect) + SUFFIX), ranges)
    term = load_own_term(folder, file_name(effect) + SUFFIX)
    keys = number_keys(effect)
    return term, {keys[k.name]: v for k, v in zip(effect.parameters, values, strict=True)}


def write_effect_file(
    effect: DictionaryEffect, values: Values, path: Path, ranges: Ranges = NO_RANGES
) -> None:
    """Write an effect's file, with `values` of its parameters in its docstring.

    Beyond `ranges` it acts as at the nearest end.

    Raises:
        TermError: when the file is not named like the effect.
    """
    if path.name != file_name(effect) + SUFFIX:
        msg = f"{path.name}: expected {file_name(effect) + SUFFIX}, the effect's own name"
        raise TermError(msg)
    parts = [_function(effect, part, ranges) for part in effect.written]
    lines = [_docstring(effect, values, ranges), "", *_imports(parts), "", _params(effect), ""]
    for part in parts:
        lines += ["", "@kernel_function", part, ""]
    lines += ["", _term(effect), ""]
    path.write_text("\n".join(lines), encoding="utf-8")


def _docstring(effect: DictionaryEffect, values: Values, ranges: Ranges) -> str:
    first = f"{effect.name.capitalize()}: a law that no library holds, learned from a recording."
    sentence = effect.sentence.format(**{k.name: f"`{k.name}`" for k in effect.parameters})
    equations = [
        f"{part.target.split()[1]} {'+=' if _adds(part) else '='} {_plain(part.returns)}"
        for part in effect.written
    ]
    rows = [*equations, _plain(effect.shape.text), f"found as {effect.formula(values)}"]
    where = holds(ranges, limited=bool(effect.growing))
    body = [
        f'"""{first}', "", *(_wrapped(row, "    ") for row in rows), "", _wrapped(sentence, ""),
        _wrapped(f"Holds: {where}. The form is the best of a dictionary.", ""),
        "Shows in: the recording it was learned from.",
        "Source: `scm mismatch`, its dictionary of laws.", '"""',
    ]  # fmt: skip
    return "\n".join(body)


def _plain(text: str) -> str:
    """Return an expression as a person writes it."""
    return text.replace("cosine_of", "cos").replace("sine_of", "sin").replace("math.", "")


def _wrapped(text: str, indent: str) -> str:
    more = indent * 2 if indent else ""
    return "\n".join(textwrap.wrap(text, 95, initial_indent=indent, subsequent_indent=more))


def _adds(part: Written) -> bool:
    return part.target.startswith("adds")


def _imports(functions: Sequence[str]) -> list[str]:
    text = "\n".join(functions)
    names = [name for name in ("sin_cos", "soft_sign") if name in text]
    lines = ["import math", ""] if "math." in text else []
    lines += ["from scm.vehicles.jit import kernel_function"]
    lines += [f"from scm.vehicles.lane_math import {', '.join(names)}"] if names else []
    return [
        *lines,
        "from scm.vehicles.param import Param",
        "from scm.vehicles.term import Per, Term",
    ]


def _params(effect: DictionaryEffect) -> str:
    rows = [_param(effect, parameter) for parameter in effect.parameters]
    more = [_WITH[part.target] for part in effect.written if part.target in _WITH]
    rows += [f'    Param("{name}", {rest}),' for name, rest in more]
    return "\n".join(["_PARAMS = (", *rows, ")"])


def _param(effect: DictionaryEffect, p: Parameter) -> str:
    low, high = p.bounds
    start = p.neutral if p is effect.parameters[0] else min(max(1.0, low), high)
    return (
        f'    Param("{p.name}", {start}, "{p.unit}", "{number_keys(effect)[p.name]}",\n'
        f'          ({low}, {high}), "found by the search"),'
    )


def _function(effect: DictionaryEffect, part: Written, ranges: Ranges) -> str:
    body, names = _straight("\n".join(_lines(effect, part, ranges)))
    variables = [s for s in dict.fromkeys((*part.variables, *effect.shape.variables)) if s in names]
    arguments = [*variables, *(k.name for k in effect.parameters if k.name in names)]
    arguments += [_WITH[part.target][0]] if part.target in _WITH else []
    wrapped = textwrap.wrap(", ".join(f"{a}: float" for a in arguments) + ",", _WIDE - 4)
    *lines, last = body
    return "\n".join([
        f"def {file_name(effect)}{part.suffix}(", *(f"    {line}" for line in wrapped),
        ") -> float:  # fmt: skip", f'    """{part.about}"""', *(f"    {line}" for line in lines),
        f"    return {last.removeprefix('result = ')}",
    ])  # fmt: skip


def _lines(effect: DictionaryEffect, part: Written, ranges: Ranges) -> list[str]:
    """Return a function's lines, where it grows with a variable with that inside its range."""
    shape, result, more = effect.shape.text, f"result = {part.returns}", list[str]()
    if part.keeps is not None:
        return [result]
    if _PULL in effect.growing:
        more, result = limit(result, part.variables, ranges)
    elif effect.growing:
        more, shape = limit(shape, effect.shape.variables, ranges)
    return [*more, shape, result]


class _Straight(ast.NodeTransformer):
    """Takes sines and cosines out of expressions: an effect calls `sin_cos`, which gives both."""

    def __init__(self) -> None:
        self.before: list[str] = []

    def visit_Call(self, node: ast.Call) -> ast.expr:
        self.generic_visit(node)
        if not isinstance(node.func, ast.Name) or node.func.id not in ("sine_of", "cosine_of"):
            return node
        k = len(self.before) + 1
        name, angle = f"turned_{k}", ast.unparse(node.args[0])
        both = f"{name}, _" if node.func.id == "sine_of" else f"_, {name}"
        self.before.append(f"{both} = sin_cos({angle})")
        return ast.Name(name)


def _straight(text: str) -> tuple[list[str], set[str]]:
    """Return lines of straight text, and the names that they read."""
    lines, straight = list[str](), _Straight()
    for statement in ast.parse(text).body:
        done = len(straight.before)
        changed = straight.visit(statement)
        lines += straight.before[done:]
        lines.append(ast.unparse(changed))
    names = {n.id for line in lines for n in ast.walk(ast.parse(line)) if isinstance(n, ast.Name)}
    return lines, names


def _term(effect: DictionaryEffect) -> str:
    first, *more = (_term_of(effect, part) for part in effect.written)
    also = "".join(f"\n        Term({row})," for row in more)
    also = f"\n    also=({also}\n    )," if also else ""
    return f"TERM = Term(\n    {first}{also}\n)  # fmt: skip"


def _term_of(effect: DictionaryEffect, part: Written) -> str:
    how, target = part.target.split()
    still = f'neutral={{"{effect.parameters[0].name}": 0.0}},' if part.keeps is None else ""
    chosen = "" if part.keeps is None else f"keeps={part.keeps},"
    return (
        f'{file_name(effect)}{part.suffix}, per=Per.{part.per.name}, {how}="{target}",\n'
        f"    params=_PARAMS, {still}{chosen}"
    )
