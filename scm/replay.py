"""Drive a recording again: free runs of the simulator from the measured state, and their error.

Every window starts from the measured pose and velocities and then gets nothing but the recorded
commands. All windows run side by side as rows of one fleet. Before a window starts, its commands of
the last second run the actuators in, so that servo and lags begin where they were.
"""

from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats
from scm.errors import RecordingError
from scm.geometry import Pose2
from scm.recording.motion import Motion, Poses
from scm.recording.read import Channel, Recording
from scm.vehicles.car import Car
from scm.vehicles.fleet import Fleet

STEP_S = 0.005
RUN_IN_S = 1.0
HORIZONS_S = (0.5, 1.0, 3.0)


@dataclass(frozen=True, slots=True)
class FreeRun:
    """Simulated and measured rear-axle motion of all windows, arrays of shape `(windows, times)`.

    Attributes:
        start_s: When each window starts on the recording's clock, shape `(windows,)`.
        t_s: Time since the window's start, shape `(times,)`.
        x, y, yaw, speed: Simulated.
        x_measured, y_measured, yaw_measured, speed_measured: From the recording; NaN in a gap.
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


class Commands:
    """Recorded throttle and steering, held between their rows, as the car's commands in [-1, 1]."""

    def __init__(self, recording: Recording, car: Car) -> None:
        self._throttle = recording.channel("command.throttle")
        self._steering = recording.channel("command.steering")
        angles = self._steering.dimension == "angle"
        self._per_unit = 1.0 / car.value("steering.limit_rad") if angles else 1.0

    def at(self, t: Floats) -> tuple[Floats, Floats]:
        """Return throttle and steering at times `t`; before the first row they are zero."""
        return _held(self._throttle, t), _held(self._steering, t) * self._per_unit

    @property
    def span_s(self) -> tuple[float, float]:
        """First and last time at which both commands are known."""
        first = max(self._throttle.t[0], self._steering.t[0])
        return float(first), float(min(self._throttle.t[-1], self._steering.t[-1]))


def _held(channel: Channel, t: Floats) -> Floats:
    """Return the value of the last row at or before each time; zero before the first."""
    row = np.searchsorted(channel.t, t, side="right") - 1
    return np.where(row >= 0, channel.values[np.maximum(row, 0)], 0.0)


def free_run(
    recording: Recording, car: Car, horizon_s: float = 3.0, save_every_s: float = 0.05
) -> FreeRun:
    """Simulate every whole window of `horizon_s` that the recording holds.

    Raises:
        RecordingError: when a needed channel is missing or no window is whole.
    """
    poses, commands = Poses(recording), Commands(recording, car)
    starts, initial = _windows(recording, poses, commands, horizon_s)
    fleet = Fleet(car, len(starts))
    _run_in(fleet, commands, starts, initial)
    every = round(save_every_s / STEP_S)
    t_s: Floats = np.arange(round(horizon_s / save_every_s) + 1, dtype=np.float64) * save_every_s
    x, y, yaw, speed = (np.empty((len(starts), len(t_s))) for _ in range(4))
    for k, t in enumerate(t_s):
        x[:, k], y[:, k], yaw[:, k], speed[:, k] = fleet.x, fleet.y, fleet.yaw, fleet.speed
        if k < len(t_s) - 1:
            _advance(fleet, commands, starts + t, every)
    measured = poses.motion((starts[:, None] + t_s).ravel())
    return FreeRun(
        start_s=starts,
        t_s=t_s,
        x=x,
        y=y,
        yaw=yaw,
        speed=speed,
        x_measured=measured.x.reshape(x.shape),
        y_measured=measured.y.reshape(x.shape),
        yaw_measured=measured.yaw.reshape(x.shape),
        speed_measured=measured.speed.reshape(x.shape),
    )


def _windows(
    recording: Recording, poses: Poses, commands: Commands, horizon_s: float
) -> tuple[Floats, Motion]:
    """Return the starts of whole windows, end to end, and the measured motion there."""
    first = max(poses.t[0], commands.span_s[0])
    last = min(poses.t[-1], commands.span_s[1]) - horizon_s
    starts = np.array(
        [t for t in np.arange(first, last, horizon_s) if poses.unbroken(t, t + horizon_s)]
    )
    initial = poses.motion(starts)
    if not initial.valid.any():
        msg = f"{recording.path}: no window of {horizon_s} s without a gap in the poses"
        raise RecordingError(msg)
    keep = initial.valid
    return starts[keep], poses.motion(starts[keep])


def _run_in(fleet: Fleet, commands: Commands, starts: Floats, initial: Motion) -> None:
    """Put a car at the start of every window, its actuators where the commands before left them."""
    poses = [Pose2(*at) for at in zip(initial.x, initial.y, initial.yaw, strict=True)]
    for pose, speed in zip(poses, initial.speed, strict=True):
        fleet.add(pose, float(speed))
    _advance(fleet, commands, starts - RUN_IN_S, round(RUN_IN_S / STEP_S))
    for row, pose in enumerate(poses):
        fleet.place(
            row,
            pose,
            float(initial.speed[row]),
            float(initial.lateral_speed[row]),
            float(initial.yaw_rate[row]),
            keep_actuators=True,
        )


def _advance(fleet: Fleet, commands: Commands, t: Floats, steps: int) -> None:
    """Advance every window by `steps` from its own time `t`, shape `(windows,)`."""
    n = len(t)
    for k in range(steps):
        throttle, steering = commands.at(t + k * STEP_S)
        fleet.throttle[:n] = throttle
        fleet.steering[:n] = steering
        fleet.advance(STEP_S)


def error_table(
    run: FreeRun, horizons_s: tuple[float, ...] = HORIZONS_S
) -> list[tuple[str, Floats]]:
    """Return, for each error, its median and 90th percentile at each horizon.

    Returns:
        (label, array of shape `(horizons, 2)`); horizons beyond the run are left out by the caller.
    """
    columns = [int(np.argmin(np.abs(run.t_s - h))) for h in horizons_s]
    rows = (
        ("position [m]", run.position_error()),
        ("yaw [rad]", run.yaw_error()),
        ("speed [m/s]", run.speed_error()),
    )
    return [
        (label, np.array([np.nanpercentile(error[:, k], (50, 90)) for k in columns]))
        for label, error in rows
    ]
