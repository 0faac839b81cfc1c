"""The recording of a calibration drive: commands and poses as tables."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from scm.arrays import Floats
from scm.clock import seconds
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.messages.eye_track import EyeTrack

DESCRIPTION = """recording: 1
vehicle: {car}
frame: world
tables:
  - file: command.csv
    time: {{column: t, unit: s}}
    channels:
      command.throttle: {{column: throttle}}
      command.steering: {{column: steering}}
  - file: pose.csv
    time: {{column: t, unit: s}}
    channels:
      pose.x: {{column: x, unit: m}}
      pose.y: {{column: y, unit: m}}
      pose.yaw: {{column: yaw, unit: rad}}
"""


@dataclass(slots=True)
class Recorded:
    """Commands that passed the guard, (t, throttle, steering), and poses, (t, x, y, yaw).

    Camera poses replace tracks as soon as one arrives: a track is smoothed, overshoots where the
    car stops, and makes a leg a percent too long.
    """

    command: list[tuple[float, float, float]] = field(default_factory=list)
    pose: list[tuple[float, float, float, float]] = field(default_factory=list)
    first_ns: int | None = None
    has_eye_poses: bool = False

    def at(self, t_ns: int) -> float:
        """Return the time since the first one requested [s]."""
        if self.first_ns is None:
            self.first_ns = t_ns
        return seconds(t_ns - self.first_ns)

    def commanded(self, t_ns: int, throttle: float, steering: float) -> None:
        """Record a command to the actuators; never back in time."""
        at_s = self.at(t_ns)
        if not self.command or at_s > self.command[-1][0]:
            self.command.append((at_s, throttle, steering))

    def seen(self, message: EyeTrack | EyePose) -> None:
        """Record a pose, once."""
        if isinstance(message, EyePose) and not self.has_eye_poses:
            self.has_eye_poses = True
            self.pose.clear()
        if isinstance(message, EyeTrack) and self.has_eye_poses:
            return
        row = self.at(message.t_ns), message.x_m, message.y_m, message.yaw_rad
        if not self.pose or row[0] > self.pose[-1][0]:
            self.pose.append(row)

    def arrays(self) -> tuple[Floats, Floats]:
        """Return commands, (n, 3), and poses, (m, 4)."""
        return np.array(self.command).reshape(-1, 3), np.array(self.pose).reshape(-1, 4)

    def write(self, folder: Path, car: str) -> None:
        """Write `recording.yaml` and its tables; create the folder."""
        folder.mkdir(parents=True, exist_ok=True)
        _write(folder / "command.csv", "t,throttle,steering", self.command)
        _write(folder / "pose.csv", "t,x,y,yaw", self.pose)
        (folder / "recording.yaml").write_text(DESCRIPTION.format(car=car), encoding="utf-8")


def _write(path: Path, header: str, rows: Sequence[Sequence[float]]) -> None:
    lines = (",".join(f"{value:.6f}" for value in row) for row in rows)
    path.write_text("\n".join([header, *lines, ""]), encoding="utf-8")
