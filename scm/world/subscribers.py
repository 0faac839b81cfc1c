"""Who subscribes to what: costly messages are made only for subscribers."""

from collections.abc import Sequence

from scm.runtime.part import IsWanted
from scm.v2x.message import Message

REFRESH_EVERY_TICKS = 50  # once a second, for single stations: many
REFRESH_CLASSES_EVERY_TICKS = 5  # ten times a second, for whole classes: few
NOBODY = "_"  # a name that no car has: only a wildcard matches it


class Subscribers:
    """Caches which messages have subscribers on the bus; without a bus all have."""

    def __init__(self) -> None:
        self._is_wanted: IsWanted | None = None
        self._tick = 0
        self._known: dict[tuple[type[Message], str], bool] = {}
        self._any: dict[type[Message], bool] = {}

    def attach(self, is_wanted: IsWanted) -> None:
        """Use the bus from now on."""
        self._is_wanted = is_wanted
        self._any.clear()

    def begin_tick(self) -> None:
        """Count a tick: known answers expire."""
        self._tick += 1
        if self._tick % REFRESH_CLASSES_EVERY_TICKS == 0:
            self._any.clear()
        if self._tick % REFRESH_EVERY_TICKS == 0:
            self._known.clear()

    def any(self, kind: type[Message]) -> bool:
        """Return whether anybody subscribes to any message of a class."""
        known = self._any.get(kind)
        if known is None:
            known = self._any[kind] = self._is_wanted is None or self._is_wanted(kind, {})
        return known

    def all(self, kind: type[Message], key: str) -> bool:
        """Return whether somebody subscribes to a class whatever the key part."""
        return self._is_wanted is None or self._one(kind, key, NOBODY)

    def of(self, kind: type[Message], key: str, names: Sequence[str]) -> list[bool]:
        """Return for each name whether messages of a class with this key part have subscribers."""
        if self.all(kind, key):
            return [True] * len(names)
        if not self.any(kind):
            return [False] * len(names)
        return [self._one(kind, key, name) for name in names]

    def _one(self, kind: type[Message], key: str, name: str) -> bool:
        known = self._known.get((kind, name))
        if known is None:
            known = self._is_wanted is None or self._is_wanted(kind, {key: name})
            self._known[kind, name] = known
        return known
