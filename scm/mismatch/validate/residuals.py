"""What acted on a car that a simulator does not know: force and wheel angle along a drive.

From a few tenths of a second apart the car is driven on from its measured motion for as long again.
What its speed then lacks, over what a known push would have added to it, is the force left over;
the same with its turning and an angle of the wheels. Faults of the camera that were found are taken
out of the measured motion of both cars: a sensor's fault is no force. It is drawn as what its
sensor reads beyond the prediction, without the fault and with it, as a rate over half a second:
poses and encoder counts drift apart from a prediction, and only how fast shows anything.
"""

from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, replace

import numpy as np

from scm.arrays import Floats, Ints
from scm.mismatch.evidence import Residual
from scm.mismatch.fit.likelihood import Likelihood
from scm.replay.camera import Camera
from scm.replay.drive import STEP_S, Drive
from scm.replay.numbers import NEUTRAL, Numbers
from scm.replay.smooth import Smooth
from scm.replay.windows import Runs, Side, Windows
from scm.vehicles.car import Car

RUN_S = 0.4
EVERY_S = 0.2
APART_S = 1.0  # between drives on one axis
WIDTH_S = 0.4  # of the smoothing, one standard deviation
HORIZONTAL_G, ANGLE_RAD = 0.02, 0.02  # pushes that measure the response: over weight, wheel angle
GRAVITY = 9.80665
LEAP = 0.15  # of a change within a window that smoothing misplaces
LEAST_BAND = 0.5  # of what noise alone is thought to make
UNSURE = 4.0  # times the usual standard deviation: the car stands, nothing is known
FORCE, ANGLE = ("drive force", "N"), ("wheel angle", "rad")
MOVED = ("speed", "yaw_rate")
BIN_S = 0.5
MOST = 3  # residuals drawn
_WORDS = {
    "imu.accel_x": "forward acceleration (IMU)",
    "imu.accel_y": "sideways acceleration (IMU)",
}


@dataclass(frozen=True, slots=True)
class _Track:
    """One drive's residuals at its windows' middles, each (n,)."""

    t: Floats
    x: Floats
    y: Floats
    found: Mapping[tuple[str, str], tuple[Floats, Floats, Floats]]


def residual_forces(
    drives: Sequence[Drive], car: Car, before: Numbers, after: Numbers
) -> tuple[Residual, ...]:
    """Return the force and the wheel angle left over by two cars, smoothed, with their bands.

    Several drives follow one another in time; one shorter than a window shows nothing.

    Args:
        drives: The recordings.
        car: With every effect at its neutral numbers.
        before: Numbers of the car as given, by key.
        after: Of the car as found.
    """
    tracks = [
        replace(track, t=track.t + move)
        for drive, move in zip(drives, on_one_axis(drives), strict=True)
        if (track := _track(drive, car, before, after)) is not None
    ]
    if not tracks:
        return ()
    t, x, y = (np.concatenate([getattr(one, n) for one in tracks]) for n in ("t", "x", "y"))
    residuals = []
    for key in (FORCE, ANGLE):
        sides = [np.concatenate([one.found[key][i] for one in tracks]) for i in range(3)]
        residuals.append(
            Residual(channel=key[0], unit=key[1], t_s=t, x_m=x, y_m=y,
                     before=sides[0], after=sides[1], std=honest(sides[1], sides[2]))
        )  # fmt: skip
    return tuple(residuals)


def on_one_axis(drives: Sequence[Drive]) -> tuple[float, ...]:
    """Return what each drive's times move by to follow those of the one before; the first stay."""
    moves, end = list[float](), float(drives[0].edges[0])
    for drive in drives:
        moves.append(end - float(drive.edges[0]))
        end = float(drive.edges[-1]) + moves[-1] + APART_S
    return tuple(moves)


def honest(after: Floats, std: Floats) -> Floats:
    """Return a band that what is left after all is known leaves as often as it may."""
    known = np.isfinite(after) & np.isfinite(std)
    if not known.any():
        return std
    spread = float(np.percentile(np.abs(after / std)[known], 90)) / 1.645
    return np.asarray(std * max(LEAST_BAND, spread))


def _track(drive: Drive, car: Car, before: Numbers, after: Numbers) -> _Track | None:
    force = HORIZONTAL_G * GRAVITY * car.value("body.mass_kg")
    camera = Camera(drive, after)
    sides = [
        Side(before, camera),
        Side(after, camera),
        Side(after, camera, like=1, push=(force, 0.0)),
        Side(after, camera, like=1, push=(0.0, ANGLE_RAD)),
    ]
    steps, every = round(RUN_S / STEP_S), round(EVERY_S / STEP_S)
    at = starts_of(drive, camera, steps, every)
    if not len(at):
        return None
    runs = Windows(drive, car).run(sides, np.tile(at, (len(sides), 1)), steps)
    end = drive.edges[at + steps]
    begun, ended = camera.motion(drive.edges[at]), camera.motion(end)
    change = response(runs, 1, ((2, force), (3, ANGLE_RAD)))
    real = np.stack([getattr(ended, name) for name in MOVED])
    leaps = LEAP * (real - np.stack([getattr(begun, name) for name in MOVED]))
    lacks = [real - np.stack([runs[name][-1, i] for name in MOVED]) for i in range(2)]
    found = _found(
        drive.edges[at], lacks, change, np.hypot(_stds(drive, drive.edges[at], end), leaps)
    )
    middle = drive.edges[at] + 0.5 * RUN_S
    x, y, _ = camera.truly(*camera.recorded(camera.stamp(middle)))
    return _Track(middle, x, y, found)


def starts_of(drive: Drive, camera: Camera, steps: int, every: int) -> Ints:
    """Return the edges at which windows start whose poses were all recorded."""
    at: Ints = np.arange(1, len(drive.edges) - steps - 1, every)
    stamps, t = drive.smoothed["pose.x"].t, camera.stamp(drive.edges)
    known = (t[at - 1] >= stamps[0]) & (t[at + steps + 1] <= stamps[-1])
    return np.asarray(at[known])


def response(runs: Runs, base: int, pushes: Sequence[tuple[int, float]]) -> Floats:
    """Return what speed and yaw rate gain at the windows' ends from each push, (2, 2, windows).

    Args:
        runs: Of the base, and of the same car pushed.
        base: Number of the side that is not pushed.
        pushes: Side and size of the push by a force, then by an angle of the wheels.
    """
    return np.stack([
        [(runs[name][-1, side] - runs[name][-1, base]) / push for side, push in pushes]
        for name in MOVED
    ])  # fmt: skip


def inverse_of(change: Floats) -> Floats:
    """Return force and angle by what speed and yaw rate gain; NaN where unknown."""
    size = change[0, 0] * change[1, 1] - change[0, 1] * change[1, 0]
    size = np.where(np.abs(size) > 1e-12, size, np.nan)
    swapped = np.array([[change[1, 1], -change[0, 1]], [-change[1, 0], change[0, 0]]])
    return np.asarray(swapped / size)


def _found(
    t: Floats, lacks: Sequence[Floats], change: Floats, stds: Floats
) -> dict[tuple[str, str], tuple[Floats, Floats, Floats]]:
    """Return both residuals of both cars, and their bands.

    Args:
        t: (windows,).
        lacks: What each car's speed and yaw rate lack, (2, windows).
        change: Of speed and yaw rate by force and wheel angle, (2, 2, windows).
        stds: Of what they lack, (2, windows).
    """
    inverse = inverse_of(change)
    amounts = [np.einsum("ijw,jw->iw", inverse, lack) for lack in lacks]
    spread = np.sqrt(np.einsum("ijw,jw->iw", inverse**2, stds**2))
    return {
        key: _smoothed(t, amounts[0][i], amounts[1][i], spread[i])
        for i, key in enumerate((FORCE, ANGLE))
    }


def _stds(drive: Drive, start: Floats, end: Floats) -> Floats:
    """Return how unsure speed and yaw rate are, start and end together, (2, windows)."""
    x, y, yaw = (drive.smoothed[f"pose.{n}"] for n in ("x", "y", "yaw"))

    def both(of: Smooth) -> Floats:
        return np.hypot(*(np.interp(t, of.t, of.rate_std) for t in (start, end)))

    return np.stack((np.sqrt(0.5 * (both(x) ** 2 + both(y) ** 2)), both(yaw)))


def _smoothed(
    t: Floats, before: Floats, after: Floats, std: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return weighted means over neighbours in time, and their standard deviation."""
    usual = float(np.nanmedian(std))
    known = np.isfinite(std) & np.isfinite(before) & np.isfinite(after) & (std < UNSURE * usual)
    weight = np.where(known, 1.0 / np.where(known, std, 1.0) ** 2, 0.0)
    near = np.exp(-0.5 * ((t[:, None] - t) / WIDTH_S) ** 2) * weight
    total = near.sum(axis=1)
    sure = known & (total > 0.0)
    total = np.where(sure, total, np.nan)
    shared = max(RUN_S / EVERY_S, 1.0)  # neighbours share their measurements
    spread = np.sqrt(shared * (near**2 @ np.where(known, std, 0.0) ** 2)) / total
    sides = [near @ np.where(known, side, 0.0) / total for side in (before, after)]
    return sides[0], sides[1], spread


@dataclass(frozen=True, slots=True)
class _Line:
    """One residual of one drive, each (bins,)."""

    channel: str
    unit: str
    t: Floats
    sides: tuple[Floats, Floats]
    std: Floats


def sensor_residuals(
    model: Likelihood, found: Numbers, faults: Set[str], channels: Sequence[str]
) -> tuple[Residual, ...]:
    """Return what the named channels read beyond the prediction, without and with faults.

    Args:
        model: With the recordings.
        found: All numbers found, by key.
        faults: Keys of the faults of measurement among them.
        channels: To draw, most telling first.
    """
    without = {k: NEUTRAL[k] if k in faults else v for k, v in found.items()}
    residuals, _ = model.residuals([without, found])
    wanted = list(dict.fromkeys(_kind(name) for name in channels))
    lines = [list(_lines(d, r, wanted)) for d, r in zip(model.drives, residuals, strict=True)]
    titles = dict.fromkeys(line.channel for of_drive in lines for line in of_drive)
    return tuple(_residual(model.drives, lines, title) for title in list(titles)[:MOST])


def _kind(channel: str) -> str:
    """Return what channels of one kind have in common."""
    return channel[: channel.index(".")] if channel.startswith(("pose.", "encoder.")) else channel


def _residual(drives: Sequence[Drive], lines: Sequence[Sequence[_Line]], title: str) -> Residual:
    """Join one residual of all drives that have it."""
    mine = [(d, line, move) for d, of, move in zip(drives, lines, on_one_axis(drives), strict=True)
            for line in of if line.channel == title]  # fmt: skip
    x, y = (
        np.concatenate([d.smoothed[f"pose.{n}"].at(line.t) for d, line, _ in mine]) for n in "xy"
    )
    before, after = (np.concatenate([line.sides[i] for _, line, _ in mine]) for i in range(2))
    std = honest(after, np.concatenate([line.std for _, line, _ in mine]))
    t_s = np.concatenate([line.t + move for _, line, move in mine])
    return Residual(
        channel=title, unit=mine[0][1].unit, t_s=t_s,
        x_m=x, y_m=y, before=before, after=after, std=std,
    )  # fmt: skip


def _lines(drive: Drive, residuals: Sequence[Floats], wanted: Sequence[str]) -> Iterator[_Line]:
    streams = dict(zip(drive.names, residuals, strict=True))
    for kind in wanted:
        if kind == "pose":
            yield from _poses(drive, streams["pose.x"], streams["pose.y"])
        elif kind == "encoder":
            radius = drive.car.value("wheel.radius_m")
            metre = 2.0 * np.pi * radius / drive.car.value("encoder.counts_per_revolution")
            names = [name for name in streams if _kind(name) == kind]
            rates = [_rate(drive, name, streams[name]) for name in names]
            t, std = rates[0][0], rates[0][2] * metre / np.sqrt(len(names))
            mean = metre * np.mean([rate[1] for rate in rates], axis=0)
            yield _Line("wheel speed (encoders)", "m/s", t, (mean[0], mean[1]), std)
        else:
            t, mean, std = _means(drive, kind, streams[kind])
            unit = "m/s^2" if "accel" in kind else "rad/s"
            unit = "m/s" if kind in ("speed", "velocity.x", "velocity.y") else unit
            word = "yaw rate (gyro)" if unit == "rad/s" else _WORDS.get(kind, kind)
            yield _Line(word, unit, t, (mean[0], mean[1]), std)


def _poses(drive: Drive, x: Floats, y: Floats) -> Iterator[_Line]:
    """Yield how fast poses run from the prediction along the body and across it."""
    (t, vx, std), (_, vy, _) = _rate(drive, "pose.x", x), _rate(drive, "pose.y", y)
    yaw = drive.smoothed["pose.yaw"].at(t)
    c, s = np.cos(yaw), np.sin(yaw)
    along, across = c * vx + s * vy, c * vy - s * vx
    yield _Line("forward speed (poses)", "m/s", t, (along[0], along[1]), std)
    yield _Line("sideways speed (poses)", "m/s", t, (across[0], across[1]), std)


def _means(drive: Drive, name: str, residual: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the middles of the bins that hold anything, means (2, bins), and their std."""
    stream = drive.stream(name)
    bins = max(int((drive.edges[-1] - drive.edges[0]) / BIN_S), 1)
    which = np.clip(((stream.t - drive.edges[0]) / BIN_S).astype(np.int64), 0, bins - 1)
    count = np.bincount(which, minlength=bins).astype(np.float64)
    count[count == 0.0] = np.nan
    sums = [np.bincount(which, weights=residual[:, i], minlength=bins) for i in range(2)]
    middle = drive.edges[0] + BIN_S * (np.arange(bins) + 0.5)
    return middle, np.stack(sums) / count, stream.std / np.sqrt(count)


def _rate(drive: Drive, name: str, residual: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the same of a residual's rate, from bin to bin after the next."""
    t, mean, std = _means(drive, name, residual)
    rate = np.full_like(mean, np.nan)
    rate[:, 1:-1] = (mean[:, 2:] - mean[:, :-2]) / (2.0 * BIN_S)
    return t, rate, np.sqrt(2.0) * std / (2.0 * BIN_S)
