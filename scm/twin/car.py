"""One car of the city: what it sent, how it is watched, its changes, and the versions of its file.

Each ten seconds of its reports are looked at once. A change is searched for its cause when it was
driven for some time since; what the search finds is a candidate (`versions`).
"""

import math
import re
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Literal

from msgspec import structs

from scm.clock import nanoseconds, seconds
from scm.disturbances import Disturbances
from scm.errors import CarError, RecordingError
from scm.recorder.driven import SIMULATED, CarMessages, by_one_camera, recording_of
from scm.recording.read import Recording
from scm.records.twins import TwinChange, TwinDrive, TwinVersion
from scm.twin.causes import ELSEWHERE, cause_in_words, located
from scm.twin.drives import Reaches, interrupted, is_recent
from scm.twin.evidence import Witness, witness
from scm.twin.investigation import FAILURES, Compared, Explained, compare, explain, why_failed
from scm.twin.memory import CarMemory, seen_by_eye
from scm.twin.places import PlaceWatch
from scm.twin.versions import (
    BY_TWIN,
    PROBATION_S,
    SEEN_S,
    CarVersions,
    Trial,
    in_words,
    is_worse,
    meaning,
    verdict,
)
from scm.twin.watch import AFTER_S, BEFORE_S, SPAN_S, CarWatch
from scm.twin.windows import WatchedCar
from scm.v2x.exchange import Call, Outgoing, PersistedState
from scm.v2x.message import Message, Refused
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.twin_status import TwinStatus
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.version_request import VersionRequest

NAME = "twin"
CHANGES, VERSIONS = "change", "version"  # begin the keys of records
CHANGED_AGAIN = "the car changed again before it was confirmed"
LOOK_NS, BEFORE_NS = nanoseconds(SPAN_S), nanoseconds(BEFORE_S)
DUE_NS = nanoseconds(SPAN_S + AFTER_S)
LATE_NS, LATELY_NS = nanoseconds(30.0), nanoseconds(120.0)
"""With more cars than can be looked at, what waits for longer is left out; how long that counts."""
LEAP_NS = nanoseconds(2.0)  # of a clock: what was recorded before does not belong to what follows
MOST_CHANGES = 20
FEWEST_SEEN = 50  # poses of a first look, for the Eye to be a witness
SEARCHED_BEFORE_S, SEARCHED_AFTER_S = 120.0, 90.0  # of a change, for a search
MOST_AFTER_S, LEAST_AFTER_S = 300.0, 40.0
LOCATE_NS = nanoseconds(30.0)  # between two judgements of whose a change is
SENT_NS = nanoseconds(10.0)  # likewise, while a car drives to decide it
MOST_WITNESSES = 30  # those that drove most
LOCATED_NS = nanoseconds(300.0)  # after a change was noticed, whose it is may still come out


@dataclass(frozen=True, slots=True)
class Setup:
    """What all cars share.

    Attributes:
        threshold: Score from which on a change is reported.
        predictor: Returns what predicts cars of a file.
        places: Where the floor changed.
        disturbances: When the world simulated less time than passed.
        executor: Runs searches and comparisons.
        data: Folder for reports and car files; None: nothing is searched for.
        budget_s: For a search.
    """

    threshold: float
    predictor: Callable[[str], WatchedCar]
    places: PlaceWatch
    disturbances: Disturbances
    executor: Executor
    data: Path | None
    budget_s: float


class TwinCar:
    """One car of the city.

    Args:
        first: Its first report.
        now_ns: On our clock.
        setup: What all cars share.
        versions, changes: As an earlier process left them.

    Attributes:
        newest_ns: Of its reports, on their clock; `arrived_ns`: when that came, on ours.
        next_ns: From when on its reports were not looked at.
        changes: That were noticed, the newest last.
    """

    def __init__(
        self, first: VehicleState, now_ns: int, setup: Setup,
        versions: Iterable[TwinVersion] = (), changes: Iterable[TwinChange] = (),
    ) -> None:  # fmt: skip
        self.name, self.car, self._setup = first.vehicle, first.car, setup
        self._begin_ns = self.next_ns = self.newest_ns = first.t_ns
        self.arrived_ns = now_ns
        self.changes = deque(map(interrupted, changes), maxlen=MOST_CHANGES)
        self.versions = CarVersions(first.car, versions)
        self._messages, self._memory = CarMessages(), CarMemory()
        self._watch: CarWatch | None = None
        self._watched_s = self._looked_s = self._driven_s = 0.0
        self._is_seen: bool | None = None  # by the Eye; None: not decided yet
        self._reason = ""
        self._trial = Trial(0.0, 0.0) if self.versions.candidate is not None else None
        self._search: Future[Explained] | None = None
        self._comparison: Future[Compared] | None = None
        self._requested: tuple[int, Compared] | None = None  # of a version
        self._searched_until, self._located_ns = (0.0, 0.0), 0
        self._left_out_ns = first.t_ns - LATELY_NS

    @property
    def waits_ns(self) -> int:
        """For how long reports have been due to be looked at; less than 0: they are not."""
        behind_s = self._memory.last_s - self._watched_s - SPAN_S
        arrived_ns = self.newest_ns - self.next_ns - DUE_NS
        return max(arrived_ns, nanoseconds(behind_s)) if behind_s >= 0.0 else arrived_ns

    @property
    def is_left_out(self) -> bool:
        """Whether some of its driving was left out lately."""
        return self.newest_ns - self._left_out_ns < LATELY_NS

    @property
    def driven_s(self) -> float:
        """How long it was driven and watched."""
        return self._driven_s

    def receive(self, message: Message, now_ns: int) -> None:
        """Store what the car sent, or what was seen of it."""
        if isinstance(message, VehicleState):
            if abs(message.t_ns - self.newest_ns) > LEAP_NS:
                self._messages, self.next_ns = CarMessages(), message.t_ns
            if message.t_ns < self.newest_ns - LEAP_NS:  # its clock was put back
                self._memory = CarMemory()
                self._watched_s = self._looked_s = seconds(message.t_ns - self._begin_ns)
                if self._trial is not None:
                    self._trial.since_s = self._watched_s
            self.newest_ns, self.arrived_ns = message.t_ns, now_ns
            if self.newest_ns - self.next_ns > LATE_NS:
                self.next_ns, self._left_out_ns = self.newest_ns - DUE_NS, self.newest_ns
                self._messages.forget(self.next_ns - BEFORE_NS)
        self._messages.add(message)

    def look(self) -> list[Outgoing]:
        """Look at the next ten seconds; return the status, and a change if there is one."""
        out = list[Outgoing]()
        try:
            if self.newest_ns - self.next_ns >= DUE_NS:
                self._remember()
            if self._watch is None:
                file = self.versions.in_force.file
                self._watch = CarWatch(self._setup.predictor(file), self._setup.threshold)
            if self._memory.last_s >= self._watched_s + SPAN_S:
                out += self._watch_on(self._watch)
            self._reason = ""
        except RecordingError as error:
            self._reason = str(error)
        except CarError as error:
            self._reason, self._watched_s = str(error), self._memory.last_s
        return [self.status(), *out]

    def _remember(self) -> None:
        """Take ten seconds of messages into the memory."""
        first_ns, self.next_ns = self.next_ns, self.next_ns + LOOK_NS
        is_simulated = any(one.source == SIMULATED for one in self._messages.reports[-1:])
        void = self._setup.disturbances.void_reasons(first_ns, self.next_ns) if is_simulated else ()
        try:
            if void:
                raise RecordingError(void[0])
            first_s = seconds(first_ns - self._begin_ns)
            self._memory.add(self._recording(), first_s, first_s + SPAN_S, self._cameras())
        finally:
            self._messages.forget(self.next_ns - BEFORE_NS)

    def _recording(self) -> Recording:
        """Return the messages that are stored as a recording.

        Raises:
            RecordingError: when they have no poses, or no commands that the car obeyed.
        """
        messages = self._messages
        if self._is_seen is None:
            self._is_seen = sum(map(len, messages.seen.values())) >= FEWEST_SEEN
        messages = seen_by_eye(messages) if self._is_seen else messages
        return recording_of(messages, Path(NAME), self.name, self._begin_ns)

    def _cameras(self) -> list[tuple[float, str]]:
        """Return which cameras saw the car, each from when on; none if it is its own witness."""
        if not self._is_seen:
            return []
        of_cameras = groupby(by_one_camera(self._messages.seen), lambda pose: pose.camera)
        firsts = [(next(poses).t_ns, camera) for camera, poses in of_cameras]
        return [(seconds(t_ns - self._begin_ns), camera) for t_ns, camera in firsts]

    def _watch_on(self, watch: CarWatch) -> list[Outgoing]:
        """Look at ten seconds of the memory; return a change, if they show one."""
        first_s = self._memory.begin_after(self._watched_s)
        self._watched_s = last_s = first_s + SPAN_S
        recording = self._memory.between(first_s - BEFORE_S, last_s + AFTER_S)
        before_s = watch.driven_s
        noticed = watch.look(recording, first_s, last_s, self._memory.camera_at)
        if first_s >= self._looked_s:
            self._looked_s = last_s
            self._driven_s += watch.driven_s - before_s
        if noticed is None:
            return []
        self._trial = None
        out = self._stored(self.versions.reject(CHANGED_AGAIN))
        change = noticed.as_change(self._begin_ns)
        ago_s = seconds(change.noticed_ns - change.since_ns)
        like = ", or ".join(dict.fromkeys((change.effect, *change.alike)))
        text = (
            f"{self.name} is not what {self.car} says any more, since {ago_s:.0f} s: as by {like}"
        )
        return [*out, *self.add(change, "car_changed", text)]

    def add(self, change: TwinChange, event: str, text: str) -> list[Outgoing]:
        """Add a change that was noticed."""
        self.changes.append(change)
        return [self._change_stored(change), self.event(event, text, "warning")]

    def witness(self, of: "TwinCar | None", since_s: float) -> Witness | None:
        """Return what the car shows about a change, and between which of its own that counts.

        Args:
            of: The car that changed; None: none did.
            since_s: On the city's clock.
        """
        if self._watch is None:
            return None
        begin_s = seconds(self._begin_ns)
        return witness(self._watch.evidence, begin_s, self.changes, since_s, is_own=self is of)

    def locate(self, cars: Iterable["TwinCar"], reaches: Reaches) -> list[Outgoing]:
        """Say whose each new change is, by what all cars drove.

        Args:
            cars: Of the city.
            reaches: Returns whether a car can be sent through a point.
        """
        states = {one.drive.state for one in self.changes if one.drive is not None}
        every_ns = SENT_NS if "under_way" in states else LOCATE_NS
        is_judged = all(one.causes for one in self.changes)
        if is_judged and 0 <= self.newest_ns - self._located_ns < every_ns:
            return []
        out = list[Outgoing]()
        others = sorted((one for one in cars if one is not self), key=lambda one: -one.driven_s)
        cars = (self, *others[:MOST_WITNESSES])
        for change in tuple(self.changes):
            is_new = self.newest_ns - change.noticed_ns <= LOCATED_NS
            if not is_new and not is_recent(change.drive, self.newest_ns):
                continue
            since_s = seconds(change.since_ns)
            shown = {one.name: one.witness(self, since_s) for one in cars}
            cars_shown = {n: w for n, w in shown.items() if w}
            found = located(change, self.name, cars_shown, self._setup.places, reaches)
            if found is None:
                continue  # too little was driven since
            self._located_ns = self.newest_ns
            if found == change:
                continue
            out += self._now(change, found)
            if found.cause not in (change.cause, "undecided"):
                text = cause_in_words(found, self.name)
                out.append(self.event("change_located", text, "warning"))
                made = self.versions.candidate
                if found.cause in ELSEWHERE and made is not None and made.report == found.report:
                    self._trial = None
                    out += self._rejected(text)
        return [*out, self.status()] if out else []

    def remembers(self, change: TwinChange) -> bool:
        """Return whether what the car drove before a change is still known."""
        if self._watch is None or not len(self._watch.evidence.t_s):
            return False
        first_s = seconds(self._begin_ns) + self._watch.evidence.t_s[0]
        return bool(first_s < seconds(change.since_low_ns))

    def change_drive(self, change: TwinChange, drive: TwinDrive) -> list[Outgoing]:
        """Report how far the drive that decides a change is."""
        return [*self._now(change, structs.replace(change, drive=drive)), self.status()]

    def work(self) -> list[Outgoing]:
        """Go on with searching for the cause of a change, and with comparing versions."""
        if self._setup.data is None:
            return []
        if self._search is not None:
            return self._searched(self._search) if self._search.done() else []
        if self._comparison is not None:
            return self._compared(self._comparison) if self._comparison.done() else []
        waiting = next((one for one in self.changes if one.search == "driving"), None)
        if waiting is not None and waiting.cause in ELSEWHERE:
            return self._now(waiting, structs.replace(waiting, search="elsewhere"))
        if waiting is not None:
            return self._search_for(waiting, self._setup.data)
        return self._compare()

    def _search_for(self, change: TwinChange, data: Path) -> list[Outgoing]:
        """Start the search for the cause of a change, when the car was driven long enough since."""
        if change.cause == "undecided" and self._setup.places.has_found(change):
            if self.newest_ns - change.noticed_ns <= LOCATED_NS:
                return []  # whose it is may still come out
            text = "Several cars noticed it at one place; whose change it is was not decided."
            return self._now(change, structs.replace(change, search="failed", text=text))
        since_s = seconds(change.since_ns - self._begin_ns)
        later = (one for one in self.changes if one.since_ns > change.since_ns)
        ends = next((seconds(one.since_low_ns - self._begin_ns) for one in later), None)
        last_s = min(self._memory.last_s, since_s + MOST_AFTER_S, ends or math.inf)
        if ends is None and last_s < since_s + SEARCHED_AFTER_S:
            return []
        if last_s < since_s + LEAST_AFTER_S:
            text = f"It changed again after {last_s - since_s:.0f} s: too soon to search."
            return self._now(change, structs.replace(change, search="failed", text=text))
        number = self.versions.newest[-1].number + 1
        name = re.sub(r"[^a-z0-9]+", "-", self.name.lower())
        report = f"twin-{name}-{seconds(change.since_ns):.0f}"
        low_s, high_s = (
            seconds(t_ns - self._begin_ns) for t_ns in (change.since_low_ns, change.since_high_ns)
        )
        try:
            recording = self._memory.between(since_s - SEARCHED_BEFORE_S, last_s)
        except RecordingError as error:
            return self._now(change, structs.replace(change, search="failed", text=str(error)))
        self._search = self._setup.executor.submit(
            explain, recording, self.versions.in_force.file, data / "reports" / report,
            data / "twins" / self.name / f"{number}.toml", (low_s, high_s), self._setup.budget_s,
        )  # fmt: skip
        self._searched_until = last_s, self._driven_s
        return self._now(change, structs.replace(change, search="searching", report=report))

    def _searched(self, search: Future[Explained]) -> list[Outgoing]:
        """Take what a search found."""
        self._search = None
        change = next((one for one in self.changes if one.search == "searching"), None)
        if change is None:  # so many came since that it is forgotten
            return []
        try:
            found = search.result()
        except FAILURES as error:
            failed = structs.replace(change, search="failed", text=why_failed(error), report="")
            return self._now(change, failed)
        state = "named" if found.effects else "undecided" if found.between else "unexplained"
        named = structs.replace(
            change, search=state, effects=found.effects, between=found.between,
            drive_this=found.drive_this, text=found.text,
        )  # fmt: skip
        if found.since_s is not None:
            since_ns, low_ns, high_ns = (self._begin_ns + nanoseconds(t_s) for t_s in found.since_s)
            named = structs.replace(
                named, since_ns=since_ns, since_low_ns=low_ns, since_high_ns=high_ns
            )
        text = f"{self.name} changed: {named.text}"
        out = [*self._now(change, named), self.event("change_explained", text, "warning")]
        is_newest = named is self.changes[-1]
        if found.car_file is not None and is_newest and named.cause not in ELSEWHERE:
            made = self.versions.propose(found, named.report, self.newest_ns)
            self._trial = Trial(*self._searched_until)
            out += self._stored(made)
        return [*out, self.status()]

    def _compare(self) -> list[Outgoing]:
        """Compare the version on trial with the one before it, when there was enough driving."""
        trial, candidate = self._trial, self.versions.candidate
        steps = PROBATION_S if candidate is None else SEEN_S
        if trial is None or self._driven_s - trial.driven_s < steps[trial.done]:
            return []
        new = self.versions.in_force if candidate is None else candidate
        try:
            recording = self._memory.between(trial.since_s, self._memory.last_s)
        except RecordingError:
            return []
        self._comparison = self._setup.executor.submit(
            compare, recording, self.versions[new.after].file, new.file
        )
        return []

    def _compared(self, comparison: Future[Compared]) -> list[Outgoing]:
        """Adopt the candidate, reject it, or roll the version in force back; or go on."""
        self._comparison, trial, candidate = None, self._trial, self.versions.candidate
        if trial is None:  # the car changed meanwhile
            return []
        steps = PROBATION_S if candidate is None else SEEN_S
        trial.done += 1
        is_last = trial.done == len(steps)
        self._trial = None if is_last else trial
        try:
            compared = comparison.result()
        except FAILURES as error:
            return self._rejected(f"not compared: {why_failed(error)}") if is_last else []
        if candidate is None:
            if not is_worse(compared):
                return []
            errors = in_words(compared)
            return self._put(self.versions.in_force.after, f"worse later: {errors}", compared)
        action, reason = verdict(compared, is_last=is_last)
        if action == "adopt":
            return self._put(candidate.number, reason, compared)
        return self._rejected(reason, compared) if action == "reject" else []

    def _put(self, number: int, reason: str, compared: Compared) -> list[Outgoing]:
        """Request a version in force as an operator would: there is one way, and it is audited."""
        self._trial, self._requested = None, (number, compared)
        request = VersionRequest(vehicle=self.name, version=number, by=BY_TWIN, reason=reason)
        return [Call(request)]

    def _rejected(self, reason: str, compared: Compared | None = None) -> list[Outgoing]:
        rejected = self.versions.reject(reason, compared)
        if rejected is None:
            return []
        text = f"{self.name}: version {rejected.number} is rejected: {reason}"
        return [*self._stored(rejected), self.event("version_rejected", text), self.status()]

    def answer(self, request: VersionRequest) -> tuple[Message, list[Outgoing]]:
        """Put a version in force; return the reply and what else to send."""
        number, before = request.version, self.versions.in_force.number
        if number not in self.versions:
            last = self.versions.newest[-1].number
            detail = f"{self.name} has no version {number}; it has 0 to {last}"
            return Refused(code="not_found", detail=detail), []
        if number == before:
            return self.status(), []
        requested, compared = self._requested or (-1, None)
        if requested != number or request.by != BY_TWIN:
            compared = None  # an operator's choice
        changed = self.versions.put_in_force(number, request.by, request.reason, compared)
        self._requested = self._comparison = self._trial = self._watch = None
        if compared is not None and number > before:
            self._trial = Trial(self._memory.last_s, self._driven_s)
        changes = [seconds(one.since_high_ns - self._begin_ns) for one in self.changes]
        self._watched_s = max([0.0, *changes])  # it learns from what was driven since
        level: Literal["info", "warning"] = "info" if number > before else "warning"
        way = "is predicted by" if number > before else "goes back to"
        text = f"{self.name} {way} version {number}: {request.reason or 'no reason given'}"
        means = meaning(self.versions.in_force.abilities) if number > before else []
        stored = [item for one in changed for item in self._stored(one)]
        events = [self.event("version", text, level)]
        if means:
            text = f"{self.name} {'; '.join(means)}"
            events.append(self.event("abilities_changed", text, "warning"))
        return self.status(), [*stored, *events, self.status()]

    def refused(self) -> list[Outgoing]:
        """Start a comparison again whose result could not be put in force."""
        self._requested = None
        if self._trial is None:
            self._trial = Trial(self._memory.last_s, self._driven_s)
        return []

    def status(self) -> TwinStatus:
        """Return what is known of the car."""
        is_learning = self._watch is None or self._watch.is_learning
        return TwinStatus(
            vehicle=self.name, t_ns=self.next_ns, car=self.car, reason=self._reason,
            state="blind" if self._reason else "learning" if is_learning else "watching",
            driven_s=self._driven_s, changes=tuple(self.changes),
            version=self.versions.in_force.number, versions=self.versions.newest,
        )  # fmt: skip

    def _now(self, change: TwinChange, then: TwinChange) -> list[Outgoing]:
        """Replace a change by what is known of it now."""
        self.changes[self.changes.index(change)] = then
        return [self._change_stored(then)]

    def _change_stored(self, change: TwinChange) -> PersistedState:
        return PersistedState("twins", f"{CHANGES}/{self.name}/{change.noticed_ns}", change)

    def _stored(self, version: TwinVersion | None) -> list[Outgoing]:
        if version is None:
            return []
        return [PersistedState("twins", f"{VERSIONS}/{self.name}/{version.number}", version)]

    def event(
        self, name: str, text: str, severity: Literal["info", "warning"] = "info"
    ) -> CityEvent:
        """Return an event of the car."""
        return CityEvent(
            severity=severity, source=NAME, t_ns=self.newest_ns, name=name, vehicle=self.name,
            text=text,
        )  # fmt: skip
