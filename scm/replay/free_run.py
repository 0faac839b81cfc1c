"""Drive a recording again: free runs of the simulator from the measured state, and their error.

Every window starts from the measured pose and velocities and then gets nothing but the recorded
commands. All windows run side by side as rows of one fleet. Before a window starts, its commands of
the last second run the actuators in, so that servo and lags begin where they were. A car whose
drive knows its battery gets the voltage that was measured. Faults of measurement that the car file
states, such as a tilted camera, are undone in the poses first.
"""

from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats
from scm.errors import RecordingError
from scm.geometry import Pose2
from scm.recording.motion import Motion, Poses
from scm.recording.read import Recording
from scm.replay.commands import Commands
from scm.vehicles.car import Car
from scm.vehicles.drive_channel import drive_name
from scm.vehicles.fleet import Fleet
from scm.vehicles.undone import without_faults

STEP_S = 0.005
RUN_IN_S = 1.0
HORIZONS_S = (0.5, 1.0, 3.0)
SHORTEST_HORIZON_S = 0.05
NEEDED = ("command.steering", "pose.x", "pose.y", "pose.yaw")


@dataclass(frozen=True, slots=True)
class FreeRun:
    """Simulated and measured rear-axle motion of all windows, arrays of shape `(windows, times)`.

    Attributes:
        start_s: When each window starts on the recording's clock, shape `(windows,)`.
        t_s: Time since the window's start, shape `(times,)`.
        x, y, yaw, speed: Simulated.
        x_measured, y_measured, yaw_measured, speed_measured: From the recording, without the faults
            of measurement in the car file; NaN in a gap.
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


def _refuse_incomplete(recording: Recording, car: Car) -> None:
    """Say in one sentence which channels a replay lacks."""
    needed = (drive_name(recording, car), *NEEDED)
    missing = [name for name in needed if name not in recording.channels]
    if missing:
        speed = missing[0] == "command.throttle" and "command.speed" in recording.channels
        hint = f"; {car.name} has no speed_control, so command.speed cannot drive it"
        msg = f"{recording.path}: a replay needs {', '.join(needed)}; missing: {', '.join(missing)}"
        raise RecordingError(msg + (hint if speed else ""))


def free_run(
    recording: Recording, car: Car, horizon_s: float = 3.0, save_every_s: float = 0.05
) -> FreeRun:
    """Simulate every whole window of `horizon_s` that the recording holds.

    Raises:
        RecordingError: when a needed channel is missing or no window is whole.
    """
    if not SHORTEST_HORIZON_S <= horizon_s < np.inf:
        msg = f"horizon: got {horizon_s:g} s, expected {SHORTEST_HORIZON_S:g} s or more"
        raise RecordingError(msg)
    _refuse_incomplete(recording, car)
    recording = without_faults(recording, car.faults)
    poses, commands = Poses(recording), Commands(recording, car)
    starts, initial = _windows(recording, poses, commands, horizon_s)
    fleet = Fleet(car, len(starts) + 1)
    _run_in(fleet, commands, starts, initial)
    t_s: Floats = np.append(np.arange(0.0, horizon_s - 0.5 * STEP_S, save_every_s), horizon_s)
    steps = np.diff(np.rint(t_s / STEP_S).astype(np.int64))
    x, y, yaw, speed = (np.empty((len(starts), len(t_s))) for _ in range(4))
    for k, t in enumerate(t_s):
        for out, now in zip(
            (x, y, yaw, speed), (fleet.x, fleet.y, fleet.yaw, fleet.speed), strict=True
        ):
            out[:, k] = now[: len(starts)]
        if k < len(steps):
            _advance(fleet, commands, starts + t, int(steps[k]))
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
    (first_command, last_command), tiny = commands.span_s, 1e-6
    first = max(poses.t[0], first_command)
    span = min(poses.t[-1], last_command) - first
    if span < horizon_s - tiny:
        msg = (
            f"{recording.path}: no window of {horizon_s:g} s: poses from {poses.t[0]:.3f} s to "
            f"{poses.t[-1]:.3f} s, commands from {first_command:.3f} s to {last_command:.3f} s"
        )
        raise RecordingError(msg)
    every: Floats = first + horizon_s * np.arange(int((span + tiny) / horizon_s))
    starts = np.array([t for t in every if poses.unbroken(t, t + horizon_s - tiny)])
    initial = poses.motion(starts)
    if not initial.valid.any():
        msg = f"{recording.path}: no window of {horizon_s:g} s without a gap in the poses"
        raise RecordingError(msg)
    keep = initial.valid
    return starts[keep], poses.motion(starts[keep])


def _run_in(fleet: Fleet, commands: Commands, starts: Floats, initial: Motion) -> None:
    """Put a car at the start of every window, all it remembers as the whole drive before left it.

    One more car drives the recording through; where a window starts it is copied and put in the
    measured place and motion. So servo, lags, motor heat and the time since the start are right.
    """
    poses = [Pose2(*at) for at in zip(initial.x, initial.y, initial.yaw, strict=True)]
    leader = fleet.capacity - 1
    fleet.alive[leader] = True
    fleet.place(leader, poses[0], float(initial.speed[0]))
    now = float(starts[0]) - RUN_IN_S
    for row, start in enumerate(starts):
        _lead(fleet, leader, commands, now, round((start - now) / STEP_S))
        now = float(start)
        time = float(fleet.time[leader])
        fleet.copy_row(leader, row)
        fleet.place(
            row,
            poses[row],
            float(initial.speed[row]),
            float(initial.lateral_speed[row]),
            float(initial.yaw_rate[row]),
            keep_actuators=True,
        )
        fleet.time[row] = time - RUN_IN_S
    fleet.remove(leader)


def _lead(fleet: Fleet, row: int, commands: Commands, t: float, steps: int) -> None:
    """Advance one car alone by `steps` from the time `t`."""
    for k in range(steps):
        at = np.array([t + k * STEP_S])
        throttle, steering = commands.at(at)
        fleet.throttle[row], fleet.steering[row] = throttle[0], steering[0]
        voltage = commands.voltage(at)
        if voltage is not None:
            fleet.battery[row] = voltage[0]
        fleet.advance_rows(row, row + 1, STEP_S)


def _advance(fleet: Fleet, commands: Commands, t: Floats, steps: int) -> None:
    """Advance every window by `steps` from its own time `t`, shape `(windows,)`."""
    n = len(t)
    for k in range(steps):
        throttle, steering = commands.at(t + k * STEP_S)
        fleet.throttle[:n] = throttle
        fleet.steering[:n] = steering
        voltage = commands.voltage(t + k * STEP_S)
        if voltage is not None:
            fleet.battery[:n] = voltage
        fleet.advance(STEP_S)


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
