"""Network faults from a seed, for the memory bus: repeatable bit for bit.

Messages may be lost, duplicated, delayed or reordered. The two sides of a partition receive nothing
from each other. `Presence` and retained messages are always delivered. Between two cities stations
are named `<city>/<station>`, so that a partition can cut the link and leave each city whole.
"""

import random
from collections.abc import Iterable
from dataclasses import dataclass

from scm.clock import nanoseconds
from scm.errors import RunError


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultRates:
    """The probability of each fault, 0 to 1.

    Attributes:
        late_s: The longest delay [s].

    Raises:
        RunError: naming what cannot be.
    """

    drop: float = 0.0
    duplicate: float = 0.0
    late: float = 0.0
    late_s: float = 0.5

    def __post_init__(self) -> None:
        for name in ("drop", "duplicate", "late"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise RunError(f"{name}: expected 0 to 1, got {getattr(self, name):g}")
        if self.late_s < 0.0:
            raise RunError(f"late_s: expected a time, got {self.late_s:g}")


class Faults:
    """Decides the fate of each message between two stations.

    Attributes:
        rates: In force now.
        link_rates: Of messages from one city to another; None: `rates`.
    """

    def __init__(self, seed: int, rates: FaultRates | None = None) -> None:
        self._seed = seed
        self._rngs: dict[tuple[str, str], random.Random] = {}
        self.rates = rates or FaultRates()
        self.link_rates: FaultRates | None = None
        self._partitioned: frozenset[str] = frozenset()

    def partition(self, stations: Iterable[str]) -> None:
        """Separate these stations from all others; an empty list ends the partition."""
        self._partitioned = frozenset(stations)

    def delays(self, sender: str, receiver: str, *, over_link: bool = False) -> tuple[int, ...]:
        """Return the delays of all copies of one message [ns]; empty: it is lost."""
        if (sender in self._partitioned) != (receiver in self._partitioned):
            return ()
        rng = self._rngs.get((sender, receiver))
        rates = (self.link_rates if over_link else None) or self.rates
        if rng is None:  # each pair has its own: a further receiver changes nothing for the others
            rng = random.Random(f"{self._seed} {sender} {receiver}")
            self._rngs[sender, receiver] = rng
        if rng.random() < rates.drop:
            return ()
        copies = 2 if rng.random() < rates.duplicate else 1
        return tuple(_delay(rng, rates) for _ in range(copies))


def _delay(rng: random.Random, rates: FaultRates) -> int:
    if rng.random() >= rates.late:
        return 0
    return nanoseconds(rng.uniform(0.0, rates.late_s))
