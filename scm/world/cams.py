"""When hosted cars owe the air a CAM: the rule of `v2x.cam_trigger` for all of them at once."""

import numpy as np

from scm.arrays import Bools, Ints
from scm.v2x.cam_trigger import HEADING_RAD, N_GEN_CAM, POSITION_M, SPEED_MPS, T_MAX_NS, T_MIN_NS
from scm.v2x.congestion import ReactiveControl
from scm.world.slots import Slots

FEW, TICKS_BETWEEN = 100, 5
_NEVER_NS = -(2**62)


class CamTriggers:
    """The rule's memory by slot; ask it every tick.

    When many owe one at once, those wait for the next ticks who spoke last: a fifth of the cars in
    a tick is what 100 ms between two CAMs of a car allow in the long run.
    """

    def __init__(self, capacity: int) -> None:
        self._sent_ns = np.full(capacity, _NEVER_NS)
        self._interval_ns = np.full(capacity, T_MAX_NS)
        self._quiet = np.zeros(capacity, np.int64)
        self._x, self._y, self._yaw, self._speed = (np.zeros(capacity) for _ in range(4))

    def forget(self, slot: int) -> None:
        """Let the next car in a slot begin anew."""
        self._sent_ns[slot], self._interval_ns[slot], self._quiet[slot] = _NEVER_NS, T_MAX_NS, 0

    def due(self, slots: Slots, now_ns: int, control: ReactiveControl | None = None) -> Ints:
        """Return the slots, ascending, whose CAM must go now; they count as sent.

        `control` may allow each car less than a CAM every 100 ms.
        """
        gap_ns = T_MIN_NS if control is None else np.maximum(T_MIN_NS, control.gap_ns)
        asked = np.flatnonzero(slots.hosted & (now_ns - self._sent_ns >= gap_ns))
        moved = self._moved(slots, asked)
        owed = moved | (now_ns - self._sent_ns[asked] >= self._interval_ns[asked])
        due, moved = asked[owed], moved[owed]
        most = max(FEW, int(slots.hosted.sum()) // TICKS_BETWEEN)
        if len(due) > most:
            first = np.sort(np.argsort(self._sent_ns[due], kind="stable")[:most])
            due, moved = due[first], moved[first]
        self._after_motion(due[moved], now_ns)
        self._after_rest(due[~moved])
        self._sent_ns[due] = now_ns
        for kept, now in (
            (self._x, slots.x), (self._y, slots.y), (self._yaw, slots.yaw),
            (self._speed, slots.speed),
        ):  # fmt: skip
            kept[due] = now[due]
        return due

    def _moved(self, slots: Slots, asked: Ints) -> Bools:
        turned = np.abs(slots.yaw[asked] - self._yaw[asked])
        turned = np.minimum(turned, 2.0 * np.pi - turned)
        way = np.hypot(slots.x[asked] - self._x[asked], slots.y[asked] - self._y[asked])
        faster = np.abs(slots.speed[asked] - self._speed[asked])
        first = self._sent_ns[asked] == _NEVER_NS
        moved: Bools = (turned > HEADING_RAD) | (way > POSITION_M) | (faster > SPEED_MPS)
        moved &= ~first
        return moved

    def _after_motion(self, moved: Ints, now_ns: int) -> None:
        self._interval_ns[moved] = np.minimum(now_ns - self._sent_ns[moved], T_MAX_NS)
        self._quiet[moved] = 0

    def _after_rest(self, lapsed: Ints) -> None:
        lapsed = lapsed[self._sent_ns[lapsed] != _NEVER_NS]
        self._quiet[lapsed] += 1
        self._interval_ns[lapsed[self._quiet[lapsed] >= N_GEN_CAM]] = T_MAX_NS
