"""Simulates a recording again: free runs from the measured state, and their error.

A window starts in the smoothed measured motion and then only receives the recorded commands. All
windows run side by side as rows of one fleet. The rest of the car's state at the start, such as the
servo's angle or the motor's temperature, comes from simulating the same car up to there. Faults of
the poses that the car file states, such as a tilted camera, are first removed from the recording.
Reports of `scm mismatch` are judged by the same windows.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np

from scm.arrays import Floats, Ints
from scm.errors import RecordingError
from scm.recording.motion import Poses
from scm.recording.read import Recording
from scm.replay.camera import Camera
from scm.replay.commands import Commands
from scm.replay.drive import STEP_S, Drive
from scm.replay.windows import Runs, Side, Windows, at_times
from scm.vehicles.car import Car
from scm.vehicles.drive_channel import COMMANDED_SPEEDS, drive_name
from scm.vehicles.sensor_correction import without_faults

HORIZONS_S = (0.5, 1.0, 3.0)
SHORTEST_HORIZON_S = 0.05
SAVE_EVERY_S = 0.05
TINY_S = 1e-6
FEWEST_POSES = 4  # of which a smoothed motion can be made
NEEDED = ("command.steering", "pose.x", "pose.y", "pose.yaw")
GAP, DIVERGED = "a gap or a jump in the poses", "the simulated car left physical bounds"


@dataclass(frozen=True, slots=True)
class FreeRun:
    """Simulated and measured rear-axle motion of all windows, arrays of shape `(windows, times)`.

    Attributes:
        start_s: When each window starts on the recording's clock, shape `(windows,)`.
        t_s: Time since the window's start, shape `(times,)`.
        x, y, yaw, speed: Simulated.
        x_measured, y_measured, yaw_measured, speed_measured: From the recording, smoothed, without
            the faults of measurement in the car file.
        left_out: How many windows are not here, by reason.
    """

    start_s: Floats
    t_s: Floats
    x: Floats
    y: Floats
    yaw: Floats
    speed: Floats
    x_measured: Floats
    y_measured: Floats
    yaw_measured: Floats
    speed_measured: Floats
    left_out: Mapping[str, int]

    def position_error(self) -> Floats:
        """Return the distance between simulated and measured position [m]."""
        return np.hypot(self.x - self.x_measured, self.y - self.y_measured)

    def yaw_error(self) -> Floats:
        """Return the absolute difference in yaw [rad]."""
        return np.abs(
            np.arctan2(np.sin(self.yaw - self.yaw_measured), np.cos(self.yaw - self.yaw_measured))
        )

    def speed_error(self) -> Floats:
        """Return the absolute difference in speed [m/s]."""
        return np.abs(self.speed - self.speed_measured)


def _refuse_incomplete(recording: Recording, car: Car) -> None:
    """Say in one sentence which channels a replay lacks."""
    needed = (drive_name(recording, car), *NEEDED)
    missing = [name for name in needed if name not in recording.channels]
    if missing:
        given = next((name for name in COMMANDED_SPEEDS if name in recording.channels), "")
        speed = missing[0] == "command.throttle" and given
        hint = f"; {car.name} has no speed_control, so {given} cannot drive it"
        msg = f"{recording.path}: a replay needs {', '.join(needed)}; missing: {', '.join(missing)}"
        raise RecordingError(msg + (hint if speed else ""))


class Replay:
    """One recording as one car file explains it, to be driven again in windows.

    Attributes:
        drive: The recording on the simulation's grid, without the faults that the car file states.
    """

    def __init__(self, recording: Recording, car: Car) -> None:
        _refuse_incomplete(recording, car)
        self.recording, self.car = recording, car
        right = without_faults(recording, car.faults)
        _refuse_apart(right, car)
        self.drive = Drive(right, car)
        self.camera = Camera(self.drive, {})
        self._stamps = recording.channel("pose.x").t
        self._true_span = right.channel("pose.x").t
        self._windows = Windows(self.drive, car)

    def true_times(self, stamps: Floats) -> Floats:
        """Return when poses of these stamps were taken, on the commands' clock [s]."""
        if np.array_equal(self._stamps, self._true_span):
            return stamps
        late = np.interp(stamps, self._stamps, self._stamps - self._true_span)
        return np.asarray(stamps - late)

    def stamp(self, true_s: float) -> float:
        """Return the stamp of a pose taken at a time on the commands' clock [s]."""
        return float(np.interp(true_s, self._true_span, self._stamps))

    def holds(self, first: Floats, last: Floats) -> bool:
        """Return whether poses and commands cover the time between two stamps."""
        edges = self.drive.edges
        begin, end = float(self.true_times(first).min()), float(self.true_times(last).max())
        return bool(begin >= edges[0] - TINY_S and end <= edges[-1] + STEP_S)

    def run(
        self, starts_s: Floats, horizon_s: float, cameras: Sequence[Camera] = ()
    ) -> tuple[Runs, Ints, Floats]:
        """Drive windows again.

        Args:
            starts_s: Stamps at which they start, (windows,), rising.
            horizon_s: Length of a window.
            cameras: Other views of the measured motion to start from, each a side beside the first.

        Returns:
            What the sides did, the edges at which their windows began, (sides, windows), and each
            window's start since its edge, (windows,).
        """
        true_times = self.true_times(starts_s)
        begun = np.floor((true_times - self.drive.edges[0]) / STEP_S + TINY_S).astype(np.int64)
        begun = np.clip(begun, 0, len(self.drive.edges) - 1)
        sides = [Side({}, self.camera), *(Side({}, camera, like=0) for camera in cameras)]
        starts: Ints = np.tile(begun, (len(sides), 1))
        steps = int(np.ceil(horizon_s / STEP_S - TINY_S)) + 1
        return self._windows.run(sides, starts, steps), starts, true_times - self.drive.edges[begun]


def _refuse_apart(recording: Recording, car: Car) -> None:
    """Refuse poses and commands that share too little time to be driven again."""
    poses, commands = Poses(recording), Commands(recording, car).span_s
    together = min(float(poses.t[-1]), commands[1]) - max(float(poses.t[0]), commands[0])
    if len(poses.t) < FEWEST_POSES or together < SHORTEST_HORIZON_S:
        raise RecordingError(_too_short(recording, poses, commands, "nothing to drive again"))


def _too_short(recording: Recording, poses: Poses, commands: tuple[float, float], why: str) -> str:
    return (
        f"{recording.path}: {why}: poses from {poses.t[0]:.3f} s to {poses.t[-1]:.3f} s, "
        f"commands from {commands[0]:.3f} s to {commands[1]:.3f} s"
    )


def free_run(
    recording: Recording,
    car: Car,
    horizon_s: float = 3.0,
    save_every_s: float = SAVE_EVERY_S,
    starts_s: Floats | None = None,
) -> FreeRun:
    """Simulate windows of `horizon_s`: every whole one that the recording holds, or those given.

    Args:
        recording: Screened, and without long gaps.
        car: To be held against it.
        horizon_s: Length of a window.
        save_every_s: Between the times that are returned.
        starts_s: Stamps at which windows start, (windows,); None: end to end.

    Raises:
        RecordingError: when a needed channel is missing or no window is whole.
    """
    if not SHORTEST_HORIZON_S <= horizon_s < np.inf:
        msg = f"horizon: got {horizon_s:g} s, expected {SHORTEST_HORIZON_S:g} s or more"
        raise RecordingError(msg)
    replay = Replay(recording, car)
    starts, left_out = _whole_windows(replay, horizon_s) if starts_s is None else (starts_s, {})
    runs, begun, _ = replay.run(starts, horizon_s)
    ok = runs.ok[0]
    if not ok.all():
        left_out = {**left_out, DIVERGED: int((~ok).sum())}
    t_s: Floats = np.append(np.arange(0.0, horizon_s - 0.5 * STEP_S, save_every_s), horizon_s)
    at = replay.true_times((starts[:, None] + t_s).ravel()).reshape(len(starts), -1)
    after = at - replay.drive.edges[begun[0]][:, None]
    yaw = np.unwrap(runs["yaw"], axis=0)
    x, y, psi, speed = (
        np.stack([at_times(variable, after[None, :, k])[0] for k in range(len(t_s))], axis=1)[ok]
        for variable in (runs["x"], runs["y"], yaw, runs["speed"])
    )
    measured = replay.camera.motion(at[ok].ravel())
    return FreeRun(
        start_s=starts[ok],
        t_s=t_s,
        x=x,
        y=y,
        yaw=psi,
        speed=speed,
        x_measured=measured.x.reshape(x.shape),
        y_measured=measured.y.reshape(x.shape),
        yaw_measured=measured.yaw.reshape(x.shape),
        speed_measured=measured.speed.reshape(x.shape),
        left_out=left_out,
    )


def joined(runs: Sequence[FreeRun]) -> FreeRun:
    """Return the windows of several stretches as one run."""
    names = [field.name for field in fields(FreeRun) if field.name not in ("t_s", "left_out")]
    together = {name: np.concatenate([getattr(run, name) for run in runs]) for name in names}
    left_out = Counter[str]()
    for run in runs:
        left_out.update(run.left_out)
    return FreeRun(t_s=runs[0].t_s, left_out=dict(left_out), **together)


def _whole_windows(replay: Replay, horizon_s: float) -> tuple[Floats, dict[str, int]]:
    """Return the stamps at which whole windows start, end to end, and how many are left out."""
    recording = replay.recording
    poses = Poses(recording)
    commands = Commands(recording, replay.car).span_s
    seen = replay.true_times(poses.t[[0, -1]])
    first = max(float(seen[0]), commands[0])
    span = min(float(seen[1]), commands[1]) - first
    if span < horizon_s - TINY_S:
        raise RecordingError(
            _too_short(recording, poses, commands, f"no window of {horizon_s:g} s")
        )
    begin_s = replay.stamp(first)
    count = int((span + TINY_S) / horizon_s)
    every: Floats = begin_s + horizon_s * np.arange(count, dtype=np.float64)
    whole = [poses.unbroken(t, t + horizon_s - TINY_S) for t in every]
    if not any(whole):
        msg = f"{recording.path}: no window of {horizon_s:g} s without a gap in the poses"
        raise RecordingError(msg)
    broken = len(every) - sum(whole)
    return every[np.array(whole)], {GAP: broken} if broken else {}


def error_table(
    run: FreeRun, horizons_s: tuple[float, ...] = HORIZONS_S
) -> list[tuple[str, Floats]]:
    """Return, for each error, its median and 90th percentile at each horizon.

    Returns:
        (label, array of shape `(horizons, 2)`), each at the saved time nearest to the horizon.
    """
    columns = [int(np.argmin(np.abs(run.t_s - h))) for h in horizons_s]
    rows = (
        ("position [m]", run.position_error()),
        ("yaw [rad]", run.yaw_error()),
        ("speed [m/s]", run.speed_error()),
    )
    return [
        (label, np.array([_percentiles(error[:, k]) for k in columns])) for label, error in rows
    ]


def _percentiles(errors: Floats) -> Floats:
    """Return median and 90th percentile of what is known; NaN when nothing is."""
    known = errors[np.isfinite(errors)]
    return np.percentile(known, (50, 90)) if len(known) else np.full(2, np.nan)
