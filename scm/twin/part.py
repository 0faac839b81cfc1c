"""The twin part: watches every car of the running city, and tells since when one has changed.

It has what a car reports of itself (commands, encoders, IMU) and where the Eye sees it; a car that
no camera sees is compared with where it says it is. One car is looked at a step.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import TypeVar

from scm.clock import NS_PER_MS, NS_PER_S, seconds
from scm.disturbances import Disturbances
from scm.records.twins import TwinChange, TwinVersion
from scm.runtime.part import BasePart, Service, Subscription
from scm.twin.car import LOCATE_NS, NAME, Setup, TwinCar
from scm.twin.detector import threshold_of
from scm.twin.investigation import Worker
from scm.twin.places import PlaceWatch
from scm.twin.sending import Sending, SendWhen
from scm.twin.windows import WatchedCar
from scm.v2x.exchange import Answer, Incoming, Outgoing
from scm.v2x.message import Message, Refused
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.trip import Trip
from scm.v2x.messages.twin_send_request import TwinSendRequest
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.version_request import VersionRequest
from scm.v2x.messages.world_definition import WorldDefinition
from scm.vehicles.car import load_car

R = TypeVar("R", TwinVersion, TwinChange)
FALSE_ALARM_H = 200.0
BUDGET_S = 300.0
MOST_CARS = 100  # that show where the floor changed
GONE_NS = 600 * NS_PER_S  # after so long without a report, a car is forgotten


class TwinPart(BasePart):
    """Watches the cars of one city; see `scm.runtime.part.Part`.

    Args:
        false_alarm_h: Hours of driving in which a car that does not change may be reported once.
        data: Folder for reports and car files; None: what changed is not searched for.
        budget_s: For a search.
        executor: Runs searches; None: one process that goes after the city's.
        send: When cars are sent to where they decide whose a change is.
        versions, changes: As an earlier process left them, by key.
    """

    name, role, period_ns = NAME, "part", 100 * NS_PER_MS
    subscriptions: Sequence[Subscription] = (
        Subscription(VehicleState), Subscription(VehicleSensors), Subscription(EyePose),
        Subscription(CityEvent), Subscription(Trip), Subscription(WorldDefinition),
        Subscription(PartStatus, {"station": "world"}),
    )  # fmt: skip
    services: Sequence[Service] = (Service(VersionRequest), Service(TwinSendRequest))

    def __init__(
        self, false_alarm_h: float = FALSE_ALARM_H, data: Path | None = None,
        budget_s: float = BUDGET_S, executor: Executor | None = None,
        versions: Mapping[str, TwinVersion] | None = None,
        changes: Mapping[str, TwinChange] | None = None, send: SendWhen = "agreed",
    ) -> None:  # fmt: skip
        self._cars: dict[str, TwinCar] = {}
        self._predictors: dict[str, WatchedCar] = {}
        self._executor = executor or Worker()
        threshold = threshold_of(false_alarm_h)
        self._places, self._judged_ns = PlaceWatch(threshold), 0
        self._setup = Setup(
            threshold, self._predictor, self._places, Disturbances(), self._executor, data, budget_s
        )
        self._versions, self._changes = _by_car(versions or {}), _by_car(changes or {})
        self._sending = Sending(send)
        self._status_ns = -NS_PER_S

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Store what came; look at the car that has waited longest, if one is due."""
        out = list[Outgoing]()
        for item in inbox:
            if item.call is not None:
                out += self._replied(item)
            elif isinstance(item.message, VersionRequest | TwinSendRequest):
                out += self._answered(item, item.message)
            elif isinstance(item.message, PartStatus):
                self._setup.disturbances.receive(item)
            else:
                self._receive(item.message, now_ns)
        for name in [n for n, one in self._cars.items() if now_ns - one.arrived_ns > GONE_NS]:
            self._leave(self._cars.pop(name))
        waiting = [one for one in self._cars.values() if one.waits_ns >= 0]
        if waiting:
            car = max(waiting, key=lambda one: one.waits_ns)
            reaches = self._sending.reach_for(car.name)
            out += [*car.look(), *car.locate(self._cars.values(), reaches), *self._find_place()]
        for one in self._cars.values():
            out += one.work()
        out += self._sending.step(self._cars, now_ns)
        if now_ns - self._status_ns >= NS_PER_S:
            self._status_ns = now_ns
            changed = sum(bool(one.changes) for one in self._cars.values())
            detail = f"{len(self._cars)} cars watched, {changed} changed"
            if left_out := sum(one.is_left_out for one in self._cars.values()):
                detail += f", {left_out} not all the time: they are too many"
            out.append(PartStatus(station=NAME, t_ns=now_ns, detail=detail))
        return out

    def _find_place(self) -> list[Outgoing]:
        """Say where the floor changed, by what all cars missed there."""
        newest_ns = max(one.newest_ns for one in self._cars.values())
        if 0 <= newest_ns - self._judged_ns < LOCATE_NS:
            return []
        self._judged_ns = newest_ns
        most = sorted(self._cars.values(), key=lambda one: -one.driven_s)[:MOST_CARS]
        now_s = seconds(newest_ns)
        witnesses = {one.name: one.witness(None, now_s) for one in most}
        found = self._places.look({n: one for n, one in witnesses.items() if one}, now_s)
        if found is None:
            return []
        plainest = self._cars[found.vehicles[0]]
        return plainest.add(found.as_change(), "place_changed", found.in_words())

    def finish(self, now_ns: int) -> list[Outgoing]:
        """End the worker, whatever it does."""
        del now_ns
        self._executor.shutdown(wait=False, cancel_futures=True)
        return []

    def _receive(self, message: Message, now_ns: int) -> None:
        name = getattr(message, "vehicle", None)
        self._sending.receive(message, now_ns)
        if isinstance(message, VehicleState):
            one = self._cars.get(message.vehicle)
            if one is None or one.car != message.car:
                versions = self._versions.pop(message.vehicle, ())
                changes = self._changes.pop(message.vehicle, ())
                one = TwinCar(message, now_ns, self._setup, versions, changes)
                self._cars[message.vehicle] = one
        if name in self._cars and not isinstance(message, Trip):
            self._cars[name].receive(message, now_ns)

    def _leave(self, car: TwinCar) -> None:
        """Remember what outlives a car's absence."""
        self._versions[car.name] = list(car.versions.newest)
        self._changes[car.name] = list(car.changes)
        self._sending.forget(car.name)

    def _answered(
        self, item: Incoming, request: VersionRequest | TwinSendRequest
    ) -> list[Outgoing]:
        one = self._cars.get(request.vehicle)
        if one is None:
            detail = f"{request.vehicle} is not watched: it sent nothing lately"
            return [Answer(item, Refused(code="not_found", detail=detail))]
        if isinstance(request, TwinSendRequest):
            reply, more = self._sending.agree(one, request)
        else:
            reply, more = one.answer(request)
        return [*more, Answer(item, reply)]

    def _replied(self, item: Incoming) -> list[Outgoing]:
        request = None if item.call is None else item.call.request
        if isinstance(item.message, Refused) and isinstance(request, VersionRequest):
            one = self._cars.get(request.vehicle)
            return [] if one is None else one.refused()
        return self._sending.reply(item, self._cars)

    def _predictor(self, car: str) -> WatchedCar:
        if car not in self._predictors:
            self._predictors[car] = WatchedCar(load_car(car))
        return self._predictors[car]


def _by_car(stored: Mapping[str, R]) -> dict[str, list[R]]:
    """Return records by car, in order."""
    found = defaultdict[str, list[tuple[int, R]]](list)
    for key, value in stored.items():
        name, number = key.split("/")
        found[name].append((int(number), value))
    for rows in found.values():
        rows.sort(key=lambda row: row[0])
    return {name: [one for _, one in rows] for name, rows in found.items()}
