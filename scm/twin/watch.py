"""Watches one car: what was recorded of it comes span after span, and a change comes out.

Each span is predicted with what was recorded before it and a second of what comes after, where
smoothed poses are better. After a change the car is another one: how it strays is learned anew.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import zip_longest

import numpy as np
from numpy.typing import NDArray

from scm.clock import nanoseconds
from scm.data_quality.prepare import screen, stretches
from scm.errors import RecordingError
from scm.mismatch.fit.residual_windows import LENGTH_S
from scm.recording.read import Recording
from scm.recording.span import part_of
from scm.records.twins import TwinChange
from scm.twin.detector import Change, Detector, Usual
from scm.twin.evidence import Evidence, Witness
from scm.twin.places import PlaceWatch
from scm.twin.windows import EVERY_S, WatchedCar, WatchedNumber, Windows
from scm.vehicles.car import Car

SPAN_S, PART_S = 10.0, 100.0  # parts are cut out at once: a cut reads all that it cuts from
BEFORE_S, AFTER_S = 2.0, 1.0
ANEW_S = 360.0  # of driving after a change: until then it is judged by what was before
SPANS_A_PLACE = 3  # after so many, places are looked at: each half minute


CameraAt = Callable[[float], str]


@dataclass(frozen=True, slots=True)
class Noticed:
    """A change of a car.

    Attributes:
        number: What shows it most.
        alike: What shows it nearly as well, the best first, with the size of its change.
        driven_s: How long the car was watched before, since it last changed.
    """

    change: Change
    number: WatchedNumber
    alike: tuple[tuple[WatchedNumber, float], ...]
    driven_s: float

    def as_change(self, begin_ns: int = 0) -> TwinChange:
        """Return it as a record; `begin_ns` is zero of the recording's clock."""
        change = self.change
        since_ns, low_ns, high_ns = (begin_ns + nanoseconds(t_s) for t_s in change.onset_s)
        return TwinChange(
            noticed_ns=begin_ns + nanoseconds(change.noticed_s), since_ns=since_ns,
            since_low_ns=low_ns, since_high_ns=high_ns, effect=self.number.effect,
            parameter=self.number.name, size=change.size, unit=self.number.unit,
            score=abs(change.score), alike=tuple(number.effect for number, _ in self.alike),
        )  # fmt: skip


class CarWatch:
    """Watches one car.

    Args:
        predictor: Of cars of its version; several cars may share it.
        threshold: Score from which on a change is reported.

    Attributes:
        driven_s: How long it was driven and seen.
        evidence: What its newest windows show, by how it strayed before the newest change.
        highest: Score that the newest span reaches, to be held against the threshold.
    """

    def __init__(self, predictor: WatchedCar, threshold: float) -> None:
        self._predictor, self._threshold = predictor, threshold
        self._detector = Detector(threshold)
        self._streams: tuple[str, ...] | None = None
        self._usual: Usual | None = None
        self._early = list[tuple[Windows, NDArray[np.str_]]]()  # until its usual straying is known
        self.evidence = Evidence.none(predictor.watched)
        self.driven_s = self.highest = self._changed_s = 0.0

    @property
    def car(self) -> Car:
        """That the predictions are of."""
        return self._predictor.given

    @property
    def is_learning(self) -> bool:
        """Whether it does not yet know how the car strays."""
        return self._detector.is_learning

    def look(
        self, recording: Recording, first_s: float, last_s: float,
        camera_at: CameraAt = lambda _: "",
    ) -> Noticed | None:  # fmt: skip
        """Look at a span of a recording, once; return the change that it shows, if it does.

        Args:
            recording: With what surrounds the span, if there is any.
            first_s: On the recording's clock.
            last_s: Likewise.
            camera_at: Returns which camera saw the car at a time; empty: none.
        """
        change, self.highest = None, 0.0
        for found in self._windows(recording, first_s, last_s):
            windows, cameras = by_one_camera(found, camera_at)
            self.driven_s += EVERY_S * len(windows.begin_s)
            change = change or self._detector.update(windows)
            self._remember(windows, cameras)
            self.highest = max(self.highest, self._detector.highest)
        if change is None:
            return None
        self.evidence.is_steady, self._changed_s = False, self.driven_s
        driven_s = self._detector.driven_s
        self._detector = Detector(self._threshold)
        watched = self._predictor.watched
        alike = tuple((watched[number], size) for number, size in change.alike)
        return Noticed(change, watched[change.number], alike, driven_s)

    def _remember(self, windows: Windows, cameras: NDArray[np.str_]) -> None:
        """Add windows to the evidence, weighed by how the car strays; early ones when it is known.

        All are weighed by what was learned first: otherwise they could not be compared. Some time
        after a change, they begin anew, weighed by how the car strays now.
        """
        usual = self._detector.usual
        is_over = not self.evidence.is_steady and self.driven_s - self._changed_s > ANEW_S
        if self._usual is None or (is_over and usual is not None):
            most, self._usual = self.evidence.most, usual
            self.evidence = replace(Evidence.none(self._predictor.watched), most=most)
        self._early.append((windows, cameras))
        if self._usual is not None:
            for early, by in self._early:
                self.evidence.add(early, self._usual, by)
            self._early.clear()

    def _windows(self, recording: Recording, first_s: float, last_s: float) -> Iterator[Windows]:
        """Yield the windows of a span, stretch by stretch; a stretch without a sensor shows less.

        Where the car is not driven or not seen there are none.
        """
        screened = screen(recording, self._predictor.car)
        cut = stretches(screened.recording, self._predictor.car, screened.jumps)
        for stretch in cut.recordings:
            try:
                windows = self._predictor.windows(stretch).between(first_s, last_s)
            except RecordingError:
                continue
            has_more = self._streams is not None and set(windows.streams) > set(self._streams)
            if self._streams is None or (has_more and self._usual is None):
                self._begin(windows.streams)
            if len(windows.begin_s) and windows.streams == self._streams:
                yield windows

    def _begin(self, streams: tuple[str, ...]) -> None:
        """Learn by these streams; what was learned without one of them says nothing of it."""
        self._streams, self._detector, self.driven_s = streams, Detector(self._threshold), 0.0
        self._early.clear()


def by_one_camera(
    windows: Windows, camera_at: CameraAt
) -> tuple[Windows, NDArray[np.str_]]:  # fmt: skip
    """Return the windows without those in which another camera takes over, and their cameras.

    No two cameras agree exactly, so the car would seem to have moved there.
    """
    first, last = (
        np.array([camera_at(t_s) for t_s in times_s.tolist()], dtype=np.str_)
        for times_s in (windows.begin_s, windows.begin_s + LENGTH_S)
    )
    return windows.where(first == last), first[first == last]


def watch(recording: Recording, car: CarWatch) -> list[Noticed]:
    """Return the changes of a recorded car, in the order in which they would have been noticed."""
    return [noticed for noticed in looks(recording, car) if noticed is not None]


def watch_all(
    cars: Mapping[str, tuple[Recording, CarWatch]], places: PlaceWatch
) -> dict[str, list[Noticed]]:
    """Watch the recorded cars of one run side by side, and the places where they drive.

    Args:
        cars: By name.
        places: Where they drive; it has what changed there afterwards.

    Returns:
        The changes of each car, in the order in which they would have been noticed.
    """
    changes: dict[str, list[Noticed]] = {name: [] for name in cars}
    for k, spans in enumerate(zip_longest(*(looks(*one) for one in cars.values())), 1):
        for name, noticed in zip(cars, spans, strict=True):
            changes[name] += [] if noticed is None else [noticed]
        shown = {name: one.evidence for name, (_, one) in cars.items() if len(one.evidence.t_s)}
        if shown and not k % SPANS_A_PLACE:
            now_s = max(float(one.t_s[-1]) for one in shown.values()) + LENGTH_S
            places.look({name: Witness(one, 0.0) for name, one in shown.items()}, now_s)
    return changes


def looks(recording: Recording, car: CarWatch) -> Iterator[Noticed | None]:
    """Look at a recorded car, span after span; yield the change that each shows, if it does."""
    times = [channel.t for channel in recording.channels.values() if len(channel.t)]
    begin_s = recording.begin_s if recording.begin_s is not None else min(t[0] for t in times)
    end_s, recording = max(t[-1] for t in times) - begin_s, replace(recording, begin_s=begin_s)
    for part_s in np.arange(0.0, end_s, PART_S):
        try:
            part = part_of(recording, part_s - BEFORE_S, part_s + PART_S + AFTER_S)
        except RecordingError:
            continue  # nothing was recorded there
        for first_s in np.arange(part_s, min(part_s + PART_S, end_s), SPAN_S):
            last_s = first_s + SPAN_S
            try:
                around = part_of(part, first_s - BEFORE_S, last_s + AFTER_S)
                yield car.look(around, begin_s + first_s, begin_s + last_s)
            except RecordingError:
                yield None
