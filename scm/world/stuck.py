"""Detect stuck cars: commanded to drive for seconds, while the rear axle stays where it is.

    throttle of MIN_THROTTLE or more, either way, for STUCK_AFTER_NS
    and the rear axle within MOVED_M of where that began             stuck
    the rear axle farther than that, whoever moved it              free again

A car that waits in a queue or at a line has no throttle and is never stuck. It most likely pushes
against what it touched last. A hosted driver releases the throttle of a stuck car, and tries again
from time to time.
"""

import operator
from collections import deque
from collections.abc import Sequence

import numpy as np

from scm.arrays import AnyArray, Bools, Floats, Ints
from scm.clock import NS_PER_MS, NS_PER_S

MIN_THROTTLE = 0.05  # a Nigel with this drives twice as far as MOVED_M in STUCK_AFTER_NS
STUCK_AFTER_NS = 4 * NS_PER_S
MOVED_M = 0.03
REST_NS = 6 * NS_PER_S  # a stuck driver's throttle is released for this, then tried for TRY_NS
TRY_NS = 2 * NS_PER_S
TOUCH_MEMORY_NS = 500 * NS_PER_MS  # in which a touched thing is what it pushes against


class Stuck:
    """Which cars of a world are stuck, by slot.

    Attributes:
        against: What those that are stuck push against, as far as is known: cars, walls, boxes.
    """

    def __init__(self, capacity: int) -> None:
        self.against: dict[int, tuple[str, ...]] = {}
        self._x, self._y = np.full((2, capacity), np.inf)
        self._since_ns = np.zeros(capacity, np.int64)
        self._stuck = np.zeros(capacity, np.bool_)
        self._touches: deque[tuple[int, Ints, Ints]] = deque()

    def feel(self, t_ns: int, indices: Ints, pairs: Ints) -> None:
        """Remember for a moment who touched whom, as in `Touches`: rows of `indices`."""
        self._touches.append((t_ns, indices, pairs))
        while self._touches[0][0] < t_ns - TOUCH_MEMORY_NS:
            self._touches.popleft()

    def touches(self, now_ns: int) -> list[tuple[Ints, Ints]]:
        """Return the slots and pairs of the contact steps of the last moment."""
        return [(s, pairs) for t_ns, s, pairs in self._touches if t_ns >= now_ns - TOUCH_MEMORY_NS]

    def look(self, throttle: Floats, x: Floats, y: Floats, t_ns: int) -> tuple[Ints, Ints]:
        """Return the slots that are stuck, and those that are free again, since the last time.

        Args:
            throttle: (capacity,) each car's command, -1 to 1; 0 where there is none.
            x: (capacity,) of the rear axles [m]; likewise `y`.
            y: See `x`.
            t_ns: The present time without what was lost: nobody moved then [ns].
        """
        moved = np.hypot(x - self._x, y - self._y) > MOVED_M
        idle = ~self._stuck & (np.abs(throttle) < MIN_THROTTLE)
        free = np.flatnonzero(self._stuck & moved)
        begin = moved | idle
        self._x[begin], self._y[begin], self._since_ns[begin] = x[begin], y[begin], t_ns
        self._stuck[free] = False
        pushes = ~begin & ~self._stuck
        new = np.flatnonzero(pushes & (t_ns - self._since_ns >= STUCK_AFTER_NS))
        self._stuck[new] = True
        self._since_ns[new] = t_ns
        for index in free.tolist():
            del self.against[index]
        self.against.update(dict.fromkeys(new.tolist(), ()))
        return new, free

    def rests(self, t_ns: int) -> Bools:
        """Return by slot which stuck cars their drivers do not try to free now; time as above."""
        at_ns = (t_ns - self._since_ns) % (REST_NS + TRY_NS)
        rests: Bools = self._stuck & (at_ns < REST_NS)
        return rests

    def memory(self, index: int) -> tuple[AnyArray, ...]:
        """Return views of all that is stored of a car, except what it touches."""
        of = slice(index, index + 1)
        return self._x[of], self._y[of], self._since_ns[of], self._stuck[of]

    def touched(self, index: int, now_ns: int) -> tuple[tuple[int, int], ...]:
        """Return when and what a car has touched in the last moment: slots, or as in `Touches`."""
        found = set[tuple[int, int]]()
        for t_ns, indices, pairs in self._touches:
            if t_ns < now_ns - TOUCH_MEMORY_NS:
                continue
            for row in np.flatnonzero(indices == index).tolist():
                a, b = pairs.T
                others = np.concatenate((b[a == row], a[b == row])).tolist()
                found.update((t_ns, int(indices[o]) if o >= 0 else o) for o in others)
        return tuple(sorted(found))

    def remember(self, index: int, touched: Sequence[tuple[int, int]]) -> None:
        """Add what `touched` returned in another process."""
        for t_ns, other in touched:
            indices = np.array([index, other] if other >= 0 else [index])
            pairs = np.array([[0, 1 if other >= 0 else other]])
            self._touches.append((t_ns, indices, pairs))
        self._touches = deque(sorted(self._touches, key=operator.itemgetter(0)))

    def forget(self, index: int) -> None:
        """Forget a car that leaves."""
        self._stuck[index] = False
        self._x[index] = self._y[index] = np.inf
        self.against.pop(index, None)
