"""Which car would decide whose a change is, and where it would have to drive."""

import pytest
from msgspec.structs import replace

from scm.clock import NS_PER_S, nanoseconds
from scm.records.twins import TwinCause, TwinDrive
from scm.twin.drives import (
    AFTER_NS,
    anywhere,
    deciding_drive,
    drive_in_words,
    is_recent,
    next_drive,
)
from scm.twin.evidence import Witness
from tests.unit.twin.test_causes import BEND, LASTS_S, SINCE_S, change, drives, in_bend

WHERE = {
    "place": {"x_m": BEND[0], "y_m": BEND[1], "radius_m": 0.3},
    "camera": {"camera": "west"},
}


def witnesses():
    """Return the car that changed, one that drives on, and one that stands since the change."""
    stands = drives(3)
    stands.t_s = stands.t_s - (LASTS_S - SINCE_S)
    cars = {"n0": drives(1, in_bend), "n1": drives(2), "n7": stands}
    return {name: Witness(one, 0.0) for name, one in cars.items()}


def drive(kinds, cars=None, reaches=anywhere):
    open_ = {
        kind: TwinCause(kind=kind, probability=0.5, **WHERE.get(kind, {})) for kind in kinds.split()
    }
    return deciding_drive(change(), open_, "n0", cars or witnesses(), reaches)


@pytest.mark.parametrize(
    ("kinds", "words"),
    [
        ("car everywhere", "Let n7 drive for a minute."),
        ("car place", "Let n7 drive through (0.0, 1.0), and n0 elsewhere."),
        ("place everywhere", "Let n0 drive elsewhere, such as through ("),
        ("car camera", "Let n7 drive through (-"),
        ("car tag", "Let n0 drive on."),
    ],
)
def test_car_is_sent_to_where_causes_differ(kinds, words):
    assert drive_in_words(drive(kinds), "n0").startswith(words)


def test_drive_to_what_a_camera_sees_leads_through_what_it_saw_of_the_car():
    found = drive("tag camera")
    assert found.camera == "west"
    assert found.x_m < 0.0
    assert drive_in_words(found, "n0").endswith(", where camera west sees it.")


def test_place_that_is_not_known_is_no_goal():
    unknown = {"car": TwinCause(kind="car", probability=0.5),
               "place": TwinCause(kind="place", probability=0.5)}  # fmt: skip
    found = deciding_drive(change(), unknown, "n0", witnesses(), anywhere)
    assert (found.vehicle, found.x_m) == ("n7", None)


def test_car_that_cannot_get_there_is_not_sent():
    tried = []

    def reaches(vehicle, point):
        tried.append((vehicle, point))
        return vehicle == "n1"

    assert drive("car place", reaches=reaches).vehicle == "n1"
    assert tried == [("n7", BEND), ("n1", BEND)]
    nobody = drive("car place", reaches=lambda vehicle, point: False)
    assert drive_in_words(nobody, "n0").startswith("Let another car drive through (0.0, 1.0)")


def test_car_that_never_drove_there_before_shows_nothing():
    cars = witnesses()
    cars["n7"].evidence.places[:] += 5.0
    assert drive("car place", cars).vehicle == "n1"
    cars["n1"].evidence.t_s += SINCE_S
    assert drive("car place", cars).vehicle == ""


def test_car_that_knows_the_place_better_is_preferred():
    cars = {"n0": witnesses()["n0"], "n1": witnesses()["n7"], "n2": witnesses()["n7"]}
    cars["n1"].evidence.information[:] *= 0.2
    assert drive("car place", cars).vehicle == "n2"


def test_car_that_changed_by_itself_since_is_no_witness():
    cars = witnesses()
    cars["n7"] = Witness(cars["n7"].evidence, 0.0, last_s=SINCE_S + 20.0)
    assert drive("car place", cars).vehicle == "n1"


def test_drive_that_somebody_agreed_to_stays_until_it_ends():
    there = TwinDrive(vehicle="n7", t_ns=1, x_m=0.0, y_m=1.0, sent=1)
    other = replace(there, vehicle="n1", sent=0)
    for state in ("waiting", "under_way"):
        before = replace(there, state=state)
        assert next_drive(replace(change(), drive=before), other) == before
    for state in ("open", "driven", "failed"):
        before = replace(there, state=state)
        assert next_drive(replace(change(), drive=before), other) == replace(other, sent=1)
    near = replace(there, y_m=1.1, sent=0)
    assert next_drive(replace(change(), drive=there), near) == there


@pytest.mark.parametrize(
    ("state", "stays"), [("open", 0), ("waiting", 0), ("under_way", 1), ("driven", 1)]
)
def test_of_what_is_decided_only_a_drive_that_took_place_stays(state, stays):
    before = TwinDrive(vehicle="n7", t_ns=1, state=state)
    after = next_drive(replace(change(), drive=before), None)
    assert after == (before if stays else None)


def test_change_is_judged_while_a_car_drives_for_it_and_a_minute_after():
    sent = TwinDrive(vehicle="n7", t_ns=nanoseconds(SINCE_S), state="driven", sent=1)
    late_ns = sent.t_ns + AFTER_NS + NS_PER_S
    assert is_recent(sent, sent.t_ns + NS_PER_S)
    assert not is_recent(sent, late_ns)
    assert is_recent(replace(sent, state="under_way"), late_ns)
    assert not is_recent(replace(sent, sent=0), sent.t_ns)
    assert not is_recent(None, 0)
