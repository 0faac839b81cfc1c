"""Faults of a network, planned by a seed: for the bus in memory, to be repeated bit for bit.

What is sent may be lost, doubled, or come late; what comes late is overtaken by what was sent
after it. Two sides of a partition hear nothing of each other. Who is there (`Presence`), and what
is kept for late joiners, is told all the same.
"""

import random
from collections.abc import Iterable
from dataclasses import dataclass

from scm.clock import nanoseconds


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultRates:
    """How likely each fault is, between 0 and 1.

    Attributes:
        late_s: The longest delay of what comes late [s].
    """

    drop: float = 0.0
    duplicate: float = 0.0
    late: float = 0.0
    late_s: float = 0.5


class Faults:
    """Decides over each thing that goes from one station to another.

    Attributes:
        weather: In force now.
    """

    def __init__(self, seed: int, rates: FaultRates | None = None) -> None:
        self._rng = random.Random(seed)
        self.rates = rates or FaultRates()
        self._partitioned: frozenset[str] = frozenset()

    def partition(self, stations: Iterable[str]) -> None:
        """Part these stations from all others; nobody: the network is whole again."""
        self._partitioned = frozenset(stations)

    def delays(self, sender: str, receiver: str) -> tuple[int, ...]:
        """Return when copies of one thing arrive after it was sent [ns]; nothing: it is lost."""
        if (sender in self._partitioned) != (receiver in self._partitioned):
            return ()
        rng, rates = self._rng, self.rates
        if rng.random() < rates.drop:
            return ()
        copies = 2 if rng.random() < rates.duplicate else 1
        return tuple(self._delay() for _ in range(copies))

    def _delay(self) -> int:
        if self._rng.random() >= self.rates.late:
            return 0
        return nanoseconds(self._rng.uniform(0.0, self.rates.late_s))
