"""A car that the script places itself: a remote one in the city, without dynamics of its own.

The bridge joins for it and reports, 50 times a second, the last pose from the script; speeds are
derived from the poses. Other cars see it and collide with it; they do not push it.
"""

import logging
import math

from scm.clock import NS_PER_MS, NS_PER_S, seconds
from scm.log import event
from scm.v2x.exchange import Call, Outgoing
from scm.v2x.message import Message, Refused
from scm.v2x.messages.join_request import JoinReply, JoinRequest
from scm.v2x.messages.remove_request import RemoveRequest
from scm.v2x.messages.vehicle_state import VehicleState

REPORT_EVERY_NS = 20 * NS_PER_MS
JOIN_RETRY_NS = NS_PER_S
STANDSTILL_NS = NS_PER_S // 2  # without a new pose a car stands
REQUEST_TIMEOUT_S = 1.0

Placed = tuple[float, float, float]

_log = logging.getLogger(__name__)


class CosimCar:
    """One car that a script places.

    Args:
        vehicle: Its name.
        car: Its car file.
        session: Of the bridge's bus.
    """

    def __init__(self, vehicle: str, car: str, session: str) -> None:
        self._vehicle, self._car, self._session = vehicle, car, session
        self._epoch: int | None = None
        self._requested_ns: int | None = None
        self._attempt = 0
        self._pose: Placed = (0.0, 0.0, 0.0)
        self._placed_ns: int | None = None
        self._speeds: Placed = (0.0, 0.0, 0.0)
        self._report_ns = self._seq = 0
        self._last_refusal = ""

    @property
    def detail(self) -> str:
        """State of the car, in words."""
        return f"{self._vehicle} is {'placed' if self._epoch is not None else 'about to join'}"

    def place(self, pose: Placed, replied_ns: int) -> None:
        """Set the script's pose: x, y [m] and yaw [rad] of the rear axle, map frame."""
        if replied_ns == self._placed_ns:
            return
        if self._placed_ns is not None and 0 < replied_ns - self._placed_ns < STANDSTILL_NS:
            self._speeds = _speeds(self._pose, pose, seconds(replied_ns - self._placed_ns))
        else:
            self._speeds = (0.0, 0.0, 0.0)
        self._pose, self._placed_ns = pose, replied_ns

    def step(self, now_ns: int) -> list[Outgoing]:
        """Join, and report."""
        if self._epoch is None:
            if self._requested_ns is not None and now_ns - self._requested_ns < JOIN_RETRY_NS:
                return []
            self._requested_ns, self._attempt = now_ns, self._attempt + 1
            return [Call(self._join(now_ns), REQUEST_TIMEOUT_S)]
        if now_ns < self._report_ns:
            return []
        self._report_ns = now_ns + REPORT_EVERY_NS
        return [self._state(now_ns, self._epoch)]

    def _join(self, now_ns: int) -> JoinRequest:
        return JoinRequest(
            request_id=f"{self._vehicle}-{now_ns}-{self._attempt}",
            vehicle=self._vehicle,
            session=self._session,
            car=self._car,
        )

    def replied(self, reply: Message) -> None:
        """Process the reply to a join request."""
        if isinstance(reply, JoinReply):
            self._epoch = reply.epoch
            if self._placed_ns is None:
                self._pose = (reply.x_m, reply.y_m, reply.yaw_rad)
        elif isinstance(reply, Refused) and reply.detail != self._last_refusal:
            self._last_refusal = reply.detail
            event(_log, "devkit_cosim", level=logging.WARNING, why=repr(reply.detail))

    def leave(self) -> list[Outgoing]:
        """Return the request that removes it."""
        joined, self._epoch = self._epoch is not None, None
        return [Call(RemoveRequest(vehicle=self._vehicle), REQUEST_TIMEOUT_S)] if joined else []

    def _state(self, now_ns: int, epoch: int) -> VehicleState:
        is_still = self._placed_ns is None or now_ns - self._placed_ns > STANDSTILL_NS
        speed, lateral, turn = (0.0, 0.0, 0.0) if is_still else self._speeds
        self._seq += 1
        x, y, yaw = self._pose
        return VehicleState(
            vehicle=self._vehicle,
            t_ns=now_ns,
            seq=self._seq,
            x_m=x,
            y_m=y,
            yaw_rad=yaw,
            speed_mps=speed,
            lateral_speed_mps=lateral,
            yaw_rate_radps=turn,
            steering_rad=0.0,
            throttle=0.0,
            source="script",
            epoch=epoch,
            car=self._car,
        )


def _speeds(before: Placed, after: Placed, passed_s: float) -> Placed:
    """Return speed, lateral speed [m/s] and yaw rate [rad/s] in the car's frame."""
    vx, vy = ((b - a) / passed_s for a, b in zip(before[:2], after[:2], strict=True))
    turn = math.remainder(after[2] - before[2], math.tau)
    c, s = math.cos(after[2]), math.sin(after[2])
    return c * vx + s * vy, c * vy - s * vx, turn / passed_s
