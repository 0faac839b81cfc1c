"""Known effects whose number depends on a variable: a servo that is slower while the motor pulls.

The number goes in proportion to the variable from where the effect does nothing, or from the car's
own number. A search lets it follow the variable as recorded; a car file gets an effect of its own,
which computes it from the simulated car.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from scm.mismatch.effect_catalogue import Candidate
from scm.mismatch.recorded_range import NO_RANGES, Ranges, holds, limit
from scm.replay.drive import Drive
from scm.replay.numbers import AT, BEFORE, BY
from scm.replay.recorded_variables import HOT_S, PLACES, VARIABLES, WARM_S, usual_most
from scm.vehicles.car import all_terms
from scm.vehicles.own_term import SUFFIX, load_own_term
from scm.vehicles.term import Term, reads

RARE = 10.0  # what it must gain beyond the constant effect: many variables were tried
SLOPE = "slope"  # of the number against the variable, as it is reported and written
_FAR = 1e4


@dataclass(frozen=True, slots=True)
class Dependence:
    """A variable on which a number may depend, as a car computes it.

    Attributes:
        name: That of the recorded variable.
        sentence: Completes "In proportion to ...".
        reads: The car's variables in `value`.
        value: As a function of these.
        memory_s: How long the throttle is remembered; 0: it is not.
        grows: Whether the value has no bound of its own.
    """

    name: str
    sentence: str
    reads: tuple[str, ...]
    value: str
    memory_s: float = 0.0
    grows: bool = True


_LEFT = "while the command steers to the {}"
DEPENDENCES = (
    Dependence("throttle", "in proportion to the throttle", ("throttle_command",),
               "abs(throttle_command)"),
    Dependence("speed", "in proportion to the speed", ("vx",), "abs(vx)"),
    Dependence("load", "in proportion to the acceleration across", ("accel_y",), "abs(accel_y)"),
    Dependence("steering angle", "in proportion to the angle commanded", ("steer_demand",),
               "abs(steer_demand)"),
    Dependence("left turns", _LEFT.format("left"), ("steer_demand",),
               "1.0 if steer_demand > 0.0 else 0.0", grows=False),
    Dependence("right turns", _LEFT.format("right"), ("steer_demand",),
               "1.0 if steer_demand < 0.0 else 0.0", grows=False),
    Dependence("use", f"in proportion to the mean throttle of the last {WARM_S:g} s",
               ("throttle_memory",), "throttle_memory", memory_s=WARM_S),
    Dependence("long use", f"in proportion to the mean throttle of the last {HOT_S:g} s",
               ("throttle_memory",), "throttle_memory", memory_s=HOT_S),
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class VaryingEffect(Candidate):
    """A known effect of one number that depends on a variable, a candidate like any other.

    Its parameter is the number where the variable has its usual most.

    Attributes:
        of: The effect.
        by: What its number depends on.
        usual_most: Of the variable.
    """

    of: Candidate
    by: Dependence
    usual_most: float

    @property
    def replaces_own(self) -> bool:
        """Whether it takes the place of the car's own number; that is where it begins."""
        return False

    def numbers(self, values: tuple[float, ...]) -> dict[str, float]:
        """Return the numbers by key: at the usual most, at none, and what they follow."""
        (parameter,) = self.of.parameters
        found = self.of.numbers(values)
        at_rest = self.of.numbers((parameter.neutral,))
        key = parameter.key
        place = float(PLACES[self.by.name])
        return {**found, key + BEFORE: at_rest[key], key + BY: place, key + AT: self.usual_most}

    @property
    def variable_unit(self) -> str:
        """The unit of the variable."""
        return VARIABLES[PLACES[self.by.name]].unit

    @property
    def slope_unit(self) -> str:
        """The unit of the number over that of the variable."""
        unit, per = self.of.parameters[0].unit, self.variable_unit
        return unit if per == "1" else f"{unit}/({per})" if "/" in per else f"{unit}/{per}"

    def slope(self, values: Sequence[float], own: Mapping[str, float]) -> float:
        """Return how much the car file's number grows with one unit of the variable.

        Args:
            values: Of its parameter.
            own: The car's own numbers by key.
        """
        (parameter,) = self.of.parameters
        begin = own.get(parameter.key, parameter.neutral * parameter.per_unit)
        return (values[0] * parameter.per_unit - begin) / self.usual_most

    def formula(self, values: Sequence[float], own: Mapping[str, float]) -> str:
        """Return how its number depends on the variable, with numbers and units."""
        (parameter,) = self.of.parameters
        unit = "" if parameter.unit == "1" else f" {parameter.unit}"
        begin = own.get(parameter.key, parameter.neutral)
        slope = self.slope(values, own)
        per = self.variable_unit
        over = "" if per == "1" else f" / (1 {per})"
        text = f"{parameter.name} = {begin:.4g} + {slope:.3g}{unit} * {self.by.name}{over}"
        return text.replace("+ -", "- ").replace("= 0 + ", "= ").replace("= 0 - ", "= -")


def may_vary(effect: Candidate) -> bool:
    """Return whether an effect's number may depend on a variable."""
    term = all_terms().get(effect.name)
    how = None if term is None else term.identification
    return how is not None and how.varies and type(effect) is Candidate


def dependences_of(effect: Candidate, drives: Sequence[Drive]) -> Iterator[VaryingEffect]:
    """Yield an effect with its number depending on each variable that recordings vary enough."""
    if not may_vary(effect):
        return
    for by in DEPENDENCES:
        most = _usual_most(by.name, tuple(drives))
        if most > 0.0:
            yield varying(effect, by, most)


def varying(effect: Candidate, by: Dependence, most: float) -> VaryingEffect:
    """Return an effect whose number depends on a variable of this usual most."""
    return VaryingEffect(
        name=f"{effect.name.replace('_', ' ')} against {by.name}", equation=effect.equation,
        depends_on=(by.name,), parameters=effect.parameters, starts=effect.starts,
        sentence=f"{effect.sentence[:-1]} at its most, {by.sentence}.", rare=effect.rare + RARE,
        like=effect.name, of=effect, by=by, usual_most=most,
    )  # fmt: skip


@cache
def _usual_most(name: str, drives: tuple[Drive, ...]) -> float:
    return usual_most(VARIABLES[PLACES[name]], drives)


def own_key(effect: VaryingEffect) -> str:
    """Return the car file's key of the number's slope against the variable."""
    return f"{_stem(effect)}.{SLOPE}"


def as_own_term(
    effect: VaryingEffect, values: Sequence[float], folder: Path, own: Mapping[str, float],
    ranges: Ranges = NO_RANGES,
) -> tuple[Term, dict[str, float]]:  # fmt: skip
    """Write an effect's file; return the effect it holds, and the car file's number for it.

    Args:
        effect: To be written.
        values: Of its parameter.
        folder: Of the file.
        own: The car's own numbers by key.
        ranges: To which it is limited, by what it depends on.

    Raises:
        TermError: when what was written does not load; then it is our fault.
    """
    name = _stem(effect) + SUFFIX
    (folder / name).write_text(_text(effect, values, own, ranges), encoding="utf-8")
    return load_own_term(folder, name), {own_key(effect): effect.slope(values, own)}


def _stem(effect: VaryingEffect) -> str:
    return re.sub(r"\W+", "_", effect.name)


def _text(
    effect: VaryingEffect, values: Sequence[float], own: Mapping[str, float], ranges: Ranges
) -> str:
    """Return the file: the library's function, called with the number as it is now."""
    stem, base, by = _stem(effect), all_terms()[effect.of.name], effect.by
    known = {param.reported: param for param in base.params}
    param = known[effect.of.parameters[0].name]
    low, high = param.bounds
    given = reads(base.function)
    arguments = [*given, *(name for name in by.reads if name not in given), SLOPE]
    signature = ",\n    ".join(f"{name}: float" for name in arguments)
    call = ", ".join("here" if name == param.name else name for name in given)
    lines, value = limit(by.value, by.reads if by.grows else (), ranges)
    lines.append(f"here = min(max({param.name} + {SLOPE} * ({value}), {low}), {high})")
    memory = _MEMORY.format(stem=stem, memory_s=by.memory_s) if by.memory_s else ""
    also = f"\n    also=(*{base.name.upper()}.also, {stem}_memory_term)," if memory else ""
    return _FILE.format(
        title=effect.name.capitalize(), base=base.name, upper=base.name.upper(), stem=stem,
        value=by.value, number=param.name, lines="\n    ".join(lines),
        holds=holds(ranges, limited=by.grows), signature=signature, call=call,
        unit=effect.slope_unit, far=_FAR, memory=memory, also=also,
        formula=effect.formula(values, own),
        sentence=effect.sentence.format(**{param.reported: f"`{param.reported}`"}),
        module=base.module, key=own_key(effect),
    )  # fmt: skip


_MEMORY = '''
@kernel_function
def {stem}_memory(throttle_memory: float, throttle_command: float, dt: float) -> float:
    """Mean size of the throttle command of late, which fades."""
    return throttle_memory + (abs(throttle_command) - throttle_memory) * (dt / ({memory_s} + dt))


{stem}_memory_term = Term({stem}_memory, per=Per.BODY, sets="throttle_memory", keeps=0.0)

'''
_FILE = '''"""{title}: a known effect whose number depends on a variable.

    {number} + slope * ({value}), then as `{base}`
    found as {formula}

{sentence}
Holds: {holds}.
Shows in: the recording it was learned from.
Source: `scm mismatch`.
"""

from dataclasses import replace

from scm.vehicles.jit import kernel_function
from scm.vehicles.param import Param
from scm.vehicles.term import Per, Term
from {module} import TERM as {upper}
from {module} import {base}

{memory}
@kernel_function
def {stem}(
    {signature},
) -> float:  # fmt: skip
    """As `{base}`, its number as it is now."""
    {lines}
    return {base}({call})


TERM = replace(
    {upper},
    function={stem},
    params=(
        *{upper}.params,
        Param("slope", 0.0, "{unit}", "{key}", (-{far}, {far}),
              "how much the number grows with the variable"),
    ),
    neutral={{**{upper}.neutral, "slope": 0.0}},{also}
    identification=None,
)  # fmt: skip
'''
