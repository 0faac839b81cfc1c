"""The low-frequency container of a car's CAMs: role, lights and path, every 500 ms at most.

The path consists of places of earlier such CAMs, at least 4 m of the enlarged city apart and at
most 200 m back. Source: EN 302 637-2 v1.4.1, 6.1.3 and annex B.
"""

import math
from array import array
from typing import NamedTuple

from scm.clock import NS_PER_MS
from scm.v2x.etsi.cam_spatem import (
    SCALE,
    ExteriorLights,
    LowFrequencyContainer,
    VehicleLowFrequency,
)
from scm.v2x.etsi.convert import latitude_of, longitude_of
from scm.v2x.etsi.parts import NO_DELTA, DeltaPosition, PathPoint
from scm.v2x.messages.vehicle_state import VehicleState

EVERY_NS = 500 * NS_PER_MS
MAX_POINTS = 23
APART_M, FARTHEST_M = 4.0 / SCALE, 200.0 / SCALE
_TIME_STEP_NS = 10 * NS_PER_MS
_MAX_TIME = 65_535

ROLE_NUMBERS = {"default": 0, "publicTransport": 1, "emergency": 6, "safetyCar": 7, "taxi": 12}
"""Supported VehicleRoles by name."""


class _At(NamedTuple):
    x_m: float
    y_m: float
    t_ns: float


class LowFrequencySender:
    """The low-frequency container of one car; a city has thousands of these, so it is small."""

    __slots__ = ("_path", "_role", "_sent_ns")

    def __init__(self, role: str = "default") -> None:
        """Start with the car's role, one of `ROLE_NUMBERS`."""
        self._role = ROLE_NUMBERS[role]
        self._path = array("d")  # x, y, t of each place, the newest last
        self._sent_ns: int | None = None

    @property
    def memory(self) -> tuple[int | None, bytes]:
        """When it was sent last, and the path; write what another sender read to go on with it."""
        return self._sent_ns, self._path.tobytes()

    @memory.setter
    def memory(self, value: tuple[int | None, bytes]) -> None:
        self._sent_ns, path = value
        self._path = array("d", path)

    def due(self, state: VehicleState, front_m: float) -> LowFrequencyContainer | None:
        """Return the container for a CAM that is sent now, or None if it is not due.

        Args:
            state: The car's, at the CAM's time.
            front_m: From its rear axle to its front bumper.
        """
        if not self._is_due(state.t_ns):
            return None
        x_m = state.x_m + front_m * math.cos(state.yaw_rad)
        y_m = state.y_m + front_m * math.sin(state.yaw_rad)
        here = _At(x_m, y_m, state.t_ns)
        content = VehicleLowFrequency(
            vehicle_role=self._role,
            exterior_lights=lights_of(state),
            path_history=self._history(here),
        )
        self._pass(here)
        return LowFrequencyContainer(basic_vehicle_container_low_frequency=content)

    def note_sent(self, t_ns: int, x_m: float, y_m: float) -> None:
        """Note a CAM that was sent and that nobody received, with its front bumper there."""
        if self._is_due(t_ns):
            self._pass(_At(x_m, y_m, t_ns))

    def _is_due(self, t_ns: int) -> bool:
        if self._sent_ns is not None and t_ns - self._sent_ns < EVERY_NS:
            return False
        self._sent_ns = t_ns
        return True

    def _pass(self, here: _At) -> None:
        if not self._path or math.dist(self._path[-3:-1], here[:2]) >= APART_M:
            self._path.extend(here)
            del self._path[: -3 * MAX_POINTS]

    def _history(self, here: _At) -> tuple[PathPoint, ...]:
        points, length_m = [], 0.0
        for end in range(len(self._path), 0, -3):
            before = _At(*self._path[end - 3 : end])
            length_m += math.dist(before[:2], here[:2])
            if length_m > FARTHEST_M:
                break
            points.append(_point(before, here))
            here = before
        return tuple(points)


def _point(before: _At, here: _At) -> PathPoint:
    steps = int(here.t_ns - before.t_ns) // _TIME_STEP_NS
    return PathPoint(
        path_position=DeltaPosition(
            delta_latitude=_delta(latitude_of(before.y_m) - latitude_of(here.y_m)),
            delta_longitude=_delta(longitude_of(before.x_m) - longitude_of(here.x_m)),
        ),
        path_delta_time=max(1, min(_MAX_TIME, steps)),
    )


def _delta(value: int) -> int:
    return value if abs(value) < NO_DELTA else NO_DELTA


def lights_of(state: VehicleState) -> ExteriorLights:
    """Return which of a car's lights are on; both indicators are the hazard lights."""
    on = state.lights
    return ExteriorLights(
        low_beam_headlights_on="head_low" in on,
        high_beam_headlights_on="head_high" in on,
        left_turn_signal_on="left" in on,
        right_turn_signal_on="right" in on,
        reverse_light_on="reverse" in on,
        parking_lights_on="tail" in on and "head_low" not in on,
    )
