"""How far the car has gone: by each sensor of distance, and by the poses against it."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from scm.arrays import Floats
from scm.data_quality.pose_track import Grid, Series, Track, cut_at_gaps, recorded_s, series
from scm.data_quality.quality import DataProblem, Measured, Relation
from scm.data_quality.whitened_fit import Fit, fit
from scm.recording.read import Recording
from scm.vehicles.car import Car

SIDES = (("encoder.left", "encoder.right"), ("wheel_speed.rl", "wheel_speed.rr"))
ROUNDS = 6
SMALLEST_TILT = 2e-5
SHORTEST_S = 10.0
CHORD_S = 1.0
PLACE_WIDTH_S, YAW_WIDTH_S, FEWEST_SMOOTHED = 0.3, 0.08, 20
FEWEST_CHORDS = 5
SHORTEST_DRIFT_S = 30.0
MOST_ROWS = 4000
SIDE_SLIP_STD = 0.02  # rad per m/s^2: tyres give way by a few degrees at most
DRIVE_SLIP_STD = 0.02  # per m/s^2: wheels spin under push, and drag in turns
NAMES = (
    "scale", "heading", "ahead", "aside", "tilt_x", "tilt_y", "side_slip", "drive_slip",
    "turn_slip", "delay", "rate",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class DistanceSensor:
    """Distance since the start [m], forward counted positive.

    Attributes:
        name: Of the sensor, such as `encoder.*`.
        channels: It is made of.
        wheels: Whether it is counted on wheels, so that their radius enters.
        scale_std: What the car file, or the last digit, leaves open about its scale.
    """

    name: str
    channels: tuple[str, ...]
    wheels: bool
    scale_std: float
    distance: Series


def distance_sensors(recording: Recording, car: Car | None) -> list[DistanceSensor]:
    """Return every sensor of distance; wheels need the car's radius."""
    found = [_counted(recording, car), _rolled(recording, car)]
    for name in ("speed", "velocity.x"):
        speed = series(recording, name)
        if speed is not None:
            found.append(DistanceSensor(name, (name,), False, _rounded(speed), speed.integral()))
    return [way for way in found if way is not None and np.ptp(way.distance.values) > 0.0]


def uncounted(recording: Recording, car: Car) -> Iterator[DataProblem]:
    """Yield that encoders are of no use where the car file does not say what they count."""
    names = [name for name in SIDES[0] if name in recording.channels]
    if names and not car.has("encoder.counts_per_revolution"):
        yield DataProblem(
            channel="encoder.*",
            name="unknown_counts",
            text=f"The car file {car.name!r} does not say how many counts a turn makes: encoders "
            "are not used.",
            record_instead="Nothing: state encoder.counts_per_revolution in the car file.",
        )


def _rounded(speed: Series) -> float:
    """Return by how much a speed is off where its last digit is cut instead of rounded."""
    steps = np.diff(np.unique(speed.values))
    moving = float(np.percentile(np.abs(speed.values), 75))
    return 0.5 * float(np.percentile(steps, 10)) / moving if len(steps) and moving > 0.0 else 0.0


def _counted(recording: Recording, car: Car | None) -> DistanceSensor | None:
    left, right = (series(recording, name) for name in SIDES[0])
    if car is None or left is None or right is None or not car.has("encoder.counts_per_revolution"):
        return None
    metre = math.tau * car.value("wheel.radius_m") / car.value("encoder.counts_per_revolution")
    return _pair("encoder.*", SIDES[0], left, right, metre, car)


def _rolled(recording: Recording, car: Car | None) -> DistanceSensor | None:
    left, right = (series(recording, name) for name in SIDES[1])
    if car is None or left is None or right is None:
        return None
    radius = car.value("wheel.radius_m")
    return _pair("wheel_speed.*", SIDES[1], left.integral(), right.integral(), radius, car)


def _pair(
    name: str, channels: tuple[str, str], left: Series, right: Series, metre: float, car: Car
) -> DistanceSensor:
    middle = 0.5 * (left.values * metre + right.at(left.t) * metre)
    std = (car.quantity("wheel.radius_m").std or 0.0) / car.value("wheel.radius_m")
    return DistanceSensor(name, channels, True, std, Series(left.t, middle))


def travel_against(
    poses: Track,
    distance: Series,
    other: str,
    start: tuple[float, float] = (0.0, 0.0),
) -> Relation | None:
    """Compare positions with a distance that a sensor has added up.

    The pose stamped t shows the car at u = t - delay - rate (t - start of the poses). Tyres that
    give way sideways, and wheels that spin under push, are left free: they are no sensor's fault.

    Args:
        poses: At the rear axle.
        distance: Way since its start [m], on its own clock.
        other: Its channel.
        start: Delay [s] and rate to start from.

    Returns:
        `scale`, true distance over the sensor's (or the pose's metre over a metre); `heading`
        [rad], by which the pose's yaw is turned; `ahead`, `aside` [m], where the tracked point is;
        `tilt_x`, `tilt_y` [1/m]; `delay` [s] and `rate` of the pose's stamps; `slip`, the share of
        the way that wheels seem to slip; `chord`, the scale as a second's worth of way shows it,
        cruder than `scale` but blind to stamps that jitter.
    """
    inside = (poses.t - start[0] > distance.t[0]) & (poses.t - start[0] < distance.t[-1])
    rows = poses.cut(inside)
    if len(rows.t) < 50 or recorded_s(rows.t) < SHORTEST_S:
        return None
    rows = rows.cut(np.arange(len(rows.t)) % (1 + len(rows.t) // MOST_ROWS) == 0)
    since, warp, tilt = rows.since, np.array(start), np.zeros(2)
    count = len(NAMES) if since[-1] >= SHORTEST_DRIFT_S else len(NAMES) - 1
    found, starts = None, cut_at_gaps(rows.starts, rows.t, distance.t)
    for _ in range(ROUNDS):
        straight = _straightened(rows, tilt)
        measured = np.stack((straight.x, straight.y), axis=1)
        u = rows.t - warp[0] - warp[1] * since
        columns = _columns(_smoothed(straight, starts), distance, u)[:, :, :count]
        found = fit(measured, columns, _priors()[:count], starts, near=found)
        step = found.values[9:] / found.values[0] if found.values[0] else np.zeros(1)
        warp[: len(step)] += np.clip(step, -0.5, 0.5)
        tilt_step = np.clip(found.values[4:6], -0.02, 0.02)
        tilt += tilt_step
        late = np.abs(step) < (1e-4, 1e-6)[: len(step)]
        if np.all(late) and np.all(np.abs(tilt_step) < SMALLEST_TILT):
            break
    if found is None:
        return None
    numbers = _numbers(found, warp, tilt) | {
        "slip": Measured(_slipped(columns, found.values), 0.0),
        "chord": Measured(_chords(straight, columns[:, :, 0], starts), 0.0),
    }
    return Relation(("pose.x", other), numbers, max(poses.period_s, distance.period_s))


def _straightened(rows: Track, tilt: Floats) -> Track:
    """Return the poses as a camera without that tilt would show them."""
    depth = np.maximum(1.0 - tilt[0] * rows.x - tilt[1] * rows.y, 0.2)
    return Track(rows.t, rows.x / depth, rows.y / depth, rows.yaw)


def _chords(rows: Track, way: Floats, starts: Sequence[int]) -> float:
    """Return the middle of what moves of about a second are against the way counted."""
    reach = max(1, round(CHORD_S / rows.period_s))
    first = np.arange(0, len(rows.t) - reach, max(1, reach // 2))
    stretch = np.searchsorted(np.asarray(starts), np.arange(len(rows.t)), side="right")
    first = first[stretch[first] == stretch[first + reach]]
    counted = way[first + reach] - way[first]
    moved = np.stack((rows.x, rows.y), axis=1)
    moved = moved[first + reach] - moved[first]
    size = (counted**2).sum(axis=1)
    far = size > 0.25 * float(np.percentile(size, 90)) if len(size) else size > 0.0
    if far.sum() < FEWEST_CHORDS:
        return math.nan
    return float(np.median((moved[far] * counted[far]).sum(axis=1) / size[far]))


def _slipped(columns: Floats, values: Floats) -> float:
    """Return how much of the way is put down to wheels that slip."""
    slip = np.diff(columns[:, :, 7:9] @ values[7:9], axis=0)
    way = np.diff(columns[:, :, 0], axis=0)
    return float(np.abs(slip).sum() / (np.abs(way).sum() + 1e-12))


def _priors() -> Floats:
    priors = np.full(len(NAMES), np.inf)
    priors[6:9] = SIDE_SLIP_STD, DRIVE_SLIP_STD, DRIVE_SLIP_STD
    return priors


def _smoothed(rows: Track, starts: Sequence[int]) -> Track:
    """Return the poses smoothed: their noise, met again in a column, would look like a fault."""
    x, y, yaw = rows.x.copy(), rows.y.copy(), rows.yaw.copy()
    for i, j in pairwise((*starts, len(rows.t))):
        if j - i < FEWEST_SMOOTHED:
            continue
        for values, width in ((x, PLACE_WIDTH_S), (y, PLACE_WIDTH_S), (yaw, YAW_WIDTH_S)):
            even = Grid(rows.t[i:j], rows.period_s, max(width, rows.period_s))
            values[i:j] = even.smooth_even(values[i:j])
    return Track(rows.t, x, y, yaw)


def _columns(rows: Track, distance: Series, u: Floats) -> Floats:
    """Return what each number does to x and y, shape `(n, 2, k)`."""
    yaw = rows.yaw
    way = distance.at(u)
    dt = np.diff(rows.t)
    speed = _slope(rows.t, way)
    rate, push = _slope(rows.t, yaw), _slope(rows.t, speed)
    along = np.stack((np.cos(yaw), np.sin(yaw)), axis=1)
    left = np.stack((-along[:, 1], along[:, 0]), axis=1)
    middle = yaw[:-1] + 0.5 * np.diff(yaw)
    chord = np.sinc(np.diff(yaw) / (2.0 * np.pi))
    ahead = np.stack((np.cos(middle), np.sin(middle)), axis=1) * chord[:, None]
    side = np.stack((-ahead[:, 1], ahead[:, 0]), axis=1)
    since = rows.since
    here = np.stack((rows.x, rows.y), axis=1)

    def added(direction: Floats, amounts: Floats) -> Floats:
        return np.concatenate((np.zeros((1, 2)), np.cumsum(direction * amounts[:, None], axis=0)))

    step = np.diff(way)
    mean_speed, mean_rate = _middle(speed), _middle(rate)
    accelerated = mean_speed * _middle(push) * dt
    turned = mean_speed * np.abs(mean_speed * mean_rate) * dt
    return np.stack(
        (
            added(ahead, step),
            -added(side, step),
            along,
            left,
            -here * rows.x[:, None],
            -here * rows.y[:, None],
            added(side, mean_speed * mean_speed * mean_rate * dt),
            added(ahead, accelerated),
            added(ahead, turned),
            -added(ahead, np.diff(speed)),
            -added(ahead, np.diff(speed * since)),
        ),
        axis=2,
    )


def _middle(values: Floats) -> Floats:
    return 0.5 * (values[1:] + values[:-1])


def _slope(t: Floats, values: Floats) -> Floats:
    """Return the slope over about 0.2 s around each row."""
    reach = max(1, round(0.1 / float(np.median(np.diff(t)))))
    i = np.arange(len(t))
    a, b = np.maximum(i - reach, 0), np.minimum(i + reach, len(t) - 1)
    return (values[b] - values[a]) / (t[b] - t[a])


def _numbers(found: Fit, warp: Floats, tilt: Floats) -> dict[str, Measured]:
    """Return what was fitted by name, delay and tilt with all rounds added up."""
    numbers = found.numbers(NAMES)
    k = max(abs(float(found.values[0])), 1e-9)
    for name, total in zip(NAMES[9 : len(found.values)], warp, strict=False):
        numbers[name] = Measured(float(total), numbers[name].std / k, numbers[name].leak)
    for name, total in zip(NAMES[4:6], tilt, strict=True):
        numbers[name] = replace(numbers[name], value=float(total))
    return numbers
