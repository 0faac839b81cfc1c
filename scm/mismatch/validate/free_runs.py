"""Free runs of the car as given and of the car as found, against the recording.

Windows are those of `scm.replay.free_run`, so `scm replay` of a car file finds the same errors:
those at a window's end, root mean squares over windows of one part of the recordings.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.data_quality.quality import Span
from scm.errors import RecordingError
from scm.mismatch.evidence import FreeRuns
from scm.mismatch.findings import Fit, PartErrors
from scm.mismatch.fit.data_split import NAMES, Parts
from scm.mismatch.fit.rollouts import Motions
from scm.mismatch.fit.sensor_prediction import Prediction
from scm.mismatch.validate.residuals import on_one_axis
from scm.mismatch.validate.stages import Stage
from scm.recording.motion import Poses
from scm.replay.camera import Camera
from scm.replay.drive import STEP_S, Drive, Stream
from scm.replay.free_run import SAVE_EVERY_S, Replay
from scm.replay.numbers import NEUTRAL
from scm.replay.smooth import Smooth, smooth
from scm.replay.windows import Runs, at_times
from scm.vehicles.car import Car, Quantity
from scm.vehicles.car_file_schema import FILE_KEYS, POSITION_ERROR, YAW_ERROR

END_S = 0.2  # speeds are means over the window's end of this length


def sensor_errors(
    drive: Drive, runs: Runs, starts: Ints, since: tuple[Floats, Floats]
) -> Iterator[tuple[str, Floats, float]]:
    """Yield name, error (sides, windows) and own variance of what every other sensor shows.

    Rates are summed over the window, speeds are means at its end. Faults of these sensors that the
    car file states are part of what it predicts.
    """
    prediction, radius = Prediction(drive), drive.car.value("wheel.radius_m")
    shape = (len(next(iter(runs.variables.values()))), -1)
    motions = Motions(
        {k: v.reshape(shape) for k, v in runs.variables.items()}, runs.ok.ravel().astype(np.float64)
    )
    faults = {
        key: np.full(starts.size, drive.car.value(key) if drive.car.has(key) else neutral)
        for key, neutral in NEUTRAL.items()
    }
    begin = drive.edges[starts]
    for stream in drive.streams:
        if stream.name.startswith("pose."):
            continue
        variable = prediction.sensor(stream.name, motions, faults).reshape(-1, *starts.shape)
        name, per_unit, kind = _channel(stream.name, drive, radius)
        first = since[1] - END_S if kind == "end" else since[0]
        length = since[1] - first
        seen = _sums(stream, begin + first, begin + since[1], kind)
        if kind == "count":
            meant = at_times(variable, since[1]) - at_times(variable, first)
            variance = 2.0 * stream.std**2
        else:
            total = np.zeros_like(variable)
            np.cumsum(0.5 * STEP_S * (variable[1:] + variable[:-1]), axis=0, out=total[1:])
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


FAST_MPS, FAST_HORIZON_S, SLOW_HORIZON_S = 1.0, 1.0, 3.0
SHORTEST_S = 0.2
MOST_TIME = 0.8  # of a recording: blocks that make up the rest may be too short for a window
NEXT_S = 1.0  # between the starts of windows at most
DRAWS = 2
START_DIGITS = 6  # of a window's start in a report [s]: whoever replays it starts there too
WORSE = 1.02
MAX_NOISE_RATIO = 3.0  # of an error to what noise makes of it; healthy cars: 2.3 at most
LIKE_STATED = 1.5  # of the error that a car's file states: what few windows scatter by
ACCURACY = {"position_m": POSITION_ERROR, "yaw_rad": YAW_ERROR}
ALIKE = 0.01  # of the way and of the turn: healthy cars of unlike equations, 0.006 to 0.023
_BEFORE, _AFTER = 0, 1


@dataclass(frozen=True, slots=True)
class _Judged:
    """One drive's windows: errors by channel, each (sides, windows, values), and what is drawn.

    Attributes:
        number: Of the drive; `file`: of the car found.
        start_s: (windows,), by the poses' stamps; `part`: of each.
        floor: What noise alone makes of each error, (draws, windows, values).
        shown: Poses recorded, before and after, (3, windows, times).
    """

    number: int
    file: str
    start_s: Floats
    part: tuple[str, ...]
    errors: Mapping[str, Floats]
    floor: Mapping[str, Floats]
    shown: Mapping[str, Floats]


def horizon_of(drives: Sequence[Drive], parts: Parts) -> float:
    """Return how long windows should be: 1 s for a fast car, 3 s for a slow one, or a block."""
    speeds = [drive.pose_speed for drive in drives]
    fast = float(np.percentile(np.concatenate(speeds), 90)) > FAST_MPS
    blocks = [b - a for name in NAMES for spans in getattr(parts, name).spans for a, b in spans]
    longest = 0.9 * _usual(blocks) if blocks else SLOW_HORIZON_S
    return round(min(FAST_HORIZON_S if fast else SLOW_HORIZON_S, longest), 2)


def _usual(blocks: Sequence[float]) -> float:
    """Return the length that blocks have which are most of the time: short ones show nothing."""
    lengths = np.sort(blocks)[::-1]
    return float(lengths[np.searchsorted(np.cumsum(lengths), MOST_TIME * lengths.sum() - 1e-9)])


def judge(
    drives: Sequence[Drive],
    before: Car,
    after: Car | Sequence[Stage],
    parts: Parts,
    horizon_s: float | None = None,
) -> tuple[Fit, FreeRuns]:
    """Return how well two cars follow the recordings on each part, and their free runs.

    Windows in which something came, changed or went at once count for nothing: no car drives them.

    Args:
        drives: The recordings.
        before: The car as given.
        after: The car as found, or as it was in each part of a recording.
        parts: Of the recordings.
        horizon_s: Length of a window; None chooses it.

    Raises:
        RecordingError: when no recording holds a whole window.
    """
    horizon = horizon_of(drives, parts) if horizon_s is None else horizon_s
    horizon = max(round(horizon / STEP_S) * STEP_S, SHORTEST_S)
    stages = (Stage(after),) if isinstance(after, Car) else after
    moments = np.array([stage.from_s for stage in stages if stage.at_once])
    judged = [
        one
        for number, drive in enumerate(drives)
        for stage in stages
        if (one := _judged(drive, before, stage, moments, _spans(parts, number), number, horizon))
    ]
    if not judged:
        msg = f"{drives[0].recording.path}: no window of {horizon:g} s without a gap in the poses"
        raise RecordingError(msg)
    fit, choose, confirm = (_part(judged, name) for name in NAMES)
    errors = Fit(horizon_s=horizon, fit=fit, choose=choose, confirm=confirm)
    return errors, _free_runs(judged, on_one_axis(drives), horizon)


def drives_alike(fit: Fit) -> bool:
    """Return whether two cars drive alike on parts that no fit has seen."""
    part = fit.confirm
    return all(
        math.isclose(part.before[name], part.after[name], rel_tol=1e-3)
        for name in ACCURACY
        if name in part.before
    )


def driven_in(runs: FreeRuns) -> dict[str, float]:
    """Return how far the car drives and turns in a window, root mean squares [m], [rad]."""
    x, y, yaw = (np.diff(runs.measured[name], axis=1) for name in ("x", "y", "yaw"))
    way, turn = np.hypot(x, y).sum(axis=1), _wrapped(yaw).sum(axis=1)
    return {
        name: float(np.sqrt(np.nanmean(np.square(each))))
        for name, each in (("position_m", way), ("yaw_rad", turn))
    }


def stated_by(car: Car, runs: FreeRuns) -> dict[str, float] | None:
    """Return the errors of a car as accurate as its file states; None where it states nothing."""
    driven = driven_in(runs)
    found = {name: car.value(key) * driven[name] for name, key in ACCURACY.items() if car.has(key)}
    return found or None


def strays(fit: Fit, runs: FreeRuns) -> bool:
    """Return whether a car strays by more than can be expected on parts that no fit has seen.

    To be expected is what noise makes, what two simulators of the same car differ by, and what the
    given car's file states of its accuracy.
    """
    part, driven, stated = fit.confirm, driven_in(runs), fit.stated or {}
    for name in ACCURACY.keys() & part.after.keys():
        alike = math.hypot(part.noise_floor[name], ALIKE * driven[name])
        limit = max(MAX_NOISE_RATIO * alike, LIKE_STATED * stated.get(name, 0.0))
        if part.after[name] > limit:
            return True
    return False


def with_accuracy(car: Car, fit: Fit, runs: FreeRuns) -> Car:
    """Return a car whose numbers were found with its accuracy on parts that no fit has seen."""
    driven, values = driven_in(runs), dict(car.values)
    for name, key in ACCURACY.items():
        share = fit.confirm.after[name] / driven[name] if driven[name] > 0.0 else math.inf
        if share <= FILE_KEYS[key].bounds[1]:
            values[key] = Quantity(share, None, FILE_KEYS[key].unit, "free runs")
    return replace(car, values=values)


def nothing_got_worse(fit: Fit) -> tuple[str, ...]:
    """Return the channels that got worse by more than 2 % on the part that only confirms.

    What noise of measuring alone changes between two equal cars does not count.
    """
    part = fit.confirm
    return tuple(name for name, was in part.before.items() if got_worse(part, name, was))


def got_worse(part: PartErrors, name: str, was: float, by: float = WORSE) -> bool:
    """Return whether an error after is larger than another, beyond what noise may change.

    Args:
        part: With the error after.
        name: Of the error.
        was: The other error.
        by: How many times larger it must be.
    """
    now, floor = part.after[name], part.noise_floor.get(name, 0.0)
    return now > by * was and now**2 - was**2 > chance_of(part) * floor**2


def chance_of(part: PartErrors) -> float:
    """Return two standard deviations of a mean square over windows, as a share of it."""
    return 2.0 * math.sqrt(2.0 / max(part.windows, 1))


def _spans(parts: Parts, drive: int) -> list[tuple[str, Span]]:
    """Return the blocks of one drive with their parts, in time's order."""
    found = [(name, span) for name in NAMES for span in getattr(parts, name).spans[drive]]
    return sorted(found, key=lambda one: one[1])


def _judged(
    drive: Drive, before: Car, stage: Stage, moments: Floats, spans: Sequence[tuple[str, Span]],
    number: int, horizon: float,
) -> _Judged | None:  # fmt: skip
    replays = [Replay(drive.recording, car) for car in (before, stage.car)]
    starts, part = _starts(drive, replays, spans, horizon)
    middle = starts + 0.5 * horizon
    whole = (np.abs(np.subtract.outer(middle, moments)) >= 0.5 * horizon).all(axis=1)
    mine = np.flatnonzero(whole & (middle >= stage.from_s) & (middle < stage.until_s))
    starts, part = starts[mine], tuple(part[i] for i in mine)
    if not len(starts):
        return None
    noisy = [Camera(replays[_AFTER].drive, {}, poses) for poses in _draws(replays[_AFTER].drive)]
    t_s = np.append(np.arange(0.0, horizon - 0.5 * SAVE_EVERY_S, SAVE_EVERY_S), horizon)
    sides = [
        _driven(replay, starts, t_s, cameras)
        for replay, cameras in zip(replays, ((), noisy), strict=True)
    ]
    fine: Bools = np.asarray(np.all([side.ok for side in sides], axis=0))
    apart = {name: [side.apart[name] for side in sides] for name in ("x", "y", "yaw")}
    errors = {
        "position_m": np.stack([
            np.hypot(x[0, :, -1], y[0, :, -1])
            for x, y in zip(apart["x"], apart["y"], strict=True)
        ])[..., None],
        "yaw_rad": np.stack([_wrapped(yaw[0, :, -1]) for yaw in apart["yaw"]])[..., None],
    }  # fmt: skip
    noise = {name: sides[_AFTER].apart[name][1:, :, -1] - apart[name][_AFTER][0, :, -1]
             for name in apart}  # fmt: skip
    floor = {
        "position_m": np.hypot(noise["x"], noise["y"])[..., None],
        "yaw_rad": _wrapped(noise["yaw"])[..., None],
    }
    for (name, was, _), (_, now, chance) in zip(*(side.sensors for side in sides), strict=True):
        _join(errors, name, np.stack([was[0], now[0]]))
        _join(floor, name, np.sqrt((now[1:] - now[0]) ** 2 + chance))
    measured = sides[_BEFORE].measured
    shown = {
        name: np.stack([measured[name], *(measured[name] + one[0] for one in apart[name])])
        for name in measured
    }
    return _Judged(
        number,
        stage.file,
        starts[fine],
        tuple(name for name, ok in zip(part, fine, strict=True) if ok),
        {name: error[:, fine] for name, error in errors.items()},
        {name: error[:, fine] for name, error in floor.items()},
        {name: values[:, fine] for name, values in shown.items()},
    )


@dataclass(frozen=True, slots=True)
class _Driven:
    """What one car did in all windows, its own side first and then those of noisy starts.

    Attributes:
        ok: Whether all stayed within physical bounds, (windows,).
        apart: Simulated minus measured x, y [m] and yaw [rad], each (sides, windows, times).
        measured: What was measured, each (windows, times).
        sensors: Name, error at a window's end, (sides, windows), and its own variance of the other
            sensors.
    """

    ok: Bools
    apart: Mapping[str, Floats]
    measured: Mapping[str, Floats]
    sensors: Sequence[tuple[str, Floats, float]]


def _driven(replay: Replay, starts: Floats, t_s: Floats, cameras: Sequence[Camera]) -> _Driven:
    """Drive one car through all windows, from the measured motion and from noisy ones."""
    runs, begun, _ = replay.run(starts, float(t_s[-1]), cameras)
    at = replay.true_times((starts[:, None] + t_s).ravel()).reshape(len(starts), -1)
    edges = replay.drive.edges[begun[0]]
    seen = [camera.motion(at.ravel()) for camera in (replay.camera, *cameras)]
    variables = {"x": runs["x"], "y": runs["y"], "yaw": np.unwrap(runs["yaw"], axis=0)}
    apart, sides = dict[str, Floats](), len(seen)
    for name, variable in variables.items():
        driven = np.stack(
            [at_times(variable, np.tile(t - edges, (sides, 1))) for t in at.T], axis=2
        )
        real = np.stack([getattr(moved, name).reshape(at.shape) for moved in seen])
        apart[name] = driven - real
    measured = {name: getattr(seen[0], name).reshape(at.shape) for name in variables}
    since = (np.tile(at[:, 0] - edges, (sides, 1)), np.tile(at[:, -1] - edges, (sides, 1)))
    ok: Bools = np.asarray(runs.ok.all(axis=0), dtype=np.bool_)
    return _Driven(ok, apart, measured, list(sensor_errors(replay.drive, runs, begun, since)))


def _draws(drive: Drive) -> Iterator[dict[str, Smooth]]:
    """Yield smoothed poses as they would be with noise once more."""
    rng = np.random.default_rng(len(drive.edges))
    for _ in range(DRAWS):
        yield {
            name: smooth(s.t, s.value + stream.drawn(s.t, rng), stream.slow_std)
            for name, s in drive.smoothed.items()
            for stream in (drive.stream(name),)
        }


def _starts(
    drive: Drive, replays: Sequence[Replay], spans: Sequence[tuple[str, Span]], horizon: float
) -> tuple[Floats, tuple[str, ...]]:
    """Return when windows start, by the poses' stamps, and the part of each.

    They lie within one block and have no gap in the poses.
    """
    poses = Poses(drive.recording)
    found, part = list[float](), list[str]()
    for name, (begin, end) in spans:
        room = end - begin - horizon
        if room < -1e-6:
            continue
        count = 1 + int(room / min(0.5 * horizon, NEXT_S) + 0.1)
        for start in np.linspace(begin, begin + max(room, 0.0), count):
            inside = all(replay.holds(start, start + horizon) for replay in replays)
            if inside and poses.unbroken(start, start + horizon):
                found.append(round(float(start), START_DIGITS))
                part.append(name)
    return np.array(found), tuple(part)


def _wrapped(angle: Floats) -> Floats:
    """Return angles in (-pi, pi]."""
    return np.arctan2(np.sin(angle), np.cos(angle))


def _join(errors: dict[str, Floats], name: str, more: Floats) -> None:
    """Add one stream's errors, (sides, windows), to its channel's."""
    more = more[..., None]
    errors[name] = np.concatenate((errors[name], more), axis=2) if name in errors else more


def _part(judged: Sequence[_Judged], part: str) -> PartErrors:
    """Return the errors of all drives' windows of one part."""
    mine = [np.array([p == part for p in one.part], dtype=np.bool_) for one in judged]

    def rms(of: Sequence[Mapping[str, Floats]], side: int | slice) -> dict[str, float]:
        names = dict.fromkeys(name for one in of for name in one)
        found = dict[str, float]()
        for name in names:
            values = [one[name][side][..., keep, :].ravel()
                      for one, keep in zip(of, mine, strict=True) if name in one]  # fmt: skip
            together = np.concatenate(values)
            if len(together):
                found[name] = float(np.sqrt(np.mean(np.square(together))))
        return found

    errors = [one.errors for one in judged]
    return PartErrors(
        windows=int(sum(keep.sum() for keep in mine)),
        before=rms(errors, _BEFORE),
        after=rms(errors, _AFTER),
        noise_floor=rms([one.floor for one in judged], slice(None)),
    )


def _free_runs(judged: Sequence[_Judged], moves: Sequence[float], horizon: float) -> FreeRuns:
    sides = [
        {name: np.concatenate([one.shown[name][i] for one in judged]) for name in ("x", "y", "yaw")}
        for i in range(3)
    ]
    times = sides[0]["x"].shape[1]
    t_s = np.append(SAVE_EVERY_S * np.arange(times - 1), horizon)
    return FreeRuns(
        part=tuple(name for one in judged for name in one.part),
        recording=np.concatenate([np.full(len(one.start_s), one.number) for one in judged]),
        stamp_s=np.concatenate([one.start_s for one in judged]),
        start_s=np.concatenate([one.start_s + moves[one.number] for one in judged]),
        t_s=t_s, measured=sides[0], before=sides[1], after=sides[2],
        file=tuple(one.file for one in judged for _ in one.part),
    )  # fmt: skip
