"""When hosted cars must send a CAM: the rule of `v2x.cam_trigger` for all of them at once."""

import numpy as np

from scm.arrays import Bools, Ints
from scm.v2x.cam_trigger import HEADING_RAD, N_GEN_CAM, POSITION_M, SPEED_MPS, T_MAX_NS, T_MIN_NS
from scm.v2x.congestion import ReactiveControl
from scm.v2x.etsi.path import EVERY_NS
from scm.world.vehicle_arrays import VehicleArrays

FEW, TICKS_BETWEEN = 100, 5  # CAMs that one tick always allows; ticks in 100 ms
_NEVER_NS = -(2**62)


class CamTriggers:
    """The rule's state by vehicle index; call `due` every tick.

    If many are due at once, those that sent last wait for the next ticks: a fifth of the cars a
    tick is what 100 ms between two CAMs of a car allow in the long run.
    """

    def __init__(self, capacity: int) -> None:
        self._sent_ns = np.full(capacity, _NEVER_NS)
        self._low_ns = np.full(capacity, _NEVER_NS)
        self._interval_ns = np.full(capacity, T_MAX_NS)
        self._quiet = np.zeros(capacity, np.int64)
        self._x, self._y, self._yaw, self._speed = (np.zeros(capacity) for _ in range(4))

    def forget(self, index: int) -> None:
        """Reset an index for its next car."""
        self._sent_ns[index] = self._low_ns[index] = _NEVER_NS
        self._interval_ns[index], self._quiet[index] = T_MAX_NS, 0

    def due(
        self, vehicles: VehicleArrays, now_ns: int, control: ReactiveControl | None = None
    ) -> Ints:
        """Return the indices, ascending, whose CAM is due now; they count as sent.

        `control` may allow each car less than a CAM every 100 ms.
        """
        gap_ns = T_MIN_NS if control is None else np.maximum(T_MIN_NS, control.gap_ns)
        candidates = np.flatnonzero(vehicles.hosted & (now_ns - self._sent_ns >= gap_ns))
        moved = self._moved(vehicles, candidates)
        owed = moved | (now_ns - self._sent_ns[candidates] >= self._interval_ns[candidates])
        due, moved = candidates[owed], moved[owed]
        most = max(FEW, int(vehicles.hosted.sum()) // TICKS_BETWEEN)
        if len(due) > most:
            first = np.sort(np.argsort(self._sent_ns[due], kind="stable")[:most])
            due, moved = due[first], moved[first]
        self._after_motion(due[moved], now_ns)
        self._after_rest(due[~moved])
        self._sent_ns[due] = now_ns
        for last, now in (
            (self._x, vehicles.x), (self._y, vehicles.y), (self._yaw, vehicles.yaw),
            (self._speed, vehicles.speed),
        ):  # fmt: skip
            last[due] = now[due]
        return due

    def low_frequency_due(self, due: Ints, now_ns: int) -> Bools:
        """Return which CAMs that are sent now have the low-frequency container, (k,)."""
        is_due: Bools = now_ns - self._low_ns[due] >= EVERY_NS
        self._low_ns[due[is_due]] = now_ns
        return is_due

    def _moved(self, vehicles: VehicleArrays, candidates: Ints) -> Bools:
        turned = np.abs(vehicles.yaw[candidates] - self._yaw[candidates])
        turned = np.minimum(turned, 2.0 * np.pi - turned)
        way = np.hypot(
            vehicles.x[candidates] - self._x[candidates],
            vehicles.y[candidates] - self._y[candidates],
        )
        faster = np.abs(vehicles.speed[candidates] - self._speed[candidates])
        first = self._sent_ns[candidates] == _NEVER_NS
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
