"""Free runs of the car as given and of the car as found, against the recording.

A window starts in the smoothed measured motion and then gets nothing but the recorded commands.
Errors are those at its end, root mean squares over windows of one part of the recordings.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.data_quality.problem import Span
from scm.errors import RecordingError
from scm.mismatch.evidence import FreeRuns
from scm.mismatch.findings import Fit, PartErrors
from scm.mismatch.laws.sensed import put_right
from scm.mismatch.leftover import on_one_axis
from scm.mismatch.parts import NAMES, Parts
from scm.mismatch.window_errors import poses_of, sensor_errors, turned
from scm.recording.motion import Poses
from scm.replay.camera import Camera
from scm.replay.drive import STEP_S, Drive
from scm.replay.numbers import Numbers
from scm.replay.smooth import Smooth, smooth
from scm.replay.windows import Runs, Side, Windows
from scm.vehicles.car import Car

FAST_MPS, FAST_HORIZON_S, SLOW_HORIZON_S = 1.0, 1.0, 3.0
SHORTEST_S = 0.2
NEXT_S = 1.0  # between the starts of windows at most
SHOWN_EVERY_S = 0.05
DRAWS = 2
WORSE = 1.02
_BEFORE, _AFTER = 0, 1


@dataclass(frozen=True, slots=True)
class _Judged:
    """One drive's windows: errors by channel, each (sides, windows, values), and what is drawn.

    Attributes:
        start_s: (windows,), by the poses' stamps; `part`: of each.
        floor: What noise alone makes of each error, (draws, windows, values).
        shown: Poses recorded, before and after, (3, windows, times).
    """

    start_s: Floats
    part: tuple[str, ...]
    errors: Mapping[str, Floats]
    floor: Mapping[str, Floats]
    shown: Mapping[str, Floats]


def horizon_of(drives: Sequence[Drive], parts: Parts) -> float:
    """Return how long windows should be: 1 s for a fast car, 3 s for a slow one, or a block."""
    speeds = [np.hypot(d.smoothed["pose.x"].rate, d.smoothed["pose.y"].rate) for d in drives]
    fast = float(np.percentile(np.concatenate(speeds), 90)) > FAST_MPS
    blocks = [b - a for name in NAMES for spans in getattr(parts, name).spans for a, b in spans]
    longest = 0.9 * min(blocks, default=SLOW_HORIZON_S)
    return round(min(FAST_HORIZON_S if fast else SLOW_HORIZON_S, longest), 2)


def judge(
    drives: Sequence[Drive],
    car: Car,
    before: Numbers,
    after: Numbers,
    parts: Parts,
    horizon_s: float | None = None,
) -> tuple[Fit, FreeRuns]:
    """Return how well two cars follow the recordings on each part, and their free runs.

    Args:
        drives: The recordings.
        car: With every effect at its neutral numbers.
        before: Numbers of the car as given, by key.
        after: Numbers of the car as found; its faults of measurement act on what is predicted.
        parts: Of the recordings.
        horizon_s: Length of a window; None chooses it.

    Raises:
        RecordingError: when no recording holds a whole window.
    """
    horizon = horizon_of(drives, parts) if horizon_s is None else horizon_s
    horizon = max(round(horizon / STEP_S) * STEP_S, SHORTEST_S)
    judged = [
        replace(one, start_s=one.start_s + move)
        for number, (drive, move) in enumerate(zip(drives, on_one_axis(drives), strict=True))
        if (one := _judged(drive, car, (before, after), _spans(parts, number), horizon))
    ]
    if not judged:
        msg = f"{drives[0].recording.path}: no window of {horizon:g} s without a gap in the poses"
        raise RecordingError(msg)
    every = {name: _part(judged, name) for name in NAMES}
    return Fit(horizon_s=horizon, **every), _free_runs(judged, horizon)


def nothing_got_worse(fit: Fit) -> tuple[str, ...]:
    """Return the channels that got worse by more than 2 % on the part that only confirms.

    What noise of measuring alone changes between two equal cars does not count.
    """
    part = fit.confirm
    chance = 2.0 * np.sqrt(2.0 / max(part.windows, 1))
    return tuple(
        name
        for name, was in part.before.items()
        if part.after[name] > WORSE * was
        and part.after[name] ** 2 - was**2 > chance * part.noise_floor.get(name, 0.0) ** 2
    )


def _spans(parts: Parts, drive: int) -> list[tuple[str, Span]]:
    """Return the blocks of one drive with their parts, in time's order."""
    found = [(name, span) for name in NAMES for span in getattr(parts, name).spans[drive]]
    return sorted(found, key=lambda one: one[1])


def _judged(
    drive: Drive, car: Car, numbers: tuple[Numbers, Numbers], spans: Sequence[tuple[str, Span]],
    horizon: float,
) -> _Judged | None:  # fmt: skip
    right = put_right(drive, numbers[_AFTER]) or drive.smoothed
    seen = (drive.smoothed, right)
    sides = [Side(n, Camera(drive, n, poses)) for n, poses in zip(numbers, seen, strict=True)]
    cameras = [Camera(drive, numbers[_AFTER], noisy) for noisy in _draws(drive, right)]
    sides += [Side(numbers[_AFTER], camera, like=_AFTER) for camera in cameras]
    stamps, part = _starts(drive, sides, spans, horizon)
    if not len(stamps):
        return None
    first, last = (
        np.stack([side.camera.taken(at) for side in sides]) for at in (stamps, stamps + horizon)
    )
    starts: Ints = np.floor((first - drive.edges[0]) / STEP_S).astype(np.int64)
    steps = round(horizon / STEP_S) + 2
    runs = Windows(drive, car).run(sides, starts, steps)
    fine: Bools = np.asarray(runs.ok.all(axis=0))
    since = first - drive.edges[starts], last - drive.edges[starts]
    errors, floor = _pose_errors(sides, runs, since[1], stamps + horizon)
    for name, miss, noise in sensor_errors(drive, sides, runs, starts, since):
        _join(errors, name, miss[: _AFTER + 1])
        _join(floor, name, np.sqrt((miss[_AFTER + 1 :] - miss[_AFTER]) ** 2 + noise))
    shown = _shown(sides, runs, stamps, drive.edges[starts], horizon)
    return _Judged(
        stamps[fine],
        tuple(name for name, ok in zip(part, fine, strict=True) if ok),
        {name: error[:, fine] for name, error in errors.items()},
        {name: error[:, fine] for name, error in floor.items()},
        {name: values[..., fine, :] for name, values in shown.items()},
    )


def _draws(drive: Drive, poses: Mapping[str, Smooth]) -> Iterator[dict[str, Smooth]]:
    """Yield smoothed poses as they would be with noise once more."""
    rng = np.random.default_rng(len(drive.edges))
    for _ in range(DRAWS):
        yield {
            name: smooth(s.t, s.value + std * rng.standard_normal(len(s.t)), std)
            for name, s in poses.items()
            for std in (drive.stream(name).std,)
        }


def _starts(
    drive: Drive, sides: Sequence[Side], spans: Sequence[tuple[str, Span]], horizon: float
) -> tuple[Floats, tuple[str, ...]]:
    """Return when windows start, by the poses' stamps, and the part of each.

    They lie within one block and have no gap in the poses.
    """
    poses, edges = Poses(drive.recording), drive.edges
    found, part = list[float](), list[str]()
    for name, (begin, end) in spans:
        room = end - begin - horizon
        if room < -1e-6:
            continue
        count = 1 + int(room / min(0.5 * horizon, NEXT_S) + 0.1)
        for start in np.linspace(begin, begin + max(room, 0.0), count):
            ends = np.array([start, start + horizon + 2.0 * STEP_S])
            taken = np.stack([side.camera.taken(ends) for side in sides])
            inside = taken.min() >= edges[0] and taken.max() <= edges[-1] - STEP_S
            if inside and poses.unbroken(start, start + horizon):
                found.append(float(start))
                part.append(name)
    return np.array(found), tuple(part)


def _pose_errors(
    sides: Sequence[Side], runs: Runs, since: Floats, stamps: Floats
) -> tuple[dict[str, Floats], dict[str, Floats]]:
    """Return pose errors of both cars at the windows' ends, and those of noise alone."""
    x, y, psi = poses_of(sides, runs, since)
    recorded = [np.stack(each) for each in zip(
        *(side.camera.recorded(stamps) for side in sides), strict=True)]  # fmt: skip
    dx, dy, turn = x - recorded[0], y - recorded[1], turned(psi - recorded[2])
    both, draws = slice(0, _AFTER + 1), slice(_AFTER + 1, None)
    far = np.hypot(dx, dy)
    noise = np.hypot(dx[draws] - dx[_AFTER], dy[draws] - dy[_AFTER])
    return (
        {"position_m": far[both, :, None], "yaw_rad": turn[both, :, None]},
        {"position_m": noise[..., None], "yaw_rad": turned(turn[draws] - turn[_AFTER])[..., None]},
    )


def _join(errors: dict[str, Floats], name: str, more: Floats) -> None:
    """Add one stream's errors, (sides, windows), to its channel's."""
    more = more[..., None]
    errors[name] = np.concatenate((errors[name], more), axis=2) if name in errors else more


def _shown(
    sides: Sequence[Side], runs: Runs, stamps: Floats, edges: Floats, horizon: float
) -> dict[str, Floats]:
    """Return poses recorded, before and after along the windows, (3, windows, times)."""
    both = sides[: _AFTER + 1]
    times = np.append(np.arange(0.0, horizon - 0.5 * SHOWN_EVERY_S, SHOWN_EVERY_S), horizon)
    out = {name: np.empty((3, len(stamps), len(times))) for name in ("x", "y", "yaw")}
    part = replace(runs, signals={n: runs[n][:, : _AFTER + 1] for n in ("x", "y", "yaw")})
    for k, t in enumerate(times):
        since = np.stack([
            side.camera.taken(stamps + t) - edges[i] for i, side in enumerate(both)
        ])  # fmt: skip
        found = poses_of(both, part, since)
        recorded = both[0].camera.recorded(stamps + t)
        for name, sim, real in zip(("x", "y", "yaw"), found, recorded, strict=True):
            out[name][0, :, k], out[name][1:, :, k] = real, sim
    return out


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


def _free_runs(judged: Sequence[_Judged], horizon: float) -> FreeRuns:
    sides = [
        {name: np.concatenate([one.shown[name][i] for one in judged]) for name in ("x", "y", "yaw")}
        for i in range(3)
    ]
    times = sides[0]["x"].shape[1]
    t_s = np.append(SHOWN_EVERY_S * np.arange(times - 1), horizon)
    return FreeRuns(
        part=tuple(name for one in judged for name in one.part),
        start_s=np.concatenate([one.start_s for one in judged]),
        t_s=t_s, measured=sides[0], before=sides[1], after=sides[2],
    )  # fmt: skip
