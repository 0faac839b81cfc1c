"""The guard between every command and every body: fencing, dead-man, limits, city stop.

Every command of a car, from its own driver or a remote person, passes the guard last. The guard has
no bus, clock or physics: it gets commands with their times on the receiver's clock, and returns
what the body may do now.

    age of the newest accepted command    mode     what the body does
    below 150 ms                          drive    the command
    150 ms                                hold     steering held, zero throttle
    300 ms                                stop     controlled stop
    1000 ms                               lost     brake, hazard lights, the lease is dropped

A lost car does not drive again on its old epoch, even if commands arrive again.
"""

import math
from dataclasses import dataclass
from typing import Literal

from scm.clock import NS_PER_MS
from scm.v2x.messages.drive_command import DriveCommand

COMMAND_TIMEOUT_NS = 150 * NS_PER_MS
FULL_STOP_NS = 300 * NS_PER_MS
LOST_NS = 1000 * NS_PER_MS
"""Ages of the newest command from which on the modes `hold`, `stop` and `lost` apply."""

Mode = Literal["drive", "hold", "stop", "lost"]


@dataclass(frozen=True, slots=True)
class Guarded:
    """What the body may do now.

    Attributes:
        throttle: -1 to 1, + forward; zero in every mode but `drive`.
        steering: -1 to 1, + = left; the last commanded value without a newer one.
        hazard: Whether the hazard lights must flash.
    """

    throttle: float
    steering: float
    mode: Mode
    hazard: bool

    @property
    def brake(self) -> bool:
        """Whether a body with a brake must use it."""
        return self.mode in ("stop", "lost")


class Guard:
    """Decides one car's throttle and steering.

    A new guard stops until its first command. `epoch` is the lowest accepted one.
    """

    def __init__(self, epoch: int = 0) -> None:
        self._epoch = epoch
        self._seq: int | None = None
        self._throttle = 0.0
        self._steering = 0.0
        self._received_ns: int | None = None
        self._now_ns: int | None = None
        self._lost = False
        self._stopped = False
        self.refused = 0

    @property
    def epoch(self) -> int:
        """The highest epoch seen; older ones are refused for ever."""
        return self._epoch

    @property
    def lost(self) -> bool:
        """Whether the lease was dropped: only a newer epoch drives this car again."""
        return self._lost

    def set_epoch(self, epoch: int, now_ns: int) -> bool:
        """Set the epoch of a newly granted lease; return whether it is newer.

        Older commands are refused from now on. Until the new holder's first command, for which it
        has the same time as between two commands, the car holds its steering without throttle.
        """
        self._advance(now_ns)
        if epoch <= self._epoch:
            return False
        self._epoch, self._seq = epoch, None
        self._received_ns = self._now_ns
        self._lost = False
        return True

    def accept(self, command: DriveCommand, now_ns: int) -> bool:
        """Accept a command that arrived at `now_ns`, or refuse and count it; return which."""
        return self.drive(command.throttle, command.steering, command.epoch, command.seq, now_ns)

    def drive(self, throttle: float, steering: float, epoch: int, seq: int, now_ns: int) -> bool:
        """Accept or refuse (and count) a command that a driver in this process gives; return which.

        Args:
            throttle: -1 to 1, + = forward.
            steering: -1 to 1, + = left.
            epoch: Of the lease under which it is given.
            seq: Its number under that lease; only grows.
            now_ns: The present time [ns].
        """
        self._advance(now_ns)
        is_finite = math.isfinite(throttle) and math.isfinite(steering)
        if not (is_finite and self._is_due(epoch, seq)):
            self.refused += 1
            return False
        self._epoch, self._seq = epoch, seq
        self._throttle, self._steering = _limited(throttle), _limited(steering)
        self._received_ns = self._now_ns
        self._lost = False
        return True

    def command_age_ns(self, now_ns: int) -> int | None:
        """Return the age of the newest command of this epoch, or None."""
        if self._seq is None or self._received_ns is None:
            return None
        return max(0, now_ns - self._received_ns)

    def stop(self, engaged: bool) -> None:
        """Engage or release the city-wide stop, which overrides all commands."""
        self._stopped = engaged

    def output(self, now_ns: int) -> Guarded:
        """Return what the body may do at `now_ns`."""
        age_ns = self._advance(now_ns)
        if self._lost:
            return Guarded(0.0, self._steering, "lost", hazard=True)
        if self._stopped or age_ns is None or age_ns >= FULL_STOP_NS:
            return Guarded(0.0, self._steering, "stop", hazard=False)
        if self._seq is None or age_ns >= COMMAND_TIMEOUT_NS:
            return Guarded(0.0, self._steering, "hold", hazard=False)
        return Guarded(self._throttle, self._steering, "drive", hazard=False)

    def _advance(self, now_ns: int) -> int | None:
        """Advance to `now_ns`, never backwards; return the newest command's age."""
        self._now_ns = now_ns if self._now_ns is None else max(self._now_ns, now_ns)
        if self._received_ns is None:
            return None
        age_ns = self._now_ns - self._received_ns
        if age_ns >= LOST_NS:
            self._lost = True
        return age_ns

    def _is_due(self, epoch: int, seq: int) -> bool:
        """Return whether a command of this lease and number may be obeyed."""
        if epoch != self._epoch:
            return epoch > self._epoch
        return not self._lost and (self._seq is None or seq > self._seq)


def _limited(value: float) -> float:
    return min(1.0, max(-1.0, value))
