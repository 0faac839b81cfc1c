"""The estimate of each car: the overhead cameras' track, else the car's own report.

    eye    a track that is not stale, with its covariance
    self   the car's own report, for cars that no camera has seen for a second, with standard
           deviations of 1 cm and 2 cm/s

World truth is not an input. An unknown tag is a car of its own, unless a named car is there.
"""

import math
from typing import NamedTuple

from scm.clock import NS_PER_S
from scm.v2x.messages.eye_track import EyeTrack
from scm.v2x.messages.vehicle_state import VehicleState

MAX_AGE_NS = NS_PER_S  # of an estimate, on our clock
SELF_STD_M, SELF_STD_MPS = 0.01, 0.02  # assumed of a car's own report
UNKNOWN_TAG = "tag-"  # the Eye's name of a tag that no car has
MAX_POSITION_M, MAX_SPEED_MPS, MAX_YAW_RAD = 10_000.0, 100.0, 1_000.0  # beyond: a broken message
SAME_CAR_M = 0.2  # less than the distance of two cars side by side


class CarEstimate(NamedTuple):
    """A car's rear axle, map frame; speed along the body, + = forward."""

    vehicle: str
    t_ns: int
    x: float
    y: float
    yaw: float
    speed: float
    std_m: float
    std_mps: float
    source: str


class CarEstimates:
    """The newest estimate of every car, by source."""

    def __init__(self) -> None:
        self._eye: dict[str, tuple[CarEstimate, int]] = {}
        self._self: dict[str, tuple[CarEstimate, int]] = {}

    def add(self, message: EyeTrack | VehicleState, arrived_ns: int) -> None:
        """Add a message, unless its position or motion is impossible."""
        if isinstance(message, EyeTrack):
            estimate, table = _of_track(message), self._eye
            if message.stale:
                return
        else:
            estimate, table = _of_state(message), self._self
        if _can_be(estimate):
            table[message.vehicle] = (estimate, arrived_ns)

    def now(self, now_ns: int) -> list[CarEstimate]:
        """Return the estimate of each car that is not older than a second."""
        for table in (self._eye, self._self):
            for name in [n for n, (_, at_ns) in table.items() if now_ns - at_ns > MAX_AGE_NS]:
                del table[name]
        newest = {**self._self, **self._eye}
        found = [estimate for estimate, _ in newest.values()]
        named = [estimate for estimate in found if not estimate.vehicle.startswith(UNKNOWN_TAG)]
        return named + [
            estimate
            for estimate in found
            if estimate.vehicle.startswith(UNKNOWN_TAG)
            and all(
                math.dist((estimate.x, estimate.y), (one.x, one.y)) > SAME_CAR_M for one in named
            )
        ]


def _can_be(estimate: CarEstimate) -> bool:
    return (
        abs(estimate.x) <= MAX_POSITION_M
        and abs(estimate.y) <= MAX_POSITION_M
        and estimate.std_m <= MAX_POSITION_M
        and max(abs(estimate.speed), estimate.std_mps) <= MAX_SPEED_MPS
        and abs(estimate.yaw) <= MAX_YAW_RAD
    )


def _of_track(track: EyeTrack) -> CarEstimate:
    covariance = track.covariance
    std_m = math.sqrt(max(0.0, covariance[0][0], covariance[1][1]))
    std_mps = math.sqrt(max(0.0, covariance[3][3]))
    motion = track.x_m, track.y_m, track.yaw_rad, track.speed_mps
    return CarEstimate(track.vehicle, track.t_ns, *motion, std_m, std_mps, "eye")


def _of_state(state: VehicleState) -> CarEstimate:
    motion = state.x_m, state.y_m, state.yaw_rad, state.speed_mps
    return CarEstimate(state.vehicle, state.t_ns, *motion, SELF_STD_M, SELF_STD_MPS, "self")
