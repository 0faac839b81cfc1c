"""How long a diagnosis may take, and the questions that there was no time for.

Work that may be given up is an attempt: once time is up, it ends at the next sets that it wants
driven, and its question counts as unanswered. What must be done anyhow, like the first fit, is no
attempt.
"""

import math
from collections.abc import Callable
from enum import StrEnum
from typing import Any, TypeVar

from scm.clock import Clock, nanoseconds, processor_s, seconds
from scm.mismatch.findings import Unanswered

DEFAULT_S = 1800.0  # enough for a whole diagnosis, on a slow and busy computer too
MAX_RESERVED = 0.5  # share of the budget
COMPARED_PER_S = 3.0  # seconds of a recording: their first fit takes half of the budget
MIN_COMPARED_S = 90.0  # less shows too little, however short the time
_Answer = TypeVar("_Answer")


class Question(StrEnum):
    """A question that a selection answers, by its name in `report.json`."""

    EFFECTS = "effects"
    FURTHER = "further_effects"
    LOW_NOISE = "calm"
    DISCOVERY = "laws"
    BESIDE = "beside_law"
    WINDOWS = "strides"
    WITNESS = "from_witness"
    WIDER = "wider_numbers"


WORDS = {
    Question.EFFECTS: "The effects of the catalogue were not tried",
    Question.FURTHER: "Effects beside those found were not searched for",
    Question.LOW_NOISE: "Effects that the assumed noise may hide were not searched for",
    Question.DISCOVERY: "Effects outside the catalogue were not searched for",
    Question.BESIDE: "Effects beside the one discovered were not searched for",
    Question.WINDOWS: "The car differs in many ways, which were not searched for",
    Question.WITNESS: "The search was not started again from what a bicycle shows",
    Question.WIDER: "Numbers at an end of their scatter were not given a wider one",
}


class OutOfTimeError(Exception):
    """Time is up during an attempt; it never leaves the diagnosis."""


def needed_s(compared_s: float) -> float:
    """Return the smallest budget in which recordings of that length are compared whole [s]."""
    return math.ceil(compared_s / COMPARED_PER_S)


class Budget:
    """Time for a diagnosis, from now on; without a clock it never ends.

    Args:
        limit_s: When the diagnosis is to be finished.
        clock: For the time.
        processor: Returns how much processor time the process has had [s].
    """

    def __init__(
        self,
        limit_s: float = math.inf,
        clock: Clock | None = None,
        processor: Callable[[], float] = processor_s,
    ) -> None:
        self._limit_s, self._clock = limit_s, clock
        self._processor, self._processor_s = processor, processor()
        self._began_ns = clock.now_ns() if clock else 0
        self._reserved_s, self._attempts = 0.0, False
        self._unanswered: dict[Question, Unanswered] = {}

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_began_ns": self.spent_s()}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)  # other machines' clocks began at other times
        now_ns = self._clock.now_ns() if self._clock else 0
        self._began_ns = now_ns - nanoseconds(state["_began_ns"])

    @property
    def unanswered(self) -> tuple[Unanswered, ...]:
        """Questions that were left, in the order in which they arose, each once."""
        return tuple(self._unanswered.values())

    def spent_s(self) -> float:
        """Return how long it has been [s]."""
        return seconds(self._clock.now_ns() - self._began_ns) if self._clock else 0.0

    def processor_share(self) -> float:
        """Return how much of one processor the process got so far; several threads get more."""
        spent_s = self.spent_s()
        return (self._processor() - self._processor_s) / spent_s if spent_s else 1.0

    def compared_s(self) -> float:
        """Return how long recordings can be that are compared whole in that time [s]."""
        return max(MIN_COMPARED_S, COMPARED_PER_S * self._limit_s)

    def reserve(self, reserved_s: float) -> None:
        """Reserve time for what follows the selection, half of all at most."""
        self._reserved_s = min(reserved_s, MAX_RESERVED * self._limit_s)

    def is_over(self) -> bool:
        """Return whether the time left is needed for what follows the selection."""
        return self.spent_s() >= self._limit_s - self._reserved_s

    def is_spent(self) -> bool:
        """Return whether no time is left, not even for what follows."""
        return self.spent_s() >= self._limit_s

    def check(self) -> None:
        """Give up the present attempt, if there is one, where time is up.

        Raises:
            OutOfTimeError: then.
        """
        if self._attempts and self.is_over():
            raise OutOfTimeError

    def attempt(self, question: Question, work: Callable[[], _Answer]) -> _Answer | None:
        """Return what work finds, or None if time is up before; then the question is left."""
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
        text = f"{WORDS[question]}{how}: the budget of {self._limit_s:g} s ended."
        self._unanswered.setdefault(question, Unanswered(name=question.value, text=text))
