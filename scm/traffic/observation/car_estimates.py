"""What is believed of each car: the overhead cameras' track, else what the car says of itself.

    eye    a track that is not stale; its covariance says how sure it is
    self   the car's own report, for cars that no camera has seen for a second; taken to be good
           to 1 cm and 2 cm/s, one standard deviation

World truth is never looked at. A tag that belongs to nobody is a car of its own, unless a car with
a name is believed to be there.
"""

import math
from typing import NamedTuple

from scm.clock import NS_PER_S
from scm.v2x.messages.eye_track import EyeTrack
from scm.v2x.messages.vehicle_state import VehicleState

FRESH_NS = NS_PER_S
SELF_STD_M, SELF_STD_MPS = 0.01, 0.02
NOBODY = "tag-"
FARTHEST_M, FASTEST_MPS, MOST_RAD = 10_000.0, 100.0, 1_000.0
SAME_M = 0.2


class CarEstimate(NamedTuple):
    """A car's rear axle, map frame; speed along the body, + = forward; doubts are 1 sigma."""

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
    """The newest of every car, by who told it."""

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
        """Return what is believed of each car that was told of within the last second."""
        for table in (self._eye, self._self):
            for name in [n for n, (_, at_ns) in table.items() if now_ns - at_ns > FRESH_NS]:
                del table[name]
        newest = {**self._self, **self._eye}
        found = [estimate for estimate, _ in newest.values()]
        named = [estimate for estimate in found if not estimate.vehicle.startswith(NOBODY)]
        return named + [
            estimate
            for estimate in found
            if estimate.vehicle.startswith(NOBODY)
            and all(math.dist((estimate.x, estimate.y), (one.x, one.y)) > SAME_M for one in named)
        ]


def _can_be(estimate: CarEstimate) -> bool:
    return (
        abs(estimate.x) <= FARTHEST_M
        and abs(estimate.y) <= FARTHEST_M
        and estimate.std_m <= FARTHEST_M
        and max(abs(estimate.speed), estimate.std_mps) <= FASTEST_MPS
        and abs(estimate.yaw) <= MOST_RAD
    )


def _of_track(track: EyeTrack) -> CarEstimate:
    covariance = track.covariance
    return CarEstimate(
        track.vehicle,
        track.t_ns,
        track.x_m,
        track.y_m,
        track.yaw_rad,
        track.speed_mps,
        math.sqrt(max(0.0, covariance[0][0], covariance[1][1])),
        math.sqrt(max(0.0, covariance[3][3])),
        "eye",
    )


def _of_state(state: VehicleState) -> CarEstimate:
    return CarEstimate(
        state.vehicle,
        state.t_ns,
        state.x_m,
        state.y_m,
        state.yaw_rad,
        state.speed_mps,
        SELF_STD_M,
        SELF_STD_MPS,
        "self",
    )
