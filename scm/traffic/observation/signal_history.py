"""What signals showed lately, so that a moment can be judged by what was shown then."""

from collections import deque
from typing import NamedTuple

from scm.clock import NS_PER_S
from scm.records.signals import SignalGroup
from scm.v2x.messages.spat import Spat

DEPTH = 40
KNOWN_NS = NS_PER_S // 2


class Shown(NamedTuple):
    """What a group showed, and since when that was red."""

    junction: str
    group: SignalGroup
    since_ns: int


class SignalHistory:
    """The last seconds of every group."""

    def __init__(self) -> None:
        self._rows: dict[tuple[str, str], deque[tuple[int, SignalGroup]]] = {}

    def receive(self, spat: Spat) -> None:
        """Add what a junction shows."""
        for group in spat.groups:
            row = self._rows.setdefault((spat.junction, group.group), deque(maxlen=DEPTH))
            if row and spat.t_ns < row[-1][0]:
                row.clear()  # its clock went back: what came before is another run's
            row.append((spat.t_ns, group))

    def red_at(self, junction: str, group: str, t_ns: int, grace_s: float) -> Shown | None:
        """Return what a group showed at a time if that had been red for longer than the grace.

        Nothing is said where nothing was heard within half a second: nobody is blamed for it.
        """
        row = self._rows.get((junction, group), ())
        shown = next(((at, what) for at, what in reversed(row) if at <= t_ns), None)
        if shown is None or t_ns - shown[0] > KNOWN_NS or shown[1].colour != "red":
            return None
        if t_ns - shown[1].since_ns < grace_s * NS_PER_S:
            return None
        return Shown(junction, shown[1], shown[1].since_ns)

    def is_not_red(self, junction: str, group: str) -> bool:
        """Return whether the newest that was heard of a group is another colour."""
        row = self._rows.get((junction, group))
        return bool(row) and row is not None and row[-1][1].colour != "red"
