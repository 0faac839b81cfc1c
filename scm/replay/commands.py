"""The recorded commands of a car: held between rows, or averaged over each step."""

from dataclasses import dataclass, field, replace

import numpy as np

from scm.arrays import Floats
from scm.data_quality.pose_track import Series, series, track
from scm.data_quality.repairs import forward_speed
from scm.errors import RecordingError
from scm.recording.motion import forward
from scm.recording.read import Channel, Recording
from scm.vehicles.car import Car
from scm.vehicles.drive_channel import drive_name
from scm.vehicles.jit import array_kernel

FULL_SPEED = "drive.full_speed_m_s"
RAMP_S, HELD_S = 0.02, 1.0  # steps of a commanded acceleration, and how long a row counts
ANCHORED_S = 3.0  # as long as a window: slower than that a commanded speed is the measured one
LARGEST_COMMAND = 1.5  # some drivers overshoot 1 a little; a percentage is far beyond


class Commands:
    """Recorded throttle and steering, held between their rows, as the car's commands in [-1, 1].

    A car with `speed_control` is driven by the speed or the acceleration that was commanded, or
    else by the measured speed: then its throttle is that speed over the car's full one.
    """

    def __init__(self, recording: Recording, car: Car) -> None:
        self._throttle = _drive_of(recording, car)
        self._steering = forward(recording, "command.steering")
        self._per_unit = 1.0
        if self._steering.dimension == "angle":
            self._per_unit = 1.0 / _steering_limit(recording, car)
        for name, channel in (("throttle", self._throttle), ("steering", self._steering)):
            largest = float(np.abs(channel.values).max())
            if channel.dimension == "ratio" and largest > LARGEST_COMMAND:
                msg = f"{recording.path}: command.{name}: reaches {largest:g}, expected -1 to 1; "
                msg += "give its unit, or scale and offset, in the description"
                raise RecordingError(msg)
        self._battery = None
        if "battery.voltage" in recording.channels and car.has("drive.battery_nominal_v"):
            self._battery = forward(recording, "battery.voltage")

    def voltage(self, t: Floats) -> Floats | None:
        """Return the measured battery voltage at times `t`, or None where it is not known [V]."""
        return None if self._battery is None else _held(self._battery, t)

    def at(self, t: Floats) -> tuple[Floats, Floats]:
        """Return throttle and steering at times `t`; before the first row they are the first's."""
        return _held(self._throttle, t), _held(self._steering, t) * self._per_unit

    @property
    def rows(self) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
        """Times and values of throttle and of steering as recorded, in [-1, 1]."""
        steering = self._steering.values * self._per_unit
        return (self._throttle.t, self._throttle.values), (self._steering.t, steering)

    @property
    def span_s(self) -> tuple[float, float]:
        """First and last time at which both commands are known."""
        first = max(self._throttle.t[0], self._steering.t[0])
        return float(first), float(min(self._throttle.t[-1], self._steering.t[-1]))


def _drive_of(recording: Recording, car: Car) -> Channel:
    """Return the throttle that drives the car, or the speed that does, over its full speed."""
    name = drive_name(recording, car)
    channel = forward(recording, name)
    if name == "command.throttle":
        return channel
    if name == "command.acceleration":
        channel = _speed_of(channel, recording, car.value(FULL_SPEED))
    return replace(channel, values=channel.values / car.value(FULL_SPEED), dimension="ratio")


def _speed_of(acceleration: Channel, recording: Recording, full_mps: float) -> Channel:
    """Return the speed that commanded accelerations ask for, from the measured one on.

    It leads back to the measured speed within `ANCHORED_S`: no car keeps an acceleration so exactly
    that the sum of minutes is still its speed.
    """
    measured = _measured_speed(recording)
    steps = np.clip(np.ceil(np.diff(acceleration.t) / RAMP_S), 1, round(HELD_S / RAMP_S))
    count = np.append(steps.astype(np.int64), 1)
    row = np.repeat(np.arange(len(acceleration.t)), count)
    since = (np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)) / count[row]
    gap = np.append(np.diff(acceleration.t), 0.0)
    t = acceleration.t[row] + since * gap[row]
    rate = np.where(since * gap[row] < HELD_S, acceleration.values[row], 0.0)
    step = np.diff(t)
    gained, lead = rate[:-1] * np.minimum(step, HELD_S), -np.expm1(-step / ANCHORED_S)
    target = measured.at(t)
    speed = np.empty(len(t))
    speed[0] = now = float(target[0])
    for k in range(len(step)):
        now += gained[k]
        now += lead[k] * (target[k + 1] - now)
        speed[k + 1] = now = min(max(now, -full_mps), full_mps)
    return replace(acceleration, t=t, values=speed)


def _measured_speed(recording: Recording) -> Series:
    """Return the forward speed that was measured, by the car itself or by its poses.

    Raises:
        RecordingError: when nothing measured it.
    """
    own = (series(recording, name) for name in ("speed", "velocity.x"))
    found = next((one for one in own if one is not None), None) or forward_speed(track(recording))
    if found is None:
        msg = f"{recording.path}: command.acceleration needs a measured speed to begin with: "
        raise RecordingError(msg + "expected speed, velocity.x or poses")
    return found


def _steering_limit(recording: Recording, car: Car) -> float:
    """Return the wheel angle that a steering command of 1 asks for [rad]."""
    if not car.has("steering.limit_rad"):
        msg = (
            f"{recording.path}: command.steering is an angle, but {car.name} has no "
            f"steering.limit_rad to say which command that is"
        )
        raise RecordingError(msg)
    return car.value("steering.limit_rad")


def _held(channel: Channel, t: Floats) -> Floats:
    """Return the value of the last row at or before each time; before the first, the first's."""
    row = np.searchsorted(channel.t, t, side="right") - 1
    return channel.values[np.maximum(row, 0)]


@dataclass(frozen=True, slots=True)
class Commanded:
    """A command that holds its value until the next row; zero before the first.

    Attributes:
        t: Times of the rows, rising strictly, (n,) [s].
        values: In [-1, 1], (n,).
    """

    t: Floats
    values: Floats
    _area: Floats = field(init=False, repr=False)  # the command's integral up to each row

    def __post_init__(self) -> None:
        area = np.concatenate(([0.0], np.cumsum(self.values[:-1] * np.diff(self.t))))
        object.__setattr__(self, "_area", area)

    def means(self, edges: Floats, delay: Floats) -> Floats:
        """Return the mean over each step, for several delays: (steps, delays).

        Taking the mean, not a sample, keeps a step's time exact and the result smooth in the delay.

        Args:
            edges: Times at which steps begin and end, (steps + 1,) [s].
            delay: From the row's time to its effect, (delays,) [s].
        """
        out = np.empty((len(edges) - 1, len(delay)))
        _means(self.t, self.values, self._area, edges, delay, out)
        return out


@array_kernel
def _means(
    t: Floats, values: Floats, area: Floats, edges: Floats, delays: Floats, out: Floats
) -> None:
    for k in range(len(delays)):
        twin = 0
        while delays[twin] != delays[k]:
            twin += 1
        if twin < k:
            for i in range(len(out)):
                out[i, k] = out[i, twin]
            continue
        row, after = -1, len(t)  # the last row that is not later, and the first that is
        while after - row > 1:
            middle = (row + after) // 2
            if t[middle] <= edges[0] - delays[k]:
                row = middle
            else:
                after = middle
        before = 0.0
        for i in range(len(edges)):
            at = edges[i] - delays[k]
            while row + 1 < len(t) and t[row + 1] <= at:
                row += 1
            whole = area[row] + values[row] * (at - t[row]) if row >= 0 else 0.0
            if i > 0:
                out[i - 1, k] = (whole - before) / (edges[i] - edges[i - 1])
            before = whole
