"""A car with hidden numbers under an Eye that is late and noisy, calibrated in virtual time."""

from collections import deque
from dataclasses import dataclass

import numpy as np

from scm.clock import NS_PER_MS, seconds
from scm.geometry import Pose2, wrap_angle
from scm.v2x.exchange import Incoming
from scm.vehicles.car import load_car
from scm.vehicles.fleet import Fleet
from tests.unit.test_real_guard import track
from vehicle_agent.calibrate.car_file import DELAYING
from vehicle_agent.calibrate.fit import TERMS, fit
from vehicle_agent.calibrate.part import CalibrationPart
from vehicle_agent.guard import GuardLimits, rectangle

FLOOR = rectangle(0.0, 0.0, 2.0, 1.5)
STEP_NS = 20 * NS_PER_MS
EXACT_NS = 2 * NS_PER_MS  # a delay is exact only to the length of one call
LONGEST_S = 240.0


@dataclass(frozen=True)
class Hidden:
    """What the car file does not say; `delay_s` of both actuators, `late_ms` of the Eye."""

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


def drawn(seed):
    """Hidden numbers of the seed's own."""
    rng = np.random.default_rng(seed)
    return Hidden(
        trim=rng.uniform(-0.06, 0.06),
        gain=rng.uniform(0.8, 1.2),
        dead_band=rng.uniform(0.05, 0.2),
        drive=rng.uniform(0.9, 1.2),
        throttle_delay=rng.uniform(0.02, 0.1),
        steering_delay=rng.uniform(0.02, 0.1),
        rate=rng.uniform(0.35, 0.5),
        seed=seed,
    )


class HiddenBody:
    """The kernel's car, with its hidden numbers; the truth is for the rig alone."""

    def __init__(self, hidden, pose):
        late_s = hidden.late_ms / 1000.0
        numbers = dict(hidden.numbers)
        numbers["drive.delay_s"] -= late_s
        numbers["steering.delay_s"] -= late_s
        self.fleet = Fleet(load_car("nigel").with_terms((*TERMS, *DELAYING), numbers), 1)
        self.fleet.add(pose)
        self._now_ns = None

    def advance(self, now_ns):
        while self._now_ns is not None and self._now_ns < now_ns:
            self.fleet.advance(seconds(EXACT_NS))
            self._now_ns += EXACT_NS
        self._now_ns = now_ns

    def command(self, throttle, steering):
        self.fleet.throttle[0], self.fleet.steering[0] = throttle, steering

    @property
    def pose(self):
        return self.fleet.pose(0)


class Eye:
    """20 poses a second, each late and noisy and stamped when it is sent."""

    def __init__(self, hidden):
        self._hidden, self._rng = hidden, np.random.default_rng(hidden.seed + 1000)
        self._past = deque()

    def look(self, body, now_ns):
        pose, speed = body.pose, float(body.fleet.speed[0])
        self._past.append((now_ns, pose, speed))
        late_ns = now_ns - round(self._hidden.late_ms * NS_PER_MS)
        while len(self._past) > 1 and self._past[1][0] <= late_ns:
            self._past.popleft()
        if self._past[0][0] > late_ns or (now_ns // STEP_NS) % 3:
            return []
        _, pose, speed = self._past[0]
        h = self._hidden
        dx, dy = self._rng.normal(0.0, h.position_std, 2)
        yaw = wrap_angle(pose.yaw + self._rng.normal(0.0, h.yaw_std))
        variances = (h.position_std**2, h.position_std**2, h.yaw_std**2)
        told = track(now_ns, pose.x + dx, pose.y + dy, yaw, speed, variances)
        return [Incoming(told, now_ns)]


def calibrated(hidden, start=None, limits=None):
    """Drive the pattern; return the part and the farthest that the outline was outside [m]."""
    start = start or Pose2(0.9, 0.75, 0.3)
    limits = limits or GuardLimits(FLOOR)
    body, eye = HiddenBody(hidden, start), Eye(hidden)
    part = CalibrationPart("n7", body, limits)
    now_ns, farthest = 10**12, -np.inf
    while not part.done.is_set():
        body.advance(now_ns)
        part.step(now_ns, eye.look(body, now_ns))
        farthest = max(farthest, limits.outside_m(body.pose))
        now_ns += STEP_NS
        assert seconds(now_ns - 10**12) < LONGEST_S, "the pattern does not end"
    return part, farthest - limits.margin_m


def fitted(hidden, **more):
    part, _ = calibrated(hidden, **more)
    return fit(load_car("nigel"), *part.recorded.arrays())
