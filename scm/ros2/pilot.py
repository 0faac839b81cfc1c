"""Drives one car for a ROS node under a lease, while commands arrive.

    a command arrives       the lease is requested, then renewed three times in its duration
    every 50 ms             throttle and steering towards the newest command
    none for 300 ms         zero throttle, steering held
    none for 1 s            the lease is released: the car stops

After losing the lease to somebody else, the pilot requests it again only once the node has been
silent for a second, so a person who takes over keeps the car. Speed is controlled by the table of
steady throttles in the car file, if it has one, and by feedback.
"""

import bisect
import logging

from scm.clock import NS_PER_MS, NS_PER_S, seconds
from scm.log import event
from scm.v2x.exchange import Call, Outgoing
from scm.v2x.message import Message, Refused
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.lease_request import LeaseReply, LeaseRequest
from scm.vehicles.driver import CarLimits

COMMAND_TIMEOUT_NS = 300 * NS_PER_MS
SILENT_NS = NS_PER_S
DRIVE_NS = 50 * NS_PER_MS
LEASE_MS = 1000
RENEW_NS = LEASE_MS * NS_PER_MS // 3
RETRY_NS = NS_PER_S
REQUEST_TIMEOUT_S = 0.5
MAX_STEP_S = 0.1
MAX_INTEGRAL = 0.3

_log = logging.getLogger(__name__)


class Pilot:
    """Holds one car's lease and drives it on behalf of ROS.

    Args:
        vehicle: The car.
        owner: Holder of the lease: the station of the part.
        limits: What the car can do.
    """

    def __init__(self, vehicle: str, owner: str, limits: CarLimits) -> None:
        self.vehicle = vehicle
        self.limits = limits
        self._owner = owner
        self._speed_mps = 0.0
        self._angle_rad = 0.0
        self._command_ns: int | None = None
        self._epoch: int | None = None
        self._seq = 0
        self._requested_ns: int | None = None
        self._drive_ns = 0
        self._lost = False
        self._speed_control = _SpeedControl(limits)

    @property
    def is_driving(self) -> bool:
        """Whether a command arrived within the last second, or the lease is still held."""
        return self._command_ns is not None or self._epoch is not None

    def set_command(self, speed_mps: float, angle_rad: float, now_ns: int) -> None:
        """Take a command: speed, + = forward, and road-wheel angle, + = left."""
        self._speed_mps, self._angle_rad, self._command_ns = speed_mps, angle_rad, now_ns

    def step(self, now_ns: int, speed_mps: float) -> list[Outgoing]:
        """Return the messages due: requests for the lease, its release, and drive commands.

        Args:
            now_ns: Now.
            speed_mps: Of the car, as last reported.
        """
        if self._command_ns is not None and now_ns - self._command_ns >= SILENT_NS:
            self._command_ns = None
            self._lost = False
        if self._command_ns is None:
            return self.release()
        due = self._requested_ns is None or now_ns - self._requested_ns >= self._pause_ns
        if due and not self._lost:
            self._requested_ns = now_ns
            return [self._request("acquire" if self._epoch is None else "renew")]
        if self._epoch is None or now_ns < self._drive_ns:
            return []
        return [self._drive(now_ns, speed_mps, self._command_ns)]

    @property
    def _pause_ns(self) -> int:
        return RETRY_NS if self._epoch is None else RENEW_NS

    def _drive(self, now_ns: int, speed_mps: float, command_ns: int) -> DriveCommand:
        is_fresh = now_ns - command_ns < COMMAND_TIMEOUT_NS
        self._drive_ns = now_ns + DRIVE_NS
        self._seq += 1
        return DriveCommand(
            vehicle=self.vehicle,
            t_ns=now_ns,
            epoch=self._epoch or 0,
            seq=self._seq,
            throttle=self._speed_control.throttle(
                self._speed_mps if is_fresh else 0.0, speed_mps, now_ns
            ),
            steering=max(-1.0, min(1.0, self._angle_rad / self.limits.steer_limit)),
        )

    def release(self) -> list[Outgoing]:
        """Return what gives the lease back, if it is held."""
        out: list[Outgoing] = [] if self._epoch is None else [self._request("release")]
        self._forget_lease()
        return out

    def _forget_lease(self) -> None:
        self._epoch = self._requested_ns = None
        self._speed_control = _SpeedControl(self.limits)

    def replied(self, request: LeaseRequest, reply: Message) -> None:
        """Receive the reply to a request for the lease."""
        if isinstance(reply, LeaseReply) and request.verb == "acquire":
            if reply.owner == self._owner:
                self._epoch, self._seq = reply.epoch, 0
        elif isinstance(reply, Refused) and request.verb != "release":
            event(_log, "ros_lease", level=logging.WARNING, verb=request.verb, why=reply.detail)
            if request.verb == "renew" and reply.code == "owned":
                self._lost = True
                self._forget_lease()

    def _request(self, verb: str) -> Call:
        request = LeaseRequest(
            vehicle=self.vehicle,
            owner=self._owner,
            verb=verb,  # type: ignore[arg-type]
            epoch=self._epoch or 0,
            ttl_ms=LEASE_MS,
        )
        return Call(request, REQUEST_TIMEOUT_S)


class _SpeedControl:
    """Speed controller: feedforward from the car's table, and feedback."""

    def __init__(self, limits: CarLimits) -> None:
        self._limits = limits
        self._gain, self._rate = (4.0, 2.0) if limits.speeds else (1.0, 1.0)
        self._ramp_mps: float | None = None
        self._integral = 0.0
        self._then_ns: int | None = None

    def throttle(self, target_mps: float, speed_mps: float, now_ns: int) -> float:
        """Return the throttle, -1 to 1, that brings the car to a speed."""
        passed_s = 0.0 if self._then_ns is None else seconds(now_ns - self._then_ns)
        passed_s = min(MAX_STEP_S, passed_s)
        self._then_ns = now_ns
        if target_mps == 0.0:
            self._ramp_mps, self._integral = None, 0.0
            return 0.0
        most = self._limits.accel * passed_s
        aim = speed_mps if self._ramp_mps is None else self._ramp_mps
        aim += max(-most, min(most, target_mps - aim))
        self._ramp_mps = aim
        error = aim - speed_mps
        value = self._steady(aim) + self._gain * error + self._integral
        slowest = self._limits.brake_throttle
        low, high = (slowest, 1.0) if target_mps > 0.0 else (-1.0, -slowest)
        bounded = max(low, min(high, value))
        if bounded == value:
            more = self._integral + self._rate * error * passed_s
            self._integral = max(-MAX_INTEGRAL, min(MAX_INTEGRAL, more))
        return bounded

    def _steady(self, speed_mps: float) -> float:
        speeds = (0.0, *self._limits.speeds)
        if len(speeds) == 1:
            return 0.0
        above = min(bisect.bisect(speeds, abs(speed_mps)), len(speeds) - 1)
        low, high = speeds[above - 1], speeds[above]
        share = min(1.0, (abs(speed_mps) - low) / (high - low))
        return (above - 1 + share) / (len(speeds) - 1) * (1.0 if speed_mps >= 0.0 else -1.0)
