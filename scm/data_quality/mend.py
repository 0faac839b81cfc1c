"""Gross faults found one after the other, each repaired before the next is looked for."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np

from scm.data_quality import gross
from scm.data_quality.corrected import forward_speed, repaired
from scm.data_quality.gross import Sensed, compare
from scm.data_quality.problem import DataProblem, Span
from scm.data_quality.standing import moves
from scm.data_quality.suspicion import Repair
from scm.data_quality.track import Series, Track, recorded_s, series, track
from scm.recording.read import Recording

GYROS = ("imu.gyro_z", "yaw_rate")
SHORTEST_S = 4.0
DESCRIBE = "Give the unit and sign of the column in the recording's description."


@dataclass
class Mending:
    """The recording as repaired so far."""

    recording: Recording
    repairs: list[Repair] = field(default_factory=list)

    def repair(self, repair: Repair) -> None:
        """Apply one more."""
        self.recording = repaired(self.recording, [repair])
        self.repairs.append(repair)

    def left_out_s(self, channels: Iterable[str]) -> list[Span]:
        """Return the spans whose rows are left out of any of these channels."""
        names = set(channels)
        return [span for one in self.repairs if names & {*one.channels} for span in one.out_s]

    @property
    def poses(self) -> Track | None:
        """The poses, None where there are too few to compare."""
        found = track(self.recording)
        long = found is not None and recorded_s(found.t) > SHORTEST_S
        return found if found is not None and long and moves(found) else None


def mend_heading(now: Mending) -> Iterator[DataProblem]:
    """Repair a heading in degrees, or one that turns the other way than the pose moves."""
    poses, raw = now.poses, series(now.recording, "pose.yaw")
    if poses is None or raw is None:
        return
    at = np.clip(np.searchsorted(raw.t, poses.t), 0, len(raw.t) - 1)
    factor = gross.heading_fault(poses, raw.values[at])
    if factor == 1.0:
        return
    mirrored = factor == -1.0 and _turns_with_gyro(now.recording, poses)
    channel = "pose.y" if mirrored else "pose.yaw"
    now.repair(Repair(channels=(channel,), factor=1.0 / factor))
    text = "The heading turns the other way than the pose moves: one axis is mirrored."
    if abs(factor) != 1.0:
        text = f"The heading is {abs(factor):.3g} times too large for the way the pose moves."
    yield DataProblem(
        channel=channel,
        name="sign" if abs(factor) == 1.0 else "unit",
        text=text,
        corrected=f"Multiplied by {1.0 / factor:.4g}.",
        record_instead="Record yaw counter-clockwise, x and y on a right-handed floor.",
    )


def mend_unsigned(now: Mending) -> Iterator[DataProblem]:
    """Give a speed that is never negative the sign of the pose's motion."""
    speed, movement = series(now.recording, "speed"), forward_speed(now.poses)
    if speed is None or movement is None or speed.values.min() < 0.0:
        return
    fast = float(np.percentile(np.abs(movement.values), 90))
    inside = (movement.t > speed.t[0]) & (movement.t < speed.t[-1])
    back = (movement.values < -0.2 * fast) & inside
    ahead = (movement.values > 0.2 * fast) & inside
    if min(back.mean(), ahead.mean()) < 0.05 or fast < 0.02:
        return
    if np.median(speed.at(movement.t)[back]) > 0.2 * fast:
        now.repair(Repair(channels=("speed",), signed=True))
        yield DataProblem(
            channel="speed",
            name="sign",
            text=f"Stays positive while the pose drives backwards ({100.0 * back.mean():.0f} % of "
            "the time).",
            corrected="Takes the sign of the pose's motion.",
            record_instead="Record speed with its sign.",
        )


def _turns_with_gyro(recording: Recording, poses: Track) -> bool:
    gyro = series(recording, GYROS[0]) or series(recording, GYROS[1])
    if gyro is None:
        return False
    turn = Sensed(("pose.yaw",), "angular speed", Series(poses.t, poses.yaw), 1)
    pair = compare(turn, Sensed(GYROS[:1], "angular speed", gyro))
    return pair is not None and pair.lag.alike > gross.ALIKE
