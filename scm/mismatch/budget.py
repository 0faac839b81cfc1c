"""How long a search may take, and the questions that there was no time for.

What may be given up is an attempt: once time is up, the next sets that it wants driven are refused,
and its question counts as left. What must be done whatever the time, like the first fit, is none.
"""

import math
from collections.abc import Callable
from enum import StrEnum
from typing import TypeVar

from scm.clock import Clock, processor_s, seconds
from scm.mismatch.findings import Unanswered

DEFAULT_S = 1800.0  # enough for all that is looked for, on a slow and busy computer too
MOST_KEPT = 0.5  # of what was allowed
COMPARED = 3.0  # seconds of a recording for each second: a first fit of them takes half of it
LEAST_COMPARED_S = 90.0  # less shows too little, however short the time
_Answer = TypeVar("_Answer")


class Question(StrEnum):
    """What a search asks, as a report names what it left."""

    EFFECTS = "effects"
    FURTHER = "further_effects"
    CALM = "calm"
    LAWS = "laws"
    BESIDE = "beside_law"
    STRIDES = "strides"


WORDS = {
    Question.EFFECTS: "Effects of the library were not tried",
    Question.FURTHER: "Effects beside those found were not sought",
    Question.CALM: "Effects that the noise believed in may hide were not sought",
    Question.LAWS: "Laws outside the library were not sought",
    Question.BESIDE: "Effects beside the law found were not sought",
    Question.STRIDES: "The car differs in many ways, and these were not sought",
}


class OutOfTimeError(Exception):
    """Time is up in the midst of an attempt; it never leaves a search."""


def needed_s(compared_s: float) -> float:
    """Return the least budget in which recordings of that length are compared whole [s]."""
    return math.ceil(compared_s / COMPARED)


class Budget:
    """Time for a search, from now on; without a clock it never ends.

    Args:
        asked_s: After so long a diagnosis is to be there.
        clock: Says how late it is.
        processor: Says how much processor time the process has had [s].
    """

    def __init__(
        self,
        asked_s: float = math.inf,
        clock: Clock | None = None,
        processor: Callable[[], float] = processor_s,
    ) -> None:
        self._asked_s, self._clock = asked_s, clock
        self._processor, self._processor_s = processor, processor()
        self._began_ns = clock.now_ns() if clock else 0
        self._kept_s, self._attempts = 0.0, False
        self._left: dict[Question, Unanswered] = {}

    @property
    def unasked(self) -> tuple[Unanswered, ...]:
        """Questions that were left, in the order in which they came up, each once."""
        return tuple(self._left.values())

    def spent_s(self) -> float:
        """Return how long it has been [s]."""
        return seconds(self._clock.now_ns() - self._began_ns) if self._clock else 0.0

    def processor_share(self) -> float:
        """Return how much of one processor the process got so far; several threads get more."""
        spent_s = self.spent_s()
        return (self._processor() - self._processor_s) / spent_s if spent_s else 1.0

    def allowed_s(self) -> float:
        """Return how long recordings can be that are compared whole in that time [s]."""
        return max(LEAST_COMPARED_S, COMPARED * self._asked_s)

    def keep(self, kept_s: float) -> None:
        """Keep time for what follows a search, half of all at most."""
        self._kept_s = min(kept_s, MOST_KEPT * self._asked_s)

    def is_over(self) -> bool:
        """Say whether what is left is needed for what follows."""
        return self.spent_s() >= self._asked_s - self._kept_s

    def is_spent(self) -> bool:
        """Say whether nothing is left, not even for what follows."""
        return self.spent_s() >= self._asked_s

    def check(self) -> None:
        """Give up the present attempt, if there is one, where time is up.

        Raises:
            OutOfTimeError: then.
        """
        if self._attempts and self.is_over():
            raise OutOfTimeError

    def attempt(self, question: Question, work: Callable[[], _Answer]) -> _Answer | None:
        """Return what work finds; None where time is up before, then the question is left."""
        begun, outer = not self.is_over(), self._attempts
        self._attempts = True
        try:
            return work()
        except OutOfTimeError:
            self._leave(question, begun=begun)
            return None
        finally:
            self._attempts = outer

    def _leave(self, question: Question, *, begun: bool) -> None:
        how = " to the end" if begun else ""
        said = f"{WORDS[question]}{how}: the budget of {self._asked_s:g} s ended."
        self._left.setdefault(question, Unanswered(name=question.value, text=said))
