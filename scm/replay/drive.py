"""A recorded drive ready for simulation: commands, measured streams, and the measured motion.

Streams keep the times and values of the recording; nothing is resampled.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from scm.arrays import Bools, Floats
from scm.data_quality.quality import Span
from scm.errors import RecordingError
from scm.recording.motion import forward, pose_point
from scm.recording.read import Recording
from scm.replay.commands import Commanded, Commands
from scm.replay.correlated_noise import (
    MAD,
    WHITE_NOISE,
    Correlated,
    correlated_noise,
    roughness,
)
from scm.replay.smooth import Smooth, smooth
from scm.vehicles.car import Car
from scm.vehicles.drive_channel import COMMANDED_SPEEDS

STEP_S = 0.01
FASTEST_HZ = {"imu.accel_x": 25.0, "imu.accel_y": 25.0, "imu.gyro_z": 50.0, "yaw_rate": 50.0,
              "encoder.left": 25.0, "encoder.right": 25.0}  # fmt: skip
FASTEST_POSE_HZ = 50.0
RUN_IN_S = 1.0
MOVING_MPS = 0.2  # a car that begins faster was commanded before its recording began;
CREEPING_MPS, MOVING_SEEN_S = 0.05, 0.2  # or this fast, where poses show it before its commands
WHEELS = {"encoder.left": "rl", "encoder.right": "rr"}
KNOWN = (
    "pose.x", "pose.y", "pose.yaw", "imu.gyro_z", "yaw_rate", "encoder.left", "encoder.right",
    "wheel_speed.fl", "wheel_speed.fr", "wheel_speed.rl", "wheel_speed.rr", "speed", "velocity.x",
    "velocity.y", "imu.accel_x", "imu.accel_y",
)  # fmt: skip
LEAP = 0.3
LEAST_SAMPLES = 4  # of a channel: its noise is seen in third differences
BLIND_S, BLIND_STEPS = 1.0, 5.0  # without a pose for longer, and for so many of its usual steps
POSES = ("pose.x", "pose.y", "pose.yaw")
ODOMETERS = ("speed", "velocity.x")  # best first
WITHOUT_DISTANCE = ("pose.", "imu.gyro", "yaw_rate")  # beginnings of channels' names
SLIP = 0.03  # of the speed: wheels that count it slip, and their tyres grow
LARGEST_SCALE = 1.6  # of an odometer against the poses: beyond, it is another unit or another car
FEWEST_ROWS, SMOOTHED_ROWS = 20, 4.0  # to tell its scale by, and those that share their noise


@dataclass(frozen=True, slots=True)
class Stream:
    """One measured channel; yaw is continuous.

    Attributes:
        t: (n,), rising [s].
        values: (n,), SI; encoders in counts.
        std: Of the noise of one value, stated or estimated.
        correlated: How much of the noise lasts from value to value.
        taps: When the samples were taken whose mean a value is, (n, samples) [s].
        unsure: Further standard deviation of each value, where the channel leaps, (n,).
    """

    name: str
    t: Floats
    values: Floats
    std: float
    taps: Floats
    unsure: Floats
    correlated: Correlated = WHITE_NOISE

    @property
    def slow_std(self) -> float:
        """Of white noise that leaves a slow motion as unsure."""
        return self.std * self.correlated.inflation(float(np.median(np.diff(self.t))))

    def drawn(self, t: Floats, rng: np.random.Generator) -> Floats:
        """Return noise such as this channel has, at given times, (n,)."""
        return self.std * self.correlated.drawn(t, rng)

    def within(self, first: float, last: float) -> "Stream":
        """Return the values taken between two times."""
        keep = (self.taps[:, 0] >= first) & (self.taps[:, -1] <= last)
        return replace(self, t=self.t[keep], values=self.values[keep], taps=self.taps[keep],
                       unsure=self.unsure[keep])  # fmt: skip


@dataclass(frozen=True, slots=True)
class Odometer:
    """Forward speed as the car itself measures it, in the metre of its poses.

    Attributes:
        smoothed: As recorded, without its noise.
        scale: What one of its metres is in those of the poses.
        unsure: Standard deviation of the scale, slip included, as a share of the speed.
        usual: Speed that its errors go by where the car is slower: it feels no slow wheels [m/s].
    """

    smoothed: Smooth
    scale: float
    unsure: float
    usual: float

    def at(self, t: Floats) -> tuple[Floats, Floats]:
        """Return the speed at given times, and its std: infinite where it was not measured."""
        own = self.smoothed
        speed = self.scale * own.at(t)
        std = np.hypot(
            self.scale * np.interp(t, own.t, own.std),
            self.unsure * np.maximum(np.abs(speed), self.usual),
        )
        after = np.clip(np.searchsorted(own.t, t), 1, len(own.t) - 1)
        steps = np.diff(own.t)
        measured = (t >= own.t[0]) & (t <= own.t[-1])
        measured &= steps[after - 1] <= BLIND_STEPS * np.median(steps)
        return speed, np.where(measured, std, np.inf)


class Drive:
    """One car's recording on the simulation's grid of `STEP_S`.

    Attributes:
        edges: Where steps begin and end, (steps + 1,) [s].
        streams: Measured channels that a car model can predict.
        battery: Measured voltage on the edges, where the car's drive knows it [V].
        point: On the body that the poses are of, from the rear axle [m].

    Raises:
        RecordingError: when there are too few poses.
    """

    def __init__(self, recording: Recording, car: Car) -> None:
        self.recording, self.car = recording, car
        commands = Commands(recording, car)
        throttle, steering = commands.rows
        names = [name for name in KNOWN if _is_enough(recording, name) and _can_predict(car, name)]
        streams = _with_correlation([_stream(recording, name) for name in names], recording)
        self.point = pose_point(recording)
        poses = [recording.channel(name).t for name in POSES]
        begin = max(float(t[0]) for t in poses)
        first = _on_grid(max(begin, commands.span_s[0]), float(throttle[0][0]))
        last = min(*(float(t[-1]) for t in poses), commands.span_s[1] + 0.05)
        steps = int((last - first) / STEP_S)
        self.edges: Floats = np.asarray(first + STEP_S * np.arange(steps + 1), dtype=np.float64)
        self.battery = commands.voltage(self.edges)
        self.streams: Sequence[Stream] = [stream.within(first, last) for stream in streams]
        around = first - RUN_IN_S, last + RUN_IN_S  # a smoothed rate is poor at its very ends
        self._poses = {s.name: s.within(*around) for s in streams if s.name in POSES}
        x, y = (self.smoothed[f"pose.{axis}"] for axis in ("x", "y"))
        at_start = float(np.hypot(x.rate_at(self.edges[:1]), y.rate_at(self.edges[:1]))[0])
        moving = at_start > (MOVING_MPS if x.t[0] > first - MOVING_SEEN_S else CREEPING_MPS)
        self.throttle = _commanded(*throttle, moving=moving)
        self.steering = _commanded(*steering, moving=moving)

    def stream(self, name: str) -> Stream:
        """Return a stream by its channel's name."""
        return next(s for s in self.streams if s.name == name)

    @property
    def names(self) -> tuple[str, ...]:
        """The streams' names."""
        return tuple(s.name for s in self.streams)

    @cached_property
    def smoothed(self) -> dict[str, Smooth]:
        """The poses, smoothed without a car model, of the point that was measured."""
        return {name: smooth(s.t, s.values, s.slow_std) for name, s in self._poses.items()}

    @cached_property
    def pose_speed(self) -> Floats:
        """How fast the measured point moves, at the stamps of `pose.x`, without sign [m/s]."""
        x, y = (self.smoothed[name] for name in POSES[:2])
        return np.hypot(x.rate, y.rate_at(x.t))

    @cached_property
    def odometer(self) -> Odometer | None:
        """The forward speed that the car measures itself; None where it follows no pose."""
        name = next((name for name in ODOMETERS if name in self.names), None)
        if name is None or len(self.stream(name).t) < FEWEST_ROWS:
            return None
        stream = self.stream(name)
        smoothed = smooth(stream.t, stream.values, stream.std)
        x, y, yaw = (self.smoothed[name] for name in POSES)
        psi = yaw.at(smoothed.t)
        along = np.cos(psi) * x.rate_at(smoothed.t) + np.sin(psi) * y.rate_at(smoothed.t)
        usual = float(np.percentile(np.abs(smoothed.value), 90))
        going = np.abs(smoothed.value) > 0.3 * usual
        if going.sum() < FEWEST_ROWS:
            return None
        ratio = along[going] / smoothed.value[going]
        scale = float(np.median(ratio))
        if not 1.0 / LARGEST_SCALE < scale < LARGEST_SCALE:
            return None
        spread = MAD * float(np.median(np.abs(ratio - scale)))
        rows = min(going.sum(), going.mean() * len(x.t)) / SMOOTHED_ROWS
        unsure = math.hypot(SLIP, spread / math.sqrt(max(rows, 1.0)))
        return Odometer(smoothed, scale, unsure, scale * usual)

    @cached_property
    def turned(self) -> Floats:
        """How far the left and the right wheels have turned, on the edges, (steps + 1, 2) [rad].

        As their encoders count, from where these begin; by the way of the smoothed poses without.
        """
        if all(name in self.names for name in WHEELS):
            counts = self.car.value("encoder.counts_per_revolution") / (2.0 * math.pi)
            both = (self.stream(name) for name in WHEELS)
            return np.stack([np.interp(self.edges, s.t, s.values) / counts for s in both], axis=1)
        x, y, yaw = (self.smoothed[name] for name in POSES)
        psi = yaw.at(self.edges)
        along, across = (np.gradient(one.at(self.edges), STEP_S) for one in (x, y))
        speed = np.cos(psi) * along + np.sin(psi) * across
        aside = 0.5 * self.car.value("body.track_m") * np.gradient(psi, STEP_S)
        rates = np.stack((speed - aside, speed + aside), axis=1)
        way: Floats = np.cumsum(rates * STEP_S, axis=0) / self.car.value("wheel.radius_m")
        return way

    @cached_property
    def blind(self) -> tuple[Span, ...]:
        """Spans in which a channel of the pose is missing; a smoothed pose is a guess there."""
        found = list[Span]()
        for t in (self.stream(name).t for name in POSES):
            steps = np.diff(t)
            longest = max(BLIND_S, BLIND_STEPS * float(np.median(steps)))
            found += [(float(t[i]), float(t[i + 1])) for i in np.flatnonzero(steps > longest)]
        return tuple(sorted(set(found)))

    def is_blind(self, t: Floats, length_s: float = 0.0) -> Bools:
        """Return whether a span of this length that begins at each time is partly blind."""
        blind = np.zeros(t.shape, dtype=np.bool_)
        for first, last in self.blind:
            blind |= (t + length_s > first) & (t < last)
        return blind


def _on_grid(first: float, row: float) -> float:
    """Return the first moment of a grid of steps that holds a command row.

    Commands that come at an even rate then change between steps. A change within one would enter
    as a mean, which sends a servo off at its rate as soon as the step begins.
    """
    return row + math.ceil(round((first - row) / STEP_S, 6)) * STEP_S


def _commanded(t: Floats, values: Floats, *, moving: bool) -> Commanded:
    """Return a command; what drives a car before its first row is that row's."""
    if not moving:
        return Commanded(t, values)
    before = t[0] - 2.0 * RUN_IN_S
    return Commanded(np.concatenate(([before], t)), np.concatenate((values[:1], values)))


def has_odometer(drive: Drive) -> bool:
    """Say whether a drive has a measured speed that is not what drives the car."""
    return "speed" in drive.names and not is_led(drive)


def has_distance(drive: Drive) -> bool:
    """Say whether anything but the poses measures how far a drive went, or commands how fast."""
    beside = any(not name.startswith(WITHOUT_DISTANCE) for name in drive.names)
    return beside or any(name in drive.recording.channels for name in COMMANDED_SPEEDS)


def is_led(drive: Drive) -> bool:
    """Say whether the measured speed drives the car, so that only how it turns can be judged."""
    given = any(term.name == "speed_control" for term in drive.car.terms)
    return given and not any(name in drive.recording.channels for name in COMMANDED_SPEEDS)


def _is_enough(recording: Recording, name: str) -> bool:
    """Say whether a channel has as many samples as show its noise.

    Raises:
        RecordingError: when a pose has fewer, without which nothing can be driven again.
    """
    count = len(recording.channels[name].t) if name in recording.channels else 0
    if name in POSES and count < LEAST_SAMPLES:
        raise RecordingError(f"{name}: expected {LEAST_SAMPLES} samples at least, got {count}")
    return count >= LEAST_SAMPLES


def _can_predict(car: Car, name: str) -> bool:
    """Say whether the car file tells what a sensor counts."""
    return not name.startswith("encoder.") or car.has("encoder.counts_per_revolution")


def _stream(recording: Recording, name: str) -> Stream:
    channel = forward(recording, name)
    values = np.unwrap(channel.values) if name == "pose.yaw" else channel.values
    std = channel.std or roughness(values)
    if name.startswith("encoder."):
        std = max(std if channel.std else 0.0, 0.4)  # a count is a count
    return _thinned(name, channel.t, values, std)


def _with_correlation(streams: Sequence[Stream], recording: Recording) -> list[Stream]:
    """Return streams, poses with what of their noise lasts where its size is stated."""
    poses = [s for s in streams if s.name in POSES and recording.channels[s.name].std]
    noise = correlated_noise([(s.t, s.values, s.std) for s in poses])
    return [replace(s, correlated=noise) if any(s is one for one in poses) else s for s in streams]


def _thinned(name: str, t: Floats, values: Floats, std: float) -> Stream:
    """Return a fast stream slower: rates as means of neighbours, positions and counts as they are.

    What a car does is slower than that, and every sample costs.
    """
    pace = 1.0 / max(float(np.median(np.diff(t))), 1e-6)
    every = max(int(pace / FASTEST_HZ.get(name, FASTEST_POSE_HZ) + 0.1), 1)
    if name.startswith(("pose.", "encoder.")):
        t, values = t[::every], values[::every]
        return Stream(name, t, values, std, t[:, None], np.zeros(len(t)))
    whole = len(t) // every * every
    taps = t[:whole].reshape(-1, every)
    means, std = values[:whole].reshape(-1, every).mean(axis=1), std / math.sqrt(every)
    unsure = _leaps(means, std) if name.startswith("imu.accel") else np.zeros(len(means))
    return Stream(name, taps.mean(axis=1), means, std, taps, unsure)


def _leaps(values: Floats, std: float) -> Floats:
    """Return how unsure each value is because its neighbours differ by more than noise does.

    A command's edge makes a car leap within milliseconds; no recording's clock is that exact.
    """
    padded = np.pad(values, 1, mode="edge")
    around = np.stack((padded[:-2], values, padded[2:]))
    return np.asarray(LEAP * np.maximum(np.ptp(around, axis=0) - 4.0 * std, 0.0))
