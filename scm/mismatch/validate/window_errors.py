"""What free runs' windows show at their ends, as every sensor would have recorded it."""

from collections.abc import Iterator

import numpy as np

from scm.arrays import Floats, Ints
from scm.mismatch.fit.rollouts import Motions
from scm.mismatch.fit.sensor_prediction import Prediction
from scm.replay.drive import STEP_S, Drive, Stream
from scm.replay.numbers import NEUTRAL
from scm.replay.windows import Runs, at_times

END_S = 0.2  # speeds are means over the window's end of this length


def sensor_errors(
    drive: Drive, runs: Runs, starts: Ints, since: tuple[Floats, Floats]
) -> Iterator[tuple[str, Floats, float]]:
    """Yield name, error (sides, windows) and own variance of what every other sensor shows.

    Rates are summed over the window, speeds are means at its end. Faults of these sensors that the
    car file states are part of what it predicts.
    """
    prediction, radius = Prediction(drive), drive.car.value("wheel.radius_m")
    shape = (len(next(iter(runs.signals.values()))), -1)
    motions = Motions(
        {k: v.reshape(shape) for k, v in runs.signals.items()}, runs.ok.ravel().astype(np.float64)
    )
    faults = {
        key: np.full(starts.size, drive.car.value(key) if drive.car.has(key) else neutral)
        for key, neutral in NEUTRAL.items()
    }
    begin = drive.edges[starts]
    for stream in drive.streams:
        if stream.name.startswith("pose."):
            continue
        signal = prediction.sensor(stream.name, motions, faults).reshape(-1, *starts.shape)
        name, per_unit, kind = _channel(stream.name, drive, radius)
        first = since[1] - END_S if kind == "end" else since[0]
        length = since[1] - first
        seen = _sums(stream, begin + first, begin + since[1], kind)
        if kind == "count":
            meant = at_times(signal, since[1]) - at_times(signal, first)
            variance = 2.0 * stream.std**2
        else:
            total = np.zeros_like(signal)
            np.cumsum(0.5 * STEP_S * (signal[1:] + signal[:-1]), axis=0, out=total[1:])
            meant = at_times(total, since[1]) - at_times(total, first)
            pace = float(np.median(np.diff(stream.t)))
            variance = stream.std**2 * pace * float(length.mean())
        scale = per_unit / (END_S if kind == "end" else 1.0)
        yield name, scale * (meant - seen), scale**2 * variance


def _channel(name: str, drive: Drive, radius: float) -> tuple[str, float, str]:
    """Return an error's name, its factor on the stream, and whether it counts, sums or ends."""
    if name.startswith("encoder."):
        counts = drive.car.value("encoder.counts_per_revolution") / (2.0 * np.pi)
        return "wheel_m", radius / counts, "count"
    if name.startswith("wheel_speed."):
        return "wheel_m", radius, "sum"
    if name.startswith("imu.accel"):
        return f"{name[4:]}_mps", 1.0, "sum"
    if name in ("speed", "velocity.x"):
        return "speed_mps", 1.0, "end"
    if name == "velocity.y":
        return "side_speed_mps", 1.0, "end"
    return "gyro_rad", 1.0, "sum"


def _sums(stream: Stream, first: Floats, last: Floats, kind: str) -> Floats:
    """Return what a stream counted, or its integral, between times."""
    if kind == "count":
        return np.asarray(np.interp(last, stream.t, stream.values)
                          - np.interp(first, stream.t, stream.values))  # fmt: skip
    steps = 0.5 * np.diff(stream.t) * (stream.values[1:] + stream.values[:-1])
    total = np.concatenate(([0.0], np.cumsum(steps)))
    return np.asarray(np.interp(last, stream.t, total) - np.interp(first, stream.t, total))
