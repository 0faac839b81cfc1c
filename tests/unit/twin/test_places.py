"""A floor that changed at a place is noticed by all cars that drive there, and nothing else is."""

import math
from dataclasses import replace

import numpy as np
import pytest
from msgspec.structs import replace as replace_struct

from scm.clock import nanoseconds
from scm.twin.causes import located
from scm.twin.evidence import Evidence, Witness
from scm.twin.places import NEW_S, PlaceWatch
from scm.twin.windows import EVERY_S, WatchedNumber

SINCE_S, LAP_S, THRESHOLD = 300.0, 20.0, 9.0
NUMBERS = tuple(
    WatchedNumber(effect, "size", "1", equation, {}, 0.5)
    for effect, equation in (
        ("rolling_resistance", "drive"),
        ("grade", "body"),
        ("gyro_bias", "sensor"),
        ("pose_scale", "sensor"),
    )
)
SIZE = 3.0  # standard deviations of a window, which shows 1 of each number
BEND = (0.0, 1.0)  # the north of the circle that all drive


def drives(seed, missed=lambda t_s, x, y: 0.0, lasts_s=400.0, number=0):
    """Return what a car shows that goes round a circle of 1 m."""
    rng = np.random.default_rng(seed)
    t_s = np.arange(0.0, lasts_s, EVERY_S)
    angle = math.tau * t_s / LAP_S + seed
    places = np.column_stack((np.cos(angle), np.sin(angle)))
    scores = rng.standard_normal((len(t_s), len(NUMBERS)))
    scores[:, number] += missed(t_s, *places.T)
    names = np.full(len(t_s), "west")
    return Evidence(
        NUMBERS, t_s, places, names, scores, np.ones_like(scores), scores, np.ones(len(NUMBERS))
    )


def at_bend(x, y):
    return np.hypot(x - BEND[0], y - BEND[1]) < 0.4


def spilled(t_s, x, y):
    return SIZE * ((t_s >= SINCE_S) & at_bend(x, y))


def everywhere(t_s, x, y):
    return SIZE * (t_s >= SINCE_S)


def look(*cars, now_s=400.0, watch=None):
    watch = watch or PlaceWatch(THRESHOLD)
    return watch.look({f"n{k}": Witness(car, 0.0) for k, car in enumerate(cars)}, now_s)


FELT = tuple(drives(k, spilled) for k in (1, 2, 3))
HEALTHY = tuple(drives(k) for k in (4, 5, 6))


def test_place_is_noticed_with_where_since_when_and_by_whom():
    found = look(*FELT, HEALTHY[0], now_s=360.0)
    assert math.hypot(found.x_m - BEND[0], found.y_m - BEND[1]) < 0.3
    assert found.since_s[1] <= SINCE_S <= found.since_s[2]
    assert found.since_s[2] - found.since_s[1] < 40.0
    assert (found.number.effect, sorted(found.vehicles)) == (
        "rolling_resistance",
        ["n0", "n1", "n2"],
    )
    assert found.size == pytest.approx(SIZE, rel=0.3)
    change = found.as_change()
    assert (change.effect, change.noticed_ns, change.cause) == (
        "rolling_resistance", nanoseconds(360.0), "undecided",
    )  # fmt: skip
    assert change.since_low_ns <= change.since_ns <= change.since_high_ns
    assert found.in_words().endswith("s: as by rolling_resistance")
    assert " and n" in found.in_words()


def test_nothing_is_noticed_before_nor_where_nothing_changed():
    assert look(*FELT, now_s=SINCE_S) is None
    assert look(*HEALTHY) is None


@pytest.mark.parametrize(
    "changed",
    [
        drives(1, lambda *at: 2.0 * spilled(*at)),  # as it never drove before, in one bend
        drives(1, lambda *at: 2.0 * everywhere(*at)),
    ],
)
def test_what_one_car_shows_is_no_place(changed):
    assert look(changed, *HEALTHY) is None
    assert look(changed) is None


def test_what_is_everywhere_is_no_place():
    more = [drives(k, lambda *at: everywhere(*at) + spilled(*at)) for k in (1, 2, 3)]
    assert look(*(drives(k, everywhere) for k in (1, 2, 3))) is None
    assert look(*more) is None  # as a slope, which shows at its ends most


def test_car_that_changed_itself_meanwhile_shows_the_place_only_if_it_felt_it():
    both = drives(1, lambda *at: spilled(*at) + everywhere(*at))
    found = look(both, *FELT[1:], HEALTHY[0])
    assert math.hypot(found.x_m - BEND[0], found.y_m - BEND[1]) < 0.3
    assert "n0" in found.vehicles
    assert sorted(look(drives(1, everywhere), *FELT).vehicles) == ["n1", "n2", "n3"]


@pytest.mark.parametrize("step", [0.05, 10.0])
def test_floor_does_not_change_by_more_than_floors_do_nor_by_what_does_not_matter(step):
    numbers = tuple(replace(one, step=step) for one in NUMBERS)
    assert look(*(replace(one, numbers=numbers) for one in FELT)) is None


def test_what_a_car_drove_before_it_changed_itself_does_not_count():
    cars = {f"n{k}": Witness(one, 0.0, first_s=SINCE_S) for k, one in enumerate(FELT)}
    assert PlaceWatch(THRESHOLD).look(cars, 400.0) is None


def test_where_a_car_never_was_before_it_shows_no_change():
    """Two cars drive in the south first: they cannot say how the bend was."""
    late = []
    for one in FELT[:2]:
        before = (one.t_s < SINCE_S) & (one.places[:, 1] > 0.0)
        late.append(replace(one, **{
            name: getattr(one, name)[~before]
            for name in ("t_s", "places", "cameras", "scores", "information", "whole")
        }))  # fmt: skip
    assert look(*late, watch=PlaceWatch(5.0)) is None


def test_car_that_has_just_changed_itself_shows_no_place():
    changed = [replace(one, is_steady=False) for one in FELT[:2]]
    assert look(*changed, FELT[2]) is None
    assert look(changed[0], *FELT[1:]).vehicles == ("n1", "n2")


def test_cars_have_to_be_known_for_as_long_as_for_changes_of_their_own():
    new = [
        replace(one, **{
            name: getattr(one, name)[one.t_s > SINCE_S - 100.0]
            for name in ("t_s", "places", "cameras", "scores", "information", "whole")
        })
        for one in FELT
    ]  # fmt: skip
    assert look(*new) is None


def test_floor_biases_no_gyro():
    assert look(*(drives(k, spilled, number=2) for k in (1, 2, 3))) is None


def test_place_is_noticed_once_and_its_end_later():
    def for_a_while(t_s, x, y):
        return spilled(t_s, x, y) * (t_s < SINCE_S + NEW_S + 60.0)

    cars = [drives(k, for_a_while, 1200.0) for k in (1, 2, 3)]
    watch = PlaceWatch(THRESHOLD)
    times = np.arange(240.0, 1200.0, 30.0)
    found = [one for now_s in times if (one := look(*cars, now_s=now_s, watch=watch))]
    assert [one.size > 0.0 for one in found] == [True, False]
    assert found[0].noticed_s < SINCE_S + 90.0
    assert found[1].since_s[1] <= SINCE_S + NEW_S + 60.0 <= found[1].since_s[2]


def test_what_spreads_around_a_place_is_the_same():
    def spreading(t_s, x, y):
        wide = (t_s >= SINCE_S + 150.0) & (np.hypot(x - BEND[0], y - BEND[1]) < 0.8)
        return spilled(t_s, x, y) + 2.0 * SIZE * wide

    cars, watch = [drives(k, spreading, 800.0) for k in (1, 2, 3)], PlaceWatch(THRESHOLD)
    times = np.arange(240.0, 800.0, 30.0)
    assert sum(look(*cars, now_s=now_s, watch=watch) is not None for now_s in times) == 1


def test_change_of_a_place_is_judged_by_what_floors_do_and_that_of_a_car_is_not():
    """A camera changed as well, and shows more than the spill does."""

    def seen(t_s, x, y):
        return 9.0 * ((t_s >= SINCE_S) & (x < 0.0))

    cars = [replace(drives(k, spilled), cameras=np.where(one.places[:, 0] < 0.0, "west", "east"))
            for k, one in enumerate(FELT, 1)]  # fmt: skip
    for one in cars:
        one.scores[:, 3] += seen(one.t_s, *one.places.T)
    shown, watch = {f"n{k}": Witness(one, 0.0) for k, one in enumerate(cars)}, PlaceWatch(THRESHOLD)
    change = watch.look(shown, 400.0).as_change()
    assert located(change, "n0", shown, watch).cause == "place"
    of_a_car = replace_struct(change, noticed_ns=change.noticed_ns - 1)
    assert located(of_a_car, "n0", shown, watch).cause == "camera"


def test_car_that_changed_itself_is_no_witness_of_a_place():
    changed = drives(4, lambda *at: 9.0 * everywhere(*at), number=1)
    watch, both = PlaceWatch(THRESHOLD), {"n0": FELT[0], "n1": FELT[1]}
    shown = {name: Witness(one, 0.0) for name, one in both.items()}
    change = watch.look(shown, 400.0).as_change()
    unsteady = replace(changed, is_steady=False)
    causes = [
        located(change, "n0", {**shown, "n2": Witness(one, 0.0)}, watch).cause
        for one in (unsteady, changed)
    ]
    assert causes == ["place", "everywhere"]


def test_cars_of_another_kind_are_left_out_and_those_of_another_version_are_not():
    def of(numbers):
        return replace(FELT[1], numbers=numbers)

    other = tuple(replace(one, effect="tyre_grip") for one in NUMBERS)
    version = tuple(replace(one, numbers={("car", "x"): 1.0}) for one in NUMBERS)
    assert look(FELT[0], of(other)) is None
    assert look(FELT[0], of(version)) is not None
