"""The calibration drive as a part: poses in, guarded commands to the body, everything recorded.

receive -> advance the body to now -> pattern -> guard -> guard of the real car -> body -> record

The car does not join the city: put it on a floor where nothing else drives. The pattern waits while
a guard stops the car for lack of a pose or because of the city-wide stop, while the body must not
move, and while its outline is beyond the floor. A car that was carried away continues where it was
put down, with another leg.
"""

import threading
from collections.abc import Callable, Sequence
from dataclasses import replace

from scm.clock import NS_PER_MS, NS_PER_S, seconds
from scm.geometry import Pose2
from scm.runtime.part import BasePart, Subscription
from scm.v2x.exchange import Incoming, Outgoing
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.messages.eye_track import EyeTrack
from scm.v2x.messages.part_status import PartStatus
from scm.vehicles.guard import Guard
from vehicle_agent.body import Body, Obeyed
from vehicle_agent.calibrate.pattern import FULL, Pattern, Plan
from vehicle_agent.calibrate.recorded import Recorded
from vehicle_agent.guard import GuardLimits, Passed, RealGuard

WAIT_REASONS = frozenset({"pose", "doubt", "stop", "lost"})
OUTSIDE = "outside the floor"


class CalibrationPart(BasePart):
    """One car that drives the pattern.

    Attributes:
        recorded: Commands and poses.
        done: Set when the pattern is complete.
        doing: Present activity, in words: `37 % driven`, or `waits (pose)` and the like.
        guard: Of the real car: why it was limited, and how often.
        inhibit_reason: Why the body must not move, in words; empty: it may.
    """

    role = "v"
    period_ns = 20 * NS_PER_MS

    def __init__(
        self, name: str, body: Body, limits: GuardLimits, done: threading.Event | None = None,
        plan: Plan = FULL, on_progress: Callable[[str], None] | None = None,
    ) -> None:  # fmt: skip
        """Prepare the drive.

        Args:
            name: Of the vehicle, as the Eye calls it.
            body: The body to drive.
            limits: Of the guard; its fence is the floor.
            done: To be set when the pattern is complete.
            plan: Extent of the drive.
            on_progress: Called with `doing` once a second.
        """
        self.name = name
        mine = {"vehicle": name}
        self.subscriptions: Sequence[Subscription] = (
            Subscription(EyeTrack, mine), Subscription(EyePose, mine), Subscription(CityStop)
        )  # fmt: skip
        self.recorded = Recorded()
        self.done = done or threading.Event()
        self.guard = RealGuard(limits)
        self.inhibit_reason = self.doing = ""
        self._body, self._limits = body, limits
        self._commander = Guard(1)
        self._pattern = Pattern(limits, plan)
        self._track: EyeTrack | None = None
        self._seq = 0
        self._waits = True
        self._paused_ns = 0
        self._now_ns: int | None = None
        self._status_ns: int | None = None
        self._on_progress = on_progress

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Receive, drive, record."""
        for item in inbox:
            if isinstance(item.message, EyeTrack):
                self._see(item.message, item.t_ns)
            elif isinstance(item.message, EyePose) and not item.message.flags:
                self.recorded.seen(item.message)
            elif isinstance(item.message, CityStop):
                self._commander.stop(item.message.engaged)
        self._body.advance(now_ns)
        self.inhibit_reason = self._body.inhibit_reason(now_ns)
        if self._body.was_lifted():
            self._pattern.give_up(seconds(now_ns - self._paused_ns))
        passed = self._command(now_ns)
        self._body.command(passed.throttle, passed.steering)
        self._record(now_ns, passed)
        return self._status(now_ns)

    def finish(self, now_ns: int) -> list[Outgoing]:
        """Stop the car."""
        self._body.command(0.0, 0.0)
        return []

    def close(self) -> None:
        """Release the body, however the drive ends."""
        self._body.close()

    def _record(self, now_ns: int, passed: Passed) -> None:
        """Record the commands sent to the actuators; the newest may still be in transit."""
        obeyed = self._body.obeyed()
        if self._track is None:
            return
        if obeyed is None:
            obeyed = [Obeyed(now_ns, passed.throttle, passed.steering)]
        for one in obeyed:
            self.recorded.commanded(one.t_ns, one.throttle, one.steering)

    def _see(self, track: EyeTrack, now_ns: int) -> None:
        self.guard.see(track, now_ns)
        if self._body.wants_eye:
            self._body.see(track, now_ns)
        self._track = track
        if not track.stale:
            self.recorded.seen(track)

    def _command(self, now_ns: int) -> Passed:
        throttle, steering = self._pattern_command(now_ns)
        self._seq += 1
        self._commander.drive(throttle, steering, 1, self._seq, now_ns)
        passed = self.guard.pass_on(self._commander.output(now_ns), now_ns)
        why = self._why(passed)
        self._waits = bool(why)
        self.doing = f"waits ({why})" if why else f"{100.0 * self._pattern.progress:.0f} % driven"
        return replace(passed, throttle=0.0, steering=0.0) if self.inhibit_reason else passed

    def _why(self, passed: Passed) -> str:
        """Return why it waits, in words; empty if it does not."""
        if self.inhibit_reason:
            return self.inhibit_reason
        if not WAIT_REASONS.isdisjoint(passed.reasons):
            return ", ".join(passed.reasons)
        return OUTSIDE if self._is_outside() else ""

    def _is_outside(self) -> bool:
        """Return whether the outline is beyond the floor, where the car cannot have driven."""
        if self._track is None:
            return False
        pose = Pose2(self._track.x_m, self._track.y_m, self._track.yaw_rad)
        return self._limits.outside_m(pose) > self._limits.margin_m

    def _pattern_command(self, now_ns: int) -> tuple[float, float]:
        since_ns = 0 if self._now_ns is None else now_ns - self._now_ns
        self._now_ns = now_ns
        if self._waits or self.inhibit_reason or self._track is None:
            self._paused_ns += since_ns
            return 0.0, 0.0
        pose = Pose2(self._track.x_m, self._track.y_m, self._track.yaw_rad)
        command = self._pattern.step(pose, seconds(now_ns - self._paused_ns))
        if command is None:
            self.done.set()
        return command or (0.0, 0.0)

    def _status(self, now_ns: int) -> list[Outgoing]:
        if self._status_ns is not None and now_ns - self._status_ns < NS_PER_S:
            return []
        self._status_ns = now_ns
        if self._on_progress is not None:
            self._on_progress(self.doing)
        detail = f"calibrates: {self.doing}; held up: {self.guard.summary or 'never'}"
        return [PartStatus(station=self.name, t_ns=now_ns, detail=detail)]
