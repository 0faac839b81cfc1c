"""The twin part: watches every car of the running city, and reports since when one has changed.

It has what a car reports of itself (commands, encoders, IMU) and where the Eye sees it; a car that
no camera sees is compared with where it says it is. Each ten seconds of a car's reports are
looked at once, one car a step, a second after they came.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from scm.clock import NS_PER_MS, NS_PER_S, nanoseconds, seconds
from scm.errors import CarError, RecordingError
from scm.recorder.driven import CarMessages, recording_of
from scm.recording.read import Recording
from scm.runtime.part import BasePart, Subscription
from scm.twin.detector import threshold_of
from scm.twin.watch import AFTER_S, BEFORE_S, SPAN_S, CarWatch, Noticed
from scm.twin.windows import WatchedCar
from scm.v2x.exchange import Incoming, Outgoing
from scm.v2x.message import Message
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.twin_status import TwinChange, TwinStatus
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.vehicle_state import VehicleState
from scm.vehicles.car import load_car

NAME = "twin"
FALSE_ALARM_H = 200.0
LOOK_NS, BEFORE_NS = nanoseconds(SPAN_S), nanoseconds(BEFORE_S)
DUE_NS = nanoseconds(SPAN_S + AFTER_S)
LEAP_NS = 2 * NS_PER_S  # of a clock: what was recorded before does not belong to what follows
GONE_NS = 600 * NS_PER_S  # after so long without a report, a car is forgotten
MOST_CHANGES = 20
BY_EYE, FEWEST_SEEN = "eye", 50  # poses of a first look, for the Eye to be a witness


@dataclass(slots=True)
class _Car:
    """A car of the city.

    Attributes:
        begin_ns: Of all that is watched, on the clock of its reports.
        next_ns: From when on it was not looked at; `newest_ns`: its newest report.
        arrived_ns: When that came, on ours.
        is_seen: Whether the Eye is its witness; None: not decided yet.
    """

    car: str
    begin_ns: int
    next_ns: int
    newest_ns: int
    arrived_ns: int
    messages: CarMessages = field(default_factory=CarMessages)
    watch: CarWatch | None = None
    is_seen: bool | None = None
    reason: str = ""
    changes: deque[TwinChange] = field(default_factory=lambda: deque(maxlen=MOST_CHANGES))


class TwinPart(BasePart):
    """Watches the cars of one city; see `scm.runtime.part.Part`.

    Args:
        false_alarm_h: Hours of driving in which a car that does not change may be reported once.
    """

    name, role, period_ns = NAME, "part", 100 * NS_PER_MS
    subscriptions: Sequence[Subscription] = (
        Subscription(VehicleState), Subscription(VehicleSensors), Subscription(EyePose),
        Subscription(CityEvent),
    )  # fmt: skip

    def __init__(self, false_alarm_h: float = FALSE_ALARM_H) -> None:
        self._threshold = threshold_of(false_alarm_h)
        self._cars: dict[str, _Car] = {}
        self._predictors: dict[str, WatchedCar] = {}
        self._status_ns = -NS_PER_S

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Store what came; look at the car that has waited longest, if one is due."""
        for item in inbox:
            self._receive(item.message, now_ns)
        for name in [n for n, one in self._cars.items() if now_ns - one.arrived_ns > GONE_NS]:
            del self._cars[name]
        due = [n for n, one in self._cars.items() if one.newest_ns - one.next_ns >= DUE_NS]
        out: list[Outgoing] = []
        if due:
            name = max(due, key=lambda n: self._cars[n].newest_ns - self._cars[n].next_ns)
            out += self._look(name, self._cars[name])
        if now_ns - self._status_ns >= NS_PER_S:
            self._status_ns = now_ns
            changed = sum(bool(one.changes) for one in self._cars.values())
            detail = f"{len(self._cars)} cars watched, {changed} changed"
            out.append(PartStatus(station=NAME, t_ns=now_ns, detail=detail))
        return out

    def _receive(self, message: Message, now_ns: int) -> None:
        name = getattr(message, "vehicle", None)
        if isinstance(message, VehicleState):
            one = self._cars.get(message.vehicle)
            if one is None or one.car != message.car:
                one = _Car(message.car, message.t_ns, message.t_ns, message.t_ns, now_ns)
                self._cars[message.vehicle] = one
            if abs(message.t_ns - one.newest_ns) > LEAP_NS:
                one.messages, one.next_ns = CarMessages(), message.t_ns
            one.newest_ns, one.arrived_ns = message.t_ns, now_ns
            one.messages.add(message)
        elif name in self._cars:
            self._cars[name].messages.add(message)

    def _look(self, name: str, one: _Car) -> list[Outgoing]:
        """Look at the next ten seconds of a car."""
        first_ns, one.next_ns = one.next_ns, one.next_ns + LOOK_NS
        noticed = None
        try:
            if one.watch is None:
                one.watch = CarWatch(self._predictor(one.car), self._threshold)
            first_s = seconds(first_ns - one.begin_ns)
            noticed = one.watch.look(_recording(name, one), first_s, first_s + SPAN_S)
            one.reason = ""
        except (CarError, RecordingError) as error:
            one.reason = str(error)
        _forget(one.messages, one.next_ns - BEFORE_NS)
        if noticed is None:
            return [_status(name, one)]
        one.changes.append(_change(noticed, one.begin_ns))
        return [_status(name, one), _event(name, one.car, one.changes[-1])]

    def _predictor(self, car: str) -> WatchedCar:
        if car not in self._predictors:
            self._predictors[car] = WatchedCar(load_car(car))
        return self._predictors[car]


def _recording(name: str, one: _Car) -> Recording:
    """Return what is stored of a car as a recording.

    Raises:
        RecordingError: when it has no poses, or no commands that the car obeyed.
    """
    messages = one.messages
    if one.is_seen is None:
        one.is_seen = sum(map(len, messages.seen.values())) >= FEWEST_SEEN
    if one.is_seen:
        reports = [report._replace(source=BY_EYE) for report in messages.reports]
        messages = replace(messages, reports=reports)
    return recording_of(messages, Path(NAME), name, one.begin_ns)


def _forget(messages: CarMessages, before_ns: int) -> None:
    """Forget what a car sent before a time, and what was seen of it."""
    messages.reports = [one for one in messages.reports if one.t_ns >= before_ns]
    messages.sensors = [one for one in messages.sensors if one.t_ns >= before_ns]
    messages.seen = {
        camera: [one for one in poses if one.t_ns >= before_ns]
        for camera, poses in messages.seen.items()
    }
    messages.hit_ns = [t_ns for t_ns in messages.hit_ns if t_ns >= before_ns]


def _change(noticed: Noticed, begin_ns: int) -> TwinChange:
    change = noticed.change
    since_ns, low_ns, high_ns = (begin_ns + nanoseconds(t_s) for t_s in change.onset_s)
    return TwinChange(
        noticed_ns=begin_ns + nanoseconds(change.noticed_s), since_ns=since_ns,
        since_low_ns=low_ns, since_high_ns=high_ns, effect=noticed.number.effect,
        parameter=noticed.number.name, size=change.size, unit=noticed.number.unit,
        score=abs(change.score), alike=tuple(number.effect for number, _ in noticed.alike),
    )  # fmt: skip


def _status(name: str, one: _Car) -> TwinStatus:
    is_learning = one.watch is None or one.watch.is_learning
    return TwinStatus(
        vehicle=name, t_ns=one.next_ns, car=one.car, reason=one.reason,
        state="blind" if one.reason else "learning" if is_learning else "watching",
        driven_s=0.0 if one.watch is None else one.watch.driven_s, changes=tuple(one.changes),
    )  # fmt: skip


def _event(name: str, car: str, change: TwinChange) -> CityEvent:
    ago_s = seconds(change.noticed_ns - change.since_ns)
    like = ", or ".join(dict.fromkeys((change.effect, *change.alike)))
    return CityEvent(
        severity="warning", source=NAME, t_ns=change.noticed_ns, name="car_changed", vehicle=name,
        text=f"{name} is not what {car} says any more, since {ago_s:.0f} s: as by {like}",
    )  # fmt: skip
