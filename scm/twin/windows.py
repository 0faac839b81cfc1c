"""What a car file misses in each second of driving, and how each known effect would change that.

The car is driven again by its recorded commands, beside it once for each number of each known
effect, moved by a small step; all are rows of one fleet. A window is one second: how far the drive
strays along the body, across it and in heading, and what every other sensor shows in it
(`scm.mismatch.fit.residual_windows`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import pi

import numpy as np

from scm.arrays import Bools, Floats
from scm.mismatch.effect_catalogue import Candidate, Parameter, candidates, terms_needed
from scm.mismatch.findings import Equation
from scm.mismatch.fit.noise import Noise, usual_noise
from scm.mismatch.fit.residual_windows import LENGTH_S, WindowWhitener, least_sizes
from scm.mismatch.fit.rollouts import Motions, Rollouts, Tiles
from scm.mismatch.fit.sensor_prediction import Prediction
from scm.recording.read import Recording
from scm.replay.drive import Drive
from scm.replay.numbers import Numbers
from scm.vehicles.car import Car

EVERY_S = 0.5  # between the beginnings of two windows of a second
UPHILL = "uphill_rad"
TWO_WAYS = (0.0, 0.5 * pi)  # uphill: a slope along x and one along y make all others
LEAST_DRIVEN_S = 3.0  # of a recording: a window of a second, and what surrounds it


@dataclass(frozen=True, slots=True)
class WatchedNumber:
    """A number of a known effect, and a small step of it.

    Attributes:
        effect, name: As in reports.
        numbers: By key, with the effect's number one step from where it does nothing.
        step: In `unit`.
    """

    effect: str
    name: str
    unit: str
    equation: Equation
    numbers: Numbers
    step: float


@dataclass(frozen=True, slots=True)
class Windows:
    """Windows of one car's driving, n of them.

    Attributes:
        begin_s: On the recording's clock, rising, (n,).
        places: Where the car was in the middle of each, x and y, (n, 2) [m].
        streams: `pose.x` stands for the way along the body, `pose.y` for that across it.
        misses: Measured minus predicted, (n, streams) [m, rad, or the sensor's unit].
        slopes: What one unit of each watched number adds to the prediction, (n, streams, numbers).
    """

    begin_s: Floats
    places: Floats
    streams: tuple[str, ...]
    misses: Floats
    slopes: Floats

    def between(self, first_s: float, last_s: float) -> "Windows":
        """Return the windows that begin in a span of time."""
        return self.where((self.begin_s >= first_s) & (self.begin_s < last_s))

    def where(self, these: Bools) -> "Windows":
        """Return some of the windows.

        Args:
            these: Whether each is one, (n,).
        """
        return replace(
            self, begin_s=self.begin_s[these], places=self.places[these],
            misses=self.misses[these], slopes=self.slopes[these],
        )  # fmt: skip


class WatchedCar:
    """Predicts what the sensors of a car should show.

    Args:
        car: As its newest version says.

    Attributes:
        given: The car.
        car: With every known effect, at rest.
        watched: The numbers whose change would show.
    """

    def __init__(self, car: Car) -> None:
        self.given = car
        self.car = car.with_terms(terms_needed(car))
        self.watched = tuple(number for one in candidates(self.car) for number in _numbers_of(one))
        self._tiles = Tiles(self.car)

    def windows(self, recording: Recording) -> Windows:
        """Return the windows of a recording that its poses and commands cover.

        Raises:
            RecordingError: when it has no commands or no poses, or too few.
        """
        drive = Drive(recording, self.car)
        if drive.edges[-1] - drive.edges[0] < LEAST_DRIVEN_S:
            return self._none(drive)
        usual = usual_noise([drive])
        noise = Noise(usual.speed, usual.side, usual.yaw_rate, least_sizes([drive]), usual.scale)
        ends = np.array([drive.edges[0], drive.edges[-1]])
        by_window = WindowWhitener(drive, noise, ends)
        misses = by_window.misses(self._residuals(drive))
        count, streams = len(drive.streams), by_window.streams
        misses = misses.reshape(count, -1, misses.shape[1]).transpose(1, 0, 2)
        steps = np.array([one.step for one in self.watched])
        slopes = (misses[:, :, :1] - misses[:, :, 1:]) / steps
        middle = by_window.begin_s + 0.5 * LENGTH_S
        places = np.stack([drive.smoothed[name].at(middle) for name in ("pose.x", "pose.y")], 1)
        return Windows(by_window.begin_s, places, streams, misses[:, :, 0], slopes)

    def _residuals(self, drive: Drive) -> list[Floats]:
        """Return measured minus predicted of every stream, of the car and of each step."""
        sets: list[Numbers] = [{}, *(one.numbers for one in self.watched)]
        rollouts, prediction = Rollouts(drive, self.car, self._tiles), Prediction(drive)
        found = [np.empty((len(stream.t), len(sets))) for stream in drive.streams]

        def collect(motions: Motions, which: Sequence[int]) -> None:
            residuals = prediction.residuals(motions, [sets[k] for k in which])
            for stream, residual in zip(found, residuals, strict=True):
                stream[:, list(which)] = residual

        rollouts.each(sets, collect)
        return found

    def _none(self, drive: Drive) -> Windows:
        count = len(drive.streams)
        none = np.empty((0, count, len(self.watched)))
        return Windows(np.empty(0), np.empty((0, 2)), drive.names, none[:, :, 0], none)


def _numbers_of(one: Candidate) -> list[WatchedNumber]:
    """Return the numbers of an effect that say how much; of a slope, along x and along y."""
    if one.is_placed and not one.starts and all(p.name != UPHILL for p in one.parameters):
        return []  # a spot of the floor: nobody knows where
    found = list[WatchedNumber]()
    for at, parameter in enumerate(one.parameters):
        if not one.amounts[at]:
            continue
        for way, rest in _rests(one.parameters):
            values = [*rest]
            values[at] = parameter.neutral + parameter.step
            numbers = one.numbers(tuple(values))
            found.append(
                WatchedNumber(
                    one.name, parameter.name + way, parameter.unit, one.equation, numbers,
                    parameter.step,
                )
            )  # fmt: skip
    return found


def _rests(parameters: Sequence[Parameter]) -> list[tuple[str, list[float]]]:
    """Return where an effect's other numbers stay meanwhile, with what that adds to its name."""
    rest = [parameter.neutral for parameter in parameters]
    uphill = [at for at, parameter in enumerate(parameters) if parameter.name == UPHILL]
    if not uphill:
        return [("", rest)]
    return [
        (way, [*rest[: uphill[0]], turned, *rest[uphill[0] + 1 :]])
        for way, turned in zip(("_x", "_y"), TWO_WAYS, strict=True)
    ]
