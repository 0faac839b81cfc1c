"""Batteries that run low: each is told once, and again only after it was charged."""

from collections.abc import Mapping

LOW = 0.2
CHARGED = 0.3


class Batteries:
    """Remembers which cars were told to be low."""

    def __init__(self) -> None:
        self._low: set[str] = set()

    def news(self, charges: Mapping[str, float | None]) -> list[str]:
        """Return who is low since the last time, of all cars; a charge is None where unknown."""
        known = {name: charge for name, charge in charges.items() if charge is not None}
        self._low = {name for name in self._low & charges.keys() if known.get(name, LOW) < CHARGED}
        news = [name for name, charge in known.items() if charge < LOW and name not in self._low]
        self._low.update(news)
        return news
