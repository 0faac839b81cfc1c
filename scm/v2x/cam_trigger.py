"""When a car sends a CAM: the generation rules, applied to the enlarged city.

    send if T >= T_min and (heading moved > 4 deg, position > 4 m or speed > 0.5 m/s since the last)
    or   if T >= T_gen                                        100 ms = T_min <= T_gen <= T_max = 1 s

A CAM sent for motion sets T_gen to the interval since the last one; three CAMs in a row without
motion reset it to T_max. 4 m and 0.5 m/s are 0.286 m and 0.036 m/s on the table. If congestion
control requires a longer gap between two frames, that gap (T_GenCam_DCC) replaces T_min.
Source: EN 302 637-2 v1.4.1, 6.1.3 (same rule in TS 103 900 v2.2.1, 6.1.3).
"""

import math

from scm.clock import NS_PER_MS
from scm.geometry import wrap_angle
from scm.v2x.etsi.cam_spatem import SCALE
from scm.v2x.messages.vehicle_state import VehicleState

T_MIN_NS = 100 * NS_PER_MS
T_MAX_NS = 1000 * NS_PER_MS
N_GEN_CAM = 3
HEADING_RAD = math.radians(4.0)
POSITION_M = 4.0 / SCALE
SPEED_MPS = 0.5 / SCALE


class CamTrigger:
    """The rule for one car; call `due` at least every 100 ms."""

    def __init__(self) -> None:
        self._sent: VehicleState | None = None
        self._sent_ns = 0
        self._interval_ns = T_MAX_NS
        self._quiet = 0

    def due(self, state: VehicleState, now_ns: int, gap_ns: int = 0) -> bool:
        """Return whether a CAM must be sent now; if so, it counts as sent.

        `gap_ns` is the minimum gap of congestion control.
        """
        if self._sent is None:
            return self._send(state, now_ns)
        elapsed_ns = now_ns - self._sent_ns
        if elapsed_ns < max(T_MIN_NS, gap_ns):
            return False
        if _moved(self._sent, state):
            self._interval_ns, self._quiet = min(elapsed_ns, T_MAX_NS), 0
            return self._send(state, now_ns)
        if elapsed_ns < self._interval_ns:
            return False
        self._quiet += 1
        if self._quiet >= N_GEN_CAM:
            self._interval_ns = T_MAX_NS
        return self._send(state, now_ns)

    def _send(self, state: VehicleState, now_ns: int) -> bool:
        self._sent, self._sent_ns = state, now_ns
        return True


def _moved(before: VehicleState, now: VehicleState) -> bool:
    return (
        abs(wrap_angle(now.yaw_rad - before.yaw_rad)) > HEADING_RAD
        or math.hypot(now.x_m - before.x_m, now.y_m - before.y_m) > POSITION_M
        or abs(now.speed_mps - before.speed_mps) > SPEED_MPS
    )
