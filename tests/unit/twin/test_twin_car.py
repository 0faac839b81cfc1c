"""What becomes of a change: it is searched for, and a better car file is put in force."""

import dataclasses
import os
import signal
from concurrent.futures import BrokenExecutor, Executor, Future
from itertools import islice

import pytest
from msgspec.structs import replace

from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import RecordingError
from scm.mismatch.findings import Course, Effect, Equation, Estimate
from scm.records.twins import TwinCause, TwinEffect, TwinError, TwinParameter
from scm.runtime.priority import NICER
from scm.twin import car as twin_car
from scm.twin import detector
from scm.twin.abilities import compared_abilities
from scm.twin.investigation import AtOnce, Compared, Explained, Worker, _is_of, explain
from scm.twin.part import TwinPart
from scm.v2x.exchange import Answer, Call, Incoming, PersistedState
from scm.v2x.message import Refused
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.twin_status import TwinStatus
from scm.v2x.messages.version_request import VersionRequest
from scm.vehicles.car import load_car
from tests.unit.mismatch.made_drive import made_drive, nigel
from tests.unit.twin.reported import (
    BEGAN_NS,
    BIAS,
    LEARNED,
    SINCE_S,
    WELL_LEARNED,
    biased,
    changed_drive,
    reports,
)

TEXT = "The gyro reads 0.02 rad/s too much."
NUMBER = TwinParameter(name="bias_rad_s", value=0.02, low=0.019, high=0.021)
EFFECT = TwinEffect(name="gyro_bias", probability=0.99, parameters=(NUMBER,), text=TEXT)
FOUND = Explained((EFFECT,), (), "", TEXT, (70.1, 69.9, 70.4), None)
BETTER = Compared(40, (TwinError(name="gyro_rad", before=0.06, now=0.01),), ("gyro_rad",), ())
WORSE = Compared(50, (TwinError(name="position_m", before=0.01, now=0.05),), (), ("position_m",))


class Prepared(Executor):
    """Answers searches and comparisons as they are given, and remembers what they were of."""

    def __init__(self, *answers):
        self.answers, self.calls = list(answers), []

    def submit(self, function, /, *args, **kwargs):
        self.calls.append((function.__name__, args))
        answer, future = self.answers.pop(0), Future()
        if answer is None:
            return future  # it takes for ever
        if isinstance(answer, Exception):
            future.set_exception(answer)
        else:
            future.set_result(answer)
        return future


@pytest.fixture(autouse=True)
def soon(monkeypatch):
    """Learn, search and compare after little driving: a drive of two minutes has to do."""
    monkeypatch.setattr(detector, "LEARN", LEARNED)
    monkeypatch.setattr(detector, "LEARN_WELL", WELL_LEARNED)
    monkeypatch.setattr(twin_car, "SEARCHED_AFTER_S", 15.0)
    monkeypatch.setattr(twin_car, "LEAST_AFTER_S", 5.0)
    monkeypatch.setattr(twin_car, "SEEN_S", (8.0, 8.0))
    monkeypatch.setattr(twin_car, "PROBATION_S", (4.0, 8.0))


@pytest.fixture(scope="module")
def changed():
    return reports(changed_drive())


class City:
    """A part whose requests to itself arrive, as they do on a bus."""

    def __init__(self, tmp_path, *answers, **stored):
        self.executor = Prepared(*answers)
        self.part = TwinPart(data=tmp_path, executor=self.executor, **stored)
        self.now_ns, self.out, self.calls = BEGAN_NS, [], []

    def run(self, steps):
        for messages in steps:
            self.step(*messages)
        return self.last

    def step(self, *messages):
        self.now_ns += 100 * NS_PER_MS
        requests = [call.request for call in self.calls]
        inbox = [Incoming(one, self.now_ns) for one in (*messages, *requests)]
        out = self.part.step(self.now_ns, inbox)
        self.calls = [one for one in out if isinstance(one, Call)]
        self.out += out
        return out

    @property
    def last(self):
        return [one for one in self.out if isinstance(one, TwinStatus)][-1]

    @property
    def events(self):
        return [one.name for one in self.out if isinstance(one, CityEvent)]


def by_the_floor(monkeypatch):
    """Let each change be of a place."""
    place = TwinCause(kind="place", probability=0.99, x_m=1.0, y_m=2.0, radius_m=0.3)
    monkeypatch.setattr(
        twin_car, "located", lambda change, *_: replace(change, cause="place", causes=(place,))
    )


def found_with_file(tmp_path):
    """Return what a search finds, with a car file that can be put in force."""
    path = tmp_path / "1.toml"
    path.write_text(nigel().path.read_text("utf-8"), "utf-8")
    return dataclasses.replace(FOUND, car_file=path)


def test_change_of_the_floor_is_not_searched_for_in_the_car(changed, tmp_path, monkeypatch):
    by_the_floor(monkeypatch)
    city = City(tmp_path)
    (change,) = city.run(changed).changes
    assert (change.search, change.cause) == ("elsewhere", "place")
    assert city.executor.calls == []
    (event,) = [one for one in city.out if getattr(one, "name", "") == "change_located"]
    assert event.text == "Not n1 changed but the floor, within 0.3 m of (1.0, 2.0)"


def test_new_change_is_judged_at_the_next_look_whatever_was_judged_lately(
    changed, tmp_path, monkeypatch
):
    judged = []

    def located(change, *_):
        judged.append(change.noticed_ns)
        return replace(change, cause="car", causes=(TwinCause(kind="car", probability=1.0),))

    monkeypatch.setattr(twin_car, "located", located)
    city, steps = City(tmp_path, None), iter(changed)
    for messages in steps:
        city.step(*messages)
        if judged:
            break
    car = city.part._cars["n1"]
    new = replace(car.changes[0], noticed_ns=car.newest_ns, cause="undecided", causes=())
    car.add(new, "car_changed", "")
    for messages in islice(steps, 130):
        city.step(*messages)
    assert set(judged) == {one.noticed_ns for one in car.changes}
    assert len(car.changes) == 2


def test_change_noticed_at_a_place_is_not_searched_for_while_it_is_undecided_whose_it_is(
    changed, tmp_path, monkeypatch
):
    monkeypatch.setattr(twin_car.PlaceWatch, "has_found", lambda *_: True)
    city = City(tmp_path)
    (change,) = city.run(changed).changes
    assert (change.search, change.cause, city.executor.calls) == ("driving", "undecided", [])

    monkeypatch.setattr(twin_car, "LOCATED_NS", NS_PER_S)
    city = City(tmp_path)
    (change,) = city.run(changed).changes
    assert (change.search, city.executor.calls) == ("failed", [])
    assert change.text == (
        "Several cars noticed it at one place; whose change it is was not decided."
    )


def test_version_found_for_a_change_that_proves_to_be_the_floor_s_is_rejected(
    changed, tmp_path, monkeypatch
):
    city = City(tmp_path, found_with_file(tmp_path), None)
    steps = iter(changed)
    for messages in steps:
        city.step(*messages)
        if city.out and isinstance(city.out[-1], TwinStatus) and len(city.last.versions) > 1:
            break
    by_the_floor(monkeypatch)
    status = city.run(steps)
    assert status.versions[1].state == "rejected"
    assert status.versions[1].reason.startswith("Not n1 changed but the floor")


def test_change_is_searched_for_named_and_its_car_file_adopted_and_stored(changed, tmp_path):
    city = City(tmp_path, found_with_file(tmp_path), BETTER, BETTER, BETTER)
    status = city.run(changed)
    (change,) = status.changes
    assert (change.search, change.effects, change.text) == ("named", (EFFECT,), TEXT)
    assert change.since_ns == pytest.approx(BEGAN_NS + 70.1 * NS_PER_S, abs=0.2 * NS_PER_S)
    assert [one.state for one in status.versions] == ["replaced", "adopted"]
    assert status.version == 1
    assert status.state == "watching"  # by what the memory has of the car since it changed
    assert "gyro better on new driving" in status.versions[1].reason
    assert city.events == ["car_changed", "change_explained", "version"]
    assert [name for name, _ in city.executor.calls][:2] == ["explain", "compare"]
    recording, car_file, out, *_ = city.executor.calls[0][1]
    assert car_file == "nigel"
    assert out.parent == tmp_path / "reports"
    t = recording.channels["pose.x"].t
    assert t[0] < SINCE_S - 60.0 < SINCE_S + 15.0 < t[-1] < SINCE_S + 35.0
    compared = city.executor.calls[1][1][0].channels["pose.x"].t
    assert compared[0] >= t[-1]  # what no fit has seen
    stored = {one.key: one.value for one in city.out if isinstance(one, PersistedState)}
    assert stored["version/n1/1"] == status.versions[1]
    assert stored[f"change/n1/{change.noticed_ns}"] == change


def test_version_that_is_worse_later_is_rolled_back(changed, tmp_path):
    city = City(tmp_path, found_with_file(tmp_path), BETTER, WORSE)
    status = city.run(changed)
    assert [one.state for one in status.versions] == ["adopted", "rolled_back"]
    assert "worse later: position 10 to 50 mm" in status.versions[1].reason
    assert city.events[-2:] == ["version", "version"]


def test_candidate_that_is_no_better_twice_is_rejected(changed, tmp_path):
    no_better = Compared(40, BETTER.errors, (), ())
    city = City(tmp_path, found_with_file(tmp_path), no_better, no_better)
    status = city.run(changed)
    assert [one.state for one in status.versions] == ["adopted", "rejected"]
    assert city.events[-1] == "version_rejected"


@pytest.mark.parametrize(
    ("found", "search", "words"),
    [
        (RecordingError("no pose at all"), "failed", "no pose at all"),
        (BrokenExecutor("x"), "failed", "The process that worked on it was killed."),
        (Explained((), ("a", "b"), "Drive slowly.", "It may be a or b.", None, None),
         "undecided", "It may be a or b."),
        (Explained((), (), "", "Nothing known.", None, None), "unexplained", "Nothing known."),
    ],
)  # fmt: skip
def test_what_was_not_found_is_in_the_status_and_no_version(
    changed, tmp_path, found, search, words
):
    status = City(tmp_path, found).run(changed)
    (change,) = status.changes
    assert (change.search, change.text) == (search, words)
    assert [one.number for one in status.versions] == [0]


def test_operator_chooses_a_version_and_an_unknown_one_is_refused(changed, tmp_path):
    city = City(tmp_path, found_with_file(tmp_path), BETTER, BETTER, BETTER)
    city.run(changed)
    back = VersionRequest(vehicle="n1", version=0, by="anna", reason="she drives it otherwise")
    (answer,) = [one for one in city.step(back) if isinstance(one, Answer)]
    assert answer.reply.version == 0
    assert answer.reply.versions[1].by == "anna"
    for wrong, words in ((replace(back, version=7), "n1 has no version 7; it has 0 to 1"),
                         (replace(back, vehicle="n9"), "n9 is not watched")):  # fmt: skip
        (answer,) = [one for one in city.step(wrong) if isinstance(one, Answer)]
        assert isinstance(answer.reply, Refused)
        assert words in answer.reply.detail


def test_operator_who_was_first_is_named_and_not_the_twin(changed, tmp_path):
    city = City(tmp_path, found_with_file(tmp_path), BETTER)
    steps = iter(changed)
    while not city.calls:
        city.step(*next(steps))
    city.calls = [Call(VersionRequest(vehicle="n1", version=1, by="anna", reason="now"))]
    city.step()
    version = city.last.versions[1]
    assert (version.by, version.reason, version.windows) == ("anna", "now", 0)
    city.run(steps)
    assert len(city.executor.calls) == 2  # what she chose is not tried


def test_candidate_is_rejected_when_the_car_changes_again(tmp_path):
    def twice(name, t, values):
        return biased(SINCE_S)(name, t, values) - 4.0 * BIAS * (t >= 155.0) * (name == "imu.gyro_z")

    again = reports(made_drive(seconds=185.0, sense=twice), lasts_s=185.0)
    status = City(tmp_path, found_with_file(tmp_path), None).run(again)
    assert [one.state for one in status.versions] == ["adopted", "rejected"]
    assert status.versions[1].reason == "the car changed again before it was confirmed"
    assert [one.search for one in status.changes] == ["named", "driving"]


def test_restart_loses_no_version_and_repeats_no_alarm(changed, tmp_path):
    city = City(tmp_path, found_with_file(tmp_path), BETTER, BETTER, BETTER)
    before = city.run(changed)
    stored = {"versions": {}, "changes": {}}
    for one in city.out:
        if isinstance(one, PersistedState):
            kind, key = one.key.split("/", 1)
            stored[f"{kind}s"][key] = one.value
    again = City(tmp_path, **stored)
    status = again.run(changed[:150])
    assert (status.changes, status.version) == (before.changes, 1)
    assert again.events == []


def test_change_that_was_being_searched_for_at_a_restart_says_so(changed, tmp_path):
    (change,) = City(tmp_path, RecordingError("x")).run(changed).changes
    waiting = replace(change, search="searching", text="")
    status = City(tmp_path, changes={f"n1/{change.noticed_ns}": waiting}).run(changed[:200])
    assert status.changes[0].search == "failed"
    assert "started again before its cause was found" in status.changes[0].text


def test_search_names_the_effect_dates_it_and_writes_report_recording_and_car(tmp_path):
    drive = made_drive(seconds=30.0, sense=biased(15.0))
    made = tmp_path / "twins" / "n1" / "1.toml"
    found = AtOnce().submit(
        explain, drive, "nigel", tmp_path / "report", made, (14.0, 16.0), 100.0
    ).result()  # fmt: skip
    (effect,) = found.effects
    assert effect.name == "gyro_bias"
    assert effect.parameters[0].value == pytest.approx(BIAS, rel=0.05)
    assert found.since_s[0] == pytest.approx(15.0, abs=1.0)
    assert found.car_file == made
    assert made.is_file()
    assert {"report.json", "report.html", "recording"} <= {
        one.name for one in (tmp_path / "report").iterdir()
    }
    sure = compared_abilities(nigel(), load_car(made))
    assert found.abilities[1].high > sure[1].high + 1e-4  # it strayed by 0.5 mm on unseen driving


def test_search_that_ran_out_of_time_says_so(tmp_path):
    drive, made = made_drive(seconds=30.0, sense=biased(15.0)), tmp_path / "1.toml"
    found = explain(drive, "nigel", tmp_path / "report", made, (14.0, 16.0), 0.01)
    assert found.text.endswith(" The search ended before everything was examined.")
    assert found.car_file is None


@pytest.mark.parametrize(
    ("course", "since_s", "counts"),
    [
        (Course.STEP, 105.0, True),
        (Course.STEP, 60.0, True),
        (Course.STEP, 30.0, False),
        (Course.STEP, 150.0, False),
        (Course.RAMP, None, True),
        (Course.CONSTANT, None, False),
    ],
)
def test_only_effects_that_began_when_the_car_changed_explain_it(course, since_s, counts):
    since = None if since_s is None else Estimate(value=since_s, low=0.0, high=200.0, unit="s")
    effect = Effect(
        name="steer_trim", is_known=True, equation=Equation.STEERING, depends_on=(), parameters={},
        probability=1.0, text="", course=course, since_s=since,
    )  # fmt: skip
    assert _is_of(effect, (100.0, 102.0)) is counts


def test_worker_that_was_killed_is_started_again_and_stands_back():
    worker = Worker()

    def process_id():
        try:
            return worker.submit(os.getpid).result(60.0)
        except BrokenExecutor:
            return None

    try:
        first = process_id()
        assert worker.submit(os.getpriority, os.PRIO_PROCESS, 0).result(60.0) == NICER
        assert worker.submit(os.getsid, 0).result(60.0) == first, "else nice to its parent alone"
        os.kill(first, signal.SIGKILL)
        assert (process_id() or process_id()) not in (None, first)
    finally:
        worker.shutdown(wait=True)
