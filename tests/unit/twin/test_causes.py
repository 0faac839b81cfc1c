"""Whose change it is, by what all cars show where and when."""

import math

import numpy as np
import pytest
from msgspec import structs

from scm.clock import NS_PER_S, nanoseconds
from scm.records.twins import TwinChange, TwinDrive
from scm.twin.causes import JUDGED_AFTER_S, cause_in_words, causes_of, located
from scm.twin.evidence import Evidence, Witness
from scm.twin.windows import EVERY_S, WatchedNumber

SINCE_S, LASTS_S, LAP_S = 300.0, 420.0, 20.0
NUMBERS = tuple(
    WatchedNumber(effect, "size", "1", equation, {}, 1.0)
    for effect, equation in (
        ("rolling_resistance", "drive"),
        ("steer_trim", "steering"),
        ("pose_point", "sensor"),
        ("camera_tilt", "sensor"),
    )
)
ROLLING, TRIM, POINT, TILT = range(len(NUMBERS))
SIZE = 1.0  # standard deviations of a window
BEND = (0.0, 1.0)  # the north of the circle that all drive


def drives(seed, is_affected=lambda t_s, x, y: False, number=ROLLING, usually=None):
    """Return what a car shows that goes round a circle of 1 m, with a change of one number."""
    rng = np.random.default_rng(seed)
    t_s = np.arange(0.0, LASTS_S, EVERY_S)
    angle = math.tau * t_s / LAP_S + seed
    places = np.column_stack((np.cos(angle), np.sin(angle)))
    scores = rng.standard_normal((len(t_s), len(NUMBERS)))
    scores[:, number] += SIZE * is_affected(t_s, *places.T)
    if usually is not None:
        scores[:, ROLLING] += usually(*places.T)
    cameras = np.where(places[:, 0] < 0.0, "west", "east")
    return Evidence(
        NUMBERS, t_s, places, cameras, scores, np.ones_like(scores), scores, np.ones(len(NUMBERS))
    )


def since(t_s, x, y):
    return t_s >= SINCE_S


def in_bend(t_s, x, y):
    return (t_s >= SINCE_S) & (np.hypot(x - BEND[0], y - BEND[1]) < 0.35)


def under_west(t_s, x, y):
    return (t_s >= SINCE_S) & (x < 0.0)


def causes(*cars, **others):
    """Return what changed `n0`, the first of some cars."""
    every = {f"n{k}": Witness(car, 0.0) for k, car in enumerate(cars)} | others
    return causes_of("n0", (SINCE_S, SINCE_S - 2.0, SINCE_S + 2.0), every)


@pytest.mark.parametrize(
    ("kind", "cars"),
    [
        ("car", [drives(1, since, TRIM), drives(2), drives(3)]),
        ("tag", [drives(1, since, POINT), drives(2), drives(3)]),
        ("place", [drives(1, in_bend), drives(2, in_bend), drives(3, in_bend)]),
        ("camera", [drives(k, under_west, TILT) for k in (1, 2, 3)]),
        ("everywhere", [drives(1, since), drives(2, since), drives(3, since)]),
    ],
)
def test_each_cause_is_found_where_other_cars_drive_too(kind, cars):
    found = causes(*cars)
    assert found[0].kind == kind
    assert found[0].probability > 0.9
    assert sum(one.probability for one in found) == pytest.approx(1.0)
    if kind == "place":
        assert math.hypot(found[0].x_m - BEND[0], found[0].y_m - BEND[1]) < 0.15
        assert 0.15 < found[0].radius_m < 0.35
    assert found[0].camera == ("west" if kind == "camera" else "")


def test_one_car_alone_does_not_tell_its_change_from_that_of_everything():
    found = {one.kind: one.probability for one in causes(drives(1, since))}
    assert found["car"] < 0.9
    assert found["everywhere"] > 0.1


@pytest.mark.parametrize("information", [1.0, 1e-3])
def test_change_that_one_car_alone_shows_at_a_place_is_not_the_floor_s(information):
    """Others drive there and show nothing, however little they could show."""

    def shown(kind):
        others = [drives(k) for k in (2, 3)]
        for one in others:
            one.scores, one.information = (
                one.scores * information**0.5,
                one.information * information,
            )
        found = causes(drives(1, lambda *at: 4.0 * in_bend(*at)), *others)
        return {one.kind: one.probability for one in found}[kind]

    assert shown("place") < 0.9
    if information == 1.0:
        assert shown("car") > 0.9


def test_bend_where_a_car_always_strays_is_no_place_that_changed():
    """Both drive on as before, the first with a change of its own."""

    def usually(x, y):
        return 2.0 * (y > 0.8)

    changed = drives(1, since, TRIM, usually=usually)
    assert causes(changed, drives(2, usually=usually))[0].kind == "car"


def test_car_that_changed_by_itself_at_another_time_is_no_witness_from_then_on():
    other = drives(2, lambda t_s, x, y: t_s >= SINCE_S + 20.0)
    found = causes(drives(1, since), n1=Witness(other, 0.0, last_s=SINCE_S + 20.0))
    assert found[0].kind == "car"
    assert causes(drives(1, since), other)[0].kind == "everywhere"


def test_cars_are_compared_by_the_city_s_clock():
    """By its own clock it changed at the same time: that was long before."""
    found = causes(drives(1, since), n1=Witness(drives(2, since), -200.0))
    assert found == causes(drives(1, since))


def test_car_that_was_not_watched_before_is_no_witness():
    late = drives(2, lambda t_s, x, y: t_s >= 0.0)
    late.t_s = late.t_s + SINCE_S
    found = {one.kind: one.probability for one in causes(drives(1, since), late)}
    alone = {one.kind: one.probability for one in causes(drives(1, since))}
    assert found == pytest.approx(alone, abs=1e-6)


def test_car_that_changed_when_the_floor_did_is_judged_off_that_place():
    def both(t_s, x, y):
        return 4.0 * in_bend(t_s, x, y) + since(t_s, x, y)

    def is_off(places):
        return np.hypot(*(places - BEND).T) > 0.85

    def judged(first, is_off=None):
        others = [drives(k, lambda *at: 4.0 * in_bend(*at)) for k in (2, 3)]
        cars = {f"n{k}": Witness(car, 0.0) for k, car in enumerate([first, *others])}
        return causes_of("n0", (SINCE_S, SINCE_S - 2.0, SINCE_S + 2.0), cars, is_off)[0].kind

    changed, felt = drives(1, both), drives(1, lambda *at: 4.0 * in_bend(*at))
    assert judged(changed) == "place"
    assert judged(changed, is_off) == "car"
    assert judged(felt, is_off) == "place"


def test_little_that_a_plain_change_of_the_floor_leaves_elsewhere_is_no_change_of_the_car():
    def is_off(places):
        return np.hypot(*(places - BEND).T) > 0.85

    def judged(floor, left):
        def felt(*at):
            return floor * in_bend(*at) + left * since(*at)

        cars = {f"n{k}": Witness(drives(k, felt), 0.0) for k in (1, 2, 3)}
        times_s = (SINCE_S, SINCE_S - 2.0, SINCE_S + 2.0)
        return causes_of("n1", times_s, cars, is_off)[0].kind

    assert judged(8.0, 0.4) == "place"
    assert judged(2.0, 0.4) != "place"  # as much, beside less


def test_no_floor_moves_a_tag():
    first, *_ = causes(drives(1, since, POINT))
    assert (first.kind, first.probability > 0.9) == ("tag", True)


def change():
    since_ns = nanoseconds(SINCE_S)
    return TwinChange(
        noticed_ns=since_ns + 10 * NS_PER_S, since_ns=since_ns, since_low_ns=since_ns - NS_PER_S,
        since_high_ns=since_ns + NS_PER_S, effect="rolling_resistance", parameter="size",
        size=0.05, unit="1", score=12.0,
    )  # fmt: skip


def test_what_was_decided_to_be_a_place_s_is_not_made_a_car_s_later():
    cars = {"n0": Witness(drives(1, since), 0.0), "n1": Witness(drives(2), 0.0)}
    for before, then in (("undecided", "car"), ("everywhere", "car"), ("place", "place")):
        assert located(structs.replace(change(), cause=before), "n0", cars).cause == then


def test_change_says_whose_it_is_and_does_not_change_by_a_hair():
    cars = {f"n{k}": Witness(drives(k + 1, in_bend), 0.0) for k in range(3)}
    found = located(change(), "n0", cars)
    assert (found.cause, found.decide_by) == ("place", "")
    assert cause_in_words(found, "n0").startswith("Not n0 changed but the floor, within 0.")
    for car in cars.values():
        car.evidence.t_s[-3:] = math.inf  # not driven yet
    assert located(found, "n0", cars) == found


def test_undecided_change_says_which_car_would_decide():
    alone = located(change(), "n0", {"n0": Witness(drives(1, since), 0.0)})
    assert alone.cause == "undecided"
    assert alone.decide_by == "Let another car drive for a minute."
    assert alone.drive == TwinDrive(vehicle="", t_ns=change().noticed_ns)


def test_change_since_which_little_was_driven_is_not_judged_yet():
    cars = {f"n{k}": Witness(drives(k + 1, in_bend), 0.0) for k in range(3)}
    early = structs.replace(change(), since_ns=nanoseconds(LASTS_S - JUDGED_AFTER_S + 1.0))
    assert located(early, "n0", cars) is None


def test_car_whose_evidence_is_of_later_shows_nothing_of_the_change():
    later = drives(1, since)
    later.t_s = later.t_s + SINCE_S
    assert located(change(), "n0", {"n0": Witness(later, 0.0)}) is None
    assert located(change(), "n0", {"n1": Witness(later, 0.0)}) is None
