"""The contract of a physical effect: a pure scalar function, and its facts as data.

The function's argument names are its wiring: each is a variable of `physics_variables.py`, a
parameter of the term, or one of the 14-degree-of-freedom skeleton. It knows no arrays and no
configuration.
"""

import inspect
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache

from scm.errors import TermError
from scm.vehicles import effect_text
from scm.vehicles.identification import Identification
from scm.vehicles.jit import plain
from scm.vehicles.param import Param
from scm.vehicles.physics_variables import Per

__all__ = ["Function", "Per", "Term", "flat", "reads"]

Function = Callable[..., float]


@cache
def reads(function: Function) -> tuple[str, ...]:
    """Return the argument names of a function, in order."""
    return tuple(inspect.signature(plain(function)).parameters)


@dataclass(frozen=True, slots=True)
class Term:
    """One physical effect.

    Attributes:
        function: Pure function of floats, named like its file.
        per: Once a body or once a wheel.
        adds: The sum that its value is added to; exactly one of `adds` and `sets` is given.
        sets: The variable whose value the function gives; a car has one setter for a variable.
        damping: How fast its value falls with its own rate (`DAMPED_BY`), >= 0, named
            `<function>_damping`. The skeleton is implicit in it, so stiff effects rest at 1 ms.
        keeps: The function reads the last value of what it sets: a state, this its start value.
        params: Numbers the function reads; a car file fills them.
        passive: The effect never gives energy to the car.
        neutral: Parameter values at which the effect does nothing, bit for bit.
        shows_in: Manoeuvres that make the effect visible.
        also: Further functions of the same file that come with this one: wind has two directions.
        identification: How recordings show it; None: a search never proposes it.
    """

    function: Function
    per: Per
    adds: str | None = None
    sets: str | None = None
    damping: Function | None = None
    keeps: float | None = None
    params: tuple[Param, ...] = ()
    passive: bool = False
    neutral: Mapping[str, float] = field(default_factory=dict)
    shows_in: tuple[str, ...] = ()
    also: tuple["Term", ...] = ()
    identification: Identification | None = None

    def __post_init__(self) -> None:
        if (self.adds is None) == (self.sets is None):
            msg = (
                f"{self.name}: a term either adds to a sum or sets a variable, exactly one of both"
            )
            raise TermError(msg)
        # further functions of a file may share the first one's: air drag falls alike both ways
        stem, suffix, _ = (self.damping or self.function).__name__.partition("_damping")
        if self.damping is not None and not (suffix and self.name.startswith(stem)):
            msg = f"{self.name}: expected a damping function named {self.name}_damping, "
            raise TermError(msg + f"got {self.damping.__name__}")

    @property
    def name(self) -> str:
        """The function's name, which is its file's."""
        return self.function.__name__

    @property
    def target(self) -> str:
        """The sum or variable that the function gives a value."""
        return self.adds or self.sets or ""

    @property
    def module(self) -> str:
        """Where the function is written."""
        return self.function.__module__

    def doc_line(self, heading: str) -> str:
        """Return what the file says after `Holds:`, `Shows in:`, `Source:`; empty when nothing."""
        return effect_text.after_heading(self.function, heading)

    @property
    def about(self) -> str:
        """The first line of the file: what the effect is."""
        return effect_text.about(self.function)

    @property
    def equation(self) -> str:
        """The indented lines of the file's docstring, joined."""
        return effect_text.equation(self.function)


def flat(terms: Iterable[Term]) -> tuple[Term, ...]:
    """Return the effects with every further function of their files behind each, in order, once."""
    return tuple({part.name: part for term in terms for part in (term, *term.also)}.values())
