"""A car with hidden numbers under an Eye that is late and noisy, calibrated in virtual time."""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from scm.clock import NS_PER_MS, NS_PER_S, seconds
from scm.geometry import Pose2, wrap_angle
from scm.v2x.exchange import Incoming
from scm.vehicles.car import load_car
from scm.vehicles.fleet import Fleet
from tests.unit.test_real_guard import track
from vehicle_agent.calibrate.fit import DELAYS, TERMS, fit
from vehicle_agent.calibrate.part import CalibrationPart
from vehicle_agent.calibrate.pattern import FULL
from vehicle_agent.guard import GuardLimits, rectangle

LIMITS = GuardLimits(rectangle(0.0, 0.0, 2.0, 1.5))
START = Pose2(0.9, 0.75, 0.3)
T0 = 10**12
STEP_NS = 20 * NS_PER_MS
EXACT_NS = NS_PER_MS  # to which a delay is kept
EVERY = 3  # steps from pose to pose
LONGEST_S = 240.0


@dataclass(frozen=True)
class Hidden:
    """What the car file does not say; ``late_ms` and `lasting_s` are of the Eye: its errors."""

    trim: float = 0.03
    gain: float = 0.9
    dead_band: float = 0.15
    drive: float = 1.1
    throttle_delay: float = 0.05
    steering_delay: float = 0.03
    rate: float = 0.42
    late_ms: float = 60.0
    position_std: float = 0.002
    yaw_std: float = 0.005
    lasting_s: float = 0.0
    seed: int = 0

    @property
    def numbers(self):
        late_s = self.late_ms / 1000.0
        return {
            "steering.trim_rad": self.trim,
            "steering.gain": self.gain,
            "drive.deadband": self.dead_band,
            "drive.gain": self.drive,
            "drive.delay_s": self.throttle_delay + late_s,
            "steering.delay_s": self.steering_delay + late_s,
            "steering.rate_rad_s": self.rate,
        }


def drawn(seed, **eye):
    """Hidden numbers of the seed's own, under such an Eye."""
    rng = np.random.default_rng(seed)
    return Hidden(
        trim=rng.uniform(-0.06, 0.06),
        gain=rng.uniform(0.8, 1.2),
        dead_band=rng.uniform(0.05, 0.2),
        drive=rng.uniform(0.9, 1.2),
        throttle_delay=rng.integers(20, 100) / 1000.0,
        steering_delay=rng.integers(20, 100) / 1000.0,
        rate=rng.uniform(0.35, 0.5),
        seed=seed,
        **eye,
    )


class HiddenBody:
    """The kernel's car, with its hidden numbers; it obeys each command exactly so much later."""

    wants_eye = is_closed = False

    def __init__(self, hidden, pose):
        numbers = {k: v for k, v in hidden.numbers.items() if k not in DELAYS}
        self.fleet = Fleet(load_car("nigel").with_terms(TERMS, numbers), 1)
        self.fleet.add(pose)
        self._obeyed = (
            (self.fleet.throttle, hidden.throttle_delay, deque()),
            (self.fleet.steering, hidden.steering_delay, deque()),
        )
        self._now_ns = None

    def advance(self, now_ns):
        while self._now_ns is not None and self._now_ns < now_ns:
            until_ns = now_ns
            for actuator, delay_s, commanded in self._obeyed:
                late_ns = round(delay_s * NS_PER_S)
                while commanded and commanded[0][0] + late_ns <= self._now_ns:
                    actuator[0] = commanded.popleft()[1]
                if commanded:
                    until_ns = min(until_ns, commanded[0][0] + late_ns)
            steps = -(-(until_ns - self._now_ns) // EXACT_NS)
            self.fleet.advance(steps * seconds(EXACT_NS))
            self._now_ns += steps * EXACT_NS
        self._now_ns = now_ns

    def see(self, track, now_ns):
        raise AssertionError("it does not want the Eye")

    def was_lifted(self):
        return False

    def inhibit_reason(self, now_ns):
        return ""

    def obeyed(self):
        return None

    def close(self):
        self.is_closed = True

    def command(self, throttle, steering):
        for (_, _, commanded), value in zip(self._obeyed, (throttle, steering), strict=True):
            commanded.append((self._now_ns, value))

    @property
    def pose(self):
        return self.fleet.pose(0)


class Eye:
    """A pose every 60 ms, each late and noisy and stamped when it is sent."""

    def __init__(self, hidden):
        self._hidden, self._rng = hidden, np.random.default_rng(hidden.seed + 1000)
        self._past = deque()
        self._error = self._rng.normal(size=3)

    def _wrong(self):
        """Return the errors of a pose, (3,): white, or lasting for a while."""
        h = self._hidden
        kept = math.exp(-EVERY * seconds(STEP_NS) / h.lasting_s) if h.lasting_s else 0.0
        fresh = math.sqrt(1.0 - kept * kept) * self._rng.normal(size=3)
        self._error = kept * self._error + fresh
        return self._error * (h.position_std, h.position_std, h.yaw_std)

    def look(self, body, now_ns):
        pose, speed = body.pose, float(body.fleet.speed[0])
        self._past.append((now_ns, pose, speed))
        late_ns = now_ns - round(self._hidden.late_ms * NS_PER_MS)
        while len(self._past) > 1 and self._past[1][0] <= late_ns:
            self._past.popleft()
        if self._past[0][0] > late_ns or (now_ns // STEP_NS) % EVERY:
            return []
        _, pose, speed = self._past[0]
        h = self._hidden
        dx, dy, turn = map(float, self._wrong())
        yaw = wrap_angle(pose.yaw + turn)
        variances = (h.position_std**2, h.position_std**2, h.yaw_std**2)
        commanded = track(now_ns, pose.x + dx, pose.y + dy, yaw, speed, variances)
        return [Incoming(commanded, now_ns)]


def drive(part, body, eye, limits, blind=()):
    """Step until it is done, without poses in `blind` [s]; return seconds and the farthest [m]."""
    now_ns, farthest = T0, -np.inf
    while not part.done.is_set():
        body.advance(now_ns)
        seen = eye.look(body, now_ns)
        part.step(now_ns, [] if round(seconds(now_ns - T0)) in blind else seen)
        farthest = max(farthest, limits.outside_m(body.pose))
        now_ns += STEP_NS
        assert seconds(now_ns - T0) < LONGEST_S, "the pattern does not end"
    return seconds(now_ns - T0), farthest - limits.margin_m


def calibrated(hidden, start=START, limits=LIMITS, plan=FULL):
    """Drive the pattern; return the part and the farthest that the outline was outside [m]."""
    body = HiddenBody(hidden, start)
    part = CalibrationPart("n7", body, limits, plan=plan)
    _, farthest = drive(part, body, Eye(hidden), limits)
    return part, farthest


def fitted(hidden):
    """Drive the pattern and fit it."""
    part, _ = calibrated(hidden)
    return fit(load_car("nigel"), *part.recorded.arrays())
