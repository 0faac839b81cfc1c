"""The twin part gets what cars report, and reports since when one has changed."""

from itertools import chain, pairwise

import pytest
from msgspec.structs import replace

from scm.clock import NS_PER_MS, NS_PER_S
from scm.records.twins import TwinVersion
from scm.twin import detector
from scm.twin.part import GONE_NS, TwinPart
from scm.twin.places import PlaceChange, PlaceWatch
from scm.v2x.exchange import Incoming, PersistedState
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.twin_status import TwinStatus
from scm.v2x.messages.vehicle_state import VehicleState
from tests.unit.mismatch.made_drive import made_drive, nigel
from tests.unit.twin.reported import (
    BEGAN_NS,
    BIAS,
    EVERY_S,
    LASTS_S,
    LEARNED,
    SINCE_S,
    WELL_LEARNED,
    changed_drive,
    reports,
)

HOUR_NS = 3600 * NS_PER_S


@pytest.fixture(autouse=True)
def soon(monkeypatch):
    monkeypatch.setattr(detector, "LEARN", LEARNED)
    monkeypatch.setattr(detector, "LEARN_WELL", WELL_LEARNED)


def run(part, steps):
    """Let the part work; return all that it sends."""
    out, now_ns = [], BEGAN_NS
    for messages in steps:
        now_ns += 100 * NS_PER_MS
        out += part.step(now_ns, [Incoming(message, now_ns) for message in messages])
    return out, now_ns


@pytest.fixture(scope="module")
def changed():
    return reports(changed_drive())


def test_change_is_an_event_and_stays_in_the_status(changed):
    out, _ = run(TwinPart(), changed)
    event, _ = [one for one in out if isinstance(one, CityEvent)]
    assert (event.severity, event.name, event.vehicle) == ("warning", "car_changed", "n1")
    assert event.text.startswith("n1 is not what nigel says any more, since ")
    assert "gyro_bias" in event.text
    statuses = [one for one in out if isinstance(one, TwinStatus)]
    assert len(statuses) == pytest.approx(LASTS_S / 10.0, abs=2)
    assert statuses[0].state == "learning"
    assert "watching" in {one.state for one in statuses}
    assert all(0.0 <= b.driven_s - a.driven_s <= 11.0 for a, b in pairwise(statuses))
    (change,) = statuses[-1].changes
    assert (change.effect, change.cause) == ("gyro_bias", "car")  # no floor biases a gyro
    assert change.size == pytest.approx(BIAS, rel=0.3)
    assert change.since_low_ns <= BEGAN_NS + SINCE_S * NS_PER_S <= change.since_high_ns
    assert [one.detail for one in out if isinstance(one, PartStatus)][-1] == (
        "1 cars watched, 1 changed"
    )


def test_change_of_one_car_is_its_own_where_another_drives_as_before(changed):
    healthy = reports(made_drive(seconds=LASTS_S), name="n2")
    both = [[*one, *other] for one, other in zip(changed, healthy, strict=True)]
    out, _ = run(TwinPart(), both)
    names = [one.name for one in out if isinstance(one, CityEvent)]
    assert names == ["car_changed", "change_located"]
    statuses = {one.vehicle: one for one in out if isinstance(one, TwinStatus)}
    (change,) = statuses["n1"].changes
    assert (change.cause, change.causes[0].kind, change.decide_by) == ("car", "car", "")
    assert statuses["n2"].changes == ()


def test_place_is_an_event_and_a_change_of_the_car_that_shows_it_most(changed, monkeypatch):
    """What all cars show is stubbed: each half minute it is judged by those that drove."""
    looks = []

    def look(_, cars, now_s):
        looks.append((now_s, sorted(cars)))
        if len(cars) < 2 or len(looks) > 4:
            return None
        number = next(iter(cars.values())).evidence.numbers[0]
        return PlaceChange(
            1.0, 0.5, 0.35, number, 0.01, 12.0, now_s, (now_s - 40.0, 0.0, now_s), ("n2", "n1")
        )

    monkeypatch.setattr(PlaceWatch, "look", look)
    other = reports(made_drive(seconds=LASTS_S), name="n2")
    both = [[*one, *two] for one, two in zip(changed[:600], other[:600], strict=True)]
    out, _ = run(TwinPart(), both)
    assert all(then[0] - now[0] >= 30.0 for now, then in pairwise(looks))
    event, *_ = [one for one in out if isinstance(one, CityEvent)]
    assert (event.name, event.vehicle) == ("place_changed", "n2")
    assert event.text == (
        "n2 and n1 drive otherwise within 0.35 m of (1.0, 0.5), since 40 s: as by drive_delay"
    )
    stored = [one.key for one in out if isinstance(one, PersistedState)]
    assert stored[0].startswith("change/n2/")
    (status, *_) = [one for one in reversed(out) if isinstance(one, TwinStatus) and one.changes]
    assert (status.vehicle, status.changes[0].effect) == ("n2", "drive_delay")


@pytest.mark.parametrize(
    ("lacks", "words"),
    [({"steering": None}, "no command that it obeyed is known"), ({"car": "unicorn"}, "unicorn")],
)
def test_car_that_cannot_be_predicted_is_blind_in_words_and_others_are_watched(
    changed, lacks, words
):
    both = [
        [
            *step,
            *(
                replace(one, vehicle="n2", **(lacks if isinstance(one, VehicleState) else {}))
                for one in step
            ),
        ]
        for step in changed[:450]
    ]
    out, _ = run(TwinPart(), both)
    last = {one.vehicle: one for one in out if isinstance(one, TwinStatus)}
    assert last["n2"].state == "blind"
    assert words in last["n2"].reason
    assert last["n1"].state == "learning"
    assert last["n1"].driven_s > 30.0


def test_clock_that_jumps_is_no_change_and_nothing_piles_up(changed):
    later = [[replace(one, t_ns=one.t_ns + HOUR_NS) for one in step] for step in changed[300:650]]
    part = TwinPart()
    out, _ = run(part, [*changed[:300], *later, *changed[:200]])
    assert not [one for one in out if isinstance(one, CityEvent)]
    assert [one for one in out if isinstance(one, TwinStatus)][-1].driven_s > 50.0
    assert len(part._cars["n1"]._messages.reports) < 800
    part.step(BEGAN_NS + 10 * HOUR_NS + GONE_NS, [])
    assert part._cars == {}


def test_while_the_world_loses_time_its_cars_are_not_compared(changed):
    """From the twentieth second on it simulates nine tenths of the time, for ten seconds."""

    def world(k):
        lost_s = 0.1 * min(max(0.0, 0.1 * k - 20.0), 10.0)
        return PartStatus(station="world", t_ns=BEGAN_NS + 100 * k * NS_PER_MS, lost_s=lost_s)

    slow = [[*step, *([world(k)] if k % 10 == 0 else [])] for k, step in enumerate(changed[:450])]
    found = {}
    for name, steps in (("slow", slow), ("as ever", changed[:450])):
        out, _ = run(TwinPart(), steps)
        found[name] = [one for one in out if isinstance(one, TwinStatus)]
    lost_s = found["as ever"][-1].driven_s - found["slow"][-1].driven_s
    assert 10.0 <= lost_s <= 20.0
    reasons = {one.reason for one in found["slow"]}
    assert any(one.startswith("this computer did not simulate ") for one in reasons)
    assert found["slow"][-1].reason == ""

    on_floor = [
        [replace(one, source="eye") if isinstance(one, VehicleState) else one for one in step]
        for step in slow
    ]
    out, _ = run(TwinPart(), on_floor)
    reasons = {one.reason for one in out if isinstance(one, TwinStatus)}
    assert not any("did not simulate" in one for one in reasons)


def test_of_too_many_cars_each_is_watched_for_a_part_of_the_time(changed):
    """It is looked at each 45 s, as if there were 450 cars, one of which is looked at a step."""
    part = TwinPart()
    out, _ = run(part, [list(chain(*changed[k : k + 450])) for k in (0, 450, 900)])
    assert len(part._cars["n1"]._messages.reports) < 30.0 / EVERY_S
    details = [one.detail for one in out if isinstance(one, PartStatus)]
    assert details[-1] == "1 cars watched, 0 changed, 1 not all the time: they are too many"
    last = [one for one in out if isinstance(one, TwinStatus)][-1]
    assert (last.reason, last.state) == ("", "learning")
    assert 20.0 < last.driven_s < 31.0


def test_car_that_was_away_comes_back_with_its_version(changed):
    file = str(nigel().path)
    version = TwinVersion(number=1, car="nigel", file=file, made_ns=BEGAN_NS, state="adopted")
    part = TwinPart(versions={"n1/1": version})
    _, now_ns = run(part, changed[:20])
    part.step(now_ns + 2 * GONE_NS, [])
    assert part._cars == {}
    out, _ = run(part, changed[:130])
    assert [one.version for one in out if isinstance(one, TwinStatus)] == [1]
