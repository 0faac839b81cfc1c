"""What sensors read beyond what they should, along a drive: a sensor's fault, drawn.

The car that was found is driven again; its sensors once without the faults found and once with
them. What is left of the measurements, smoothed over half a second, is reported as a rate: poses
and encoder counts drift apart from a prediction, and only how fast shows anything of a moment.
"""

from collections.abc import Iterator, Sequence, Set
from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats
from scm.mismatch.evidence import Residual
from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.validate.residual_forces import honest, on_one_axis
from scm.replay.drive import Drive
from scm.replay.numbers import NEUTRAL, Numbers

BIN_S = 0.5
MOST = 3  # residuals drawn
_WORDS = {
    "imu.accel_x": "forward acceleration (IMU)",
    "imu.accel_y": "sideways acceleration (IMU)",
}


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
