"""The rules of teleoperation: a remote person drives a car; without socket, bus or clock.

    the person holds a key, a stick or a pad     the car obeys the newest packet
    releases it                                  zero throttle at once, steering as it was
    no packet for 250 ms                         zero throttle, steering held
    no packet for 5 s                            the lease is released

Whatever passes here passes the car's own guard as well, which stops it when this process dies.
"""

import math
from typing import Literal

from scm.clock import NS_PER_MS, NS_PER_S
from scm.records.drive import DrivePacket
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.lease_request import LeaseRequest

SILENT_NS = 250 * NS_PER_MS
GONE_NS = 5 * NS_PER_S
LEASE_MS = 3000  # the guard stops the car long before: this bridges a slow moment of ours
RENEW_NS = 700 * NS_PER_MS

Why = Literal["driving", "released", "silent"]


class Wheel:
    """One person's commands to one car under one lease.

    Args:
        vehicle: The car.
        owner: Whose lease it is.
        epoch: Of the lease.
        now_ns: When it was granted.
    """

    def __init__(self, vehicle: str, owner: str, epoch: int, now_ns: int) -> None:
        self.vehicle = vehicle
        self.owner = owner
        self.epoch = epoch
        self.newest: DrivePacket | None = None
        self._received_ns = now_ns
        self._renew_ns = now_ns + RENEW_NS
        self._seq = 0
        self._steering = 0.0

    def receive(self, packet: DrivePacket, now_ns: int) -> bool:
        """Take a packet; refuse one that is old or holds no numbers; return which."""
        numbers = (packet.throttle, packet.steering, packet.t_ms)
        is_old = self.newest is not None and packet.seq <= self.newest.seq
        if is_old or not all(map(math.isfinite, numbers)):
            return False
        self.newest, self._received_ns = packet, now_ns
        self._steering = max(-1.0, min(1.0, packet.steering))
        return True

    def why(self, now_ns: int) -> Why:
        """Return whether the person drives, and why not."""
        if now_ns - self._received_ns >= SILENT_NS:
            return "silent"
        return "driving" if self.newest is not None and self.newest.held else "released"

    def is_abandoned(self, now_ns: int) -> bool:
        """Return whether there was silence for so long that the lease is released."""
        return now_ns - self._received_ns >= GONE_NS

    def command(self, now_ns: int) -> DriveCommand:
        """Return what the car is to do now."""
        self._seq += 1
        throttle = 0.0
        if self.newest is not None and self.why(now_ns) == "driving":
            throttle = max(-1.0, min(1.0, self.newest.throttle))
        return DriveCommand(
            vehicle=self.vehicle,
            t_ns=now_ns,
            epoch=self.epoch,
            seq=self._seq,
            throttle=throttle,
            steering=self._steering,
        )

    def renewal(self, now_ns: int) -> LeaseRequest | None:
        """Return the request that keeps the lease, three times in its life; None: not yet."""
        if now_ns < self._renew_ns:
            return None
        self._renew_ns = now_ns + RENEW_NS
        return LeaseRequest(
            vehicle=self.vehicle,
            owner=self.owner,
            verb="renew",
            epoch=self.epoch,
            ttl_ms=LEASE_MS,
        )
