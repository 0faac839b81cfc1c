"""Slots: the lowest number first, nothing of the last car left in them, and a city that is full."""

import pytest

from scm.errors import RunError
from scm.geometry import Pose2
from scm.world.slots import IDLE, Numbers, Slots

SOMEWHERE = Pose2(1.0, 2.0, 0.5)


def test_numbers_come_back_lowest_first_and_the_forbidden_one_never():
    numbers = Numbers(3, never=(5,))
    taken = [numbers.take() for _ in range(4)]
    numbers.give_back(6)
    numbers.give_back(4)
    assert taken == [3, 4, 6, 7]
    assert [numbers.take() for _ in range(3)] == [4, 6, 8]


def test_a_claimed_number_is_nobody_elses_until_it_is_given_back():
    numbers = Numbers(1, never=(2,))
    assert numbers.claim(3) == 3
    assert [numbers.take() for _ in range(3)] == [1, 4, 5]
    numbers.give_back(3)
    numbers.give_back(4)
    numbers.claim(4)
    assert [numbers.take(), numbers.take()] == [3, 6]
    numbers.give_back(4)
    assert numbers.take() == 4


def test_a_number_below_the_first_is_claimed_and_never_given():
    numbers = Numbers(5)
    numbers.give_back(numbers.claim(2))
    numbers.give_back(numbers.claim(9))
    assert [numbers.take() for _ in range(6)] == [5, 6, 7, 8, 9, 10]


def test_a_slot_is_given_again_clean():
    slots = Slots(2)
    first = slots.take("n1", SOMEWHERE, hosted=True)
    slots.driven[first] = slots.hazard[first] = slots.arrived[first] = True
    slots.throttle[first], slots.mode[first], slots.seq[first] = 0.5, 0, 7
    slots.free(first)
    again = slots.take("n2", SOMEWHERE, hosted=False)
    assert (again, slots.names[again], bool(slots.hosted[again])) == (first, "n2", False)
    left = [bool(flags[again]) for flags in (slots.driven, slots.hazard, slots.arrived)]
    assert left == [False, False, False]
    assert (slots.throttle[again], slots.mode[again], slots.seq[again]) == (0.0, IDLE, 0)


def test_a_full_city_takes_nobody_until_somebody_leaves():
    slots = Slots(1)
    slots.take("n1", SOMEWHERE, hosted=True)
    with pytest.raises(RunError, match="1 cars"):
        slots.take("n2", SOMEWHERE, hosted=True)
    slots.free(0)
    assert slots.take("n2", SOMEWHERE, hosted=True) == 0


def test_the_nearest_car_is_looked_for_among_those_that_are_there():
    slots = Slots(3)
    here = Pose2(0.0, 0.0, 0.0)
    assert slots.nearest_m(here) == float("inf")
    gone = slots.take("n1", Pose2(0.1, 0.0, 0.0), hosted=True)
    slots.take("n2", Pose2(3.0, 2.0, 0.0), hosted=False)
    slots.free(gone)
    assert slots.nearest_m(here) == 5.0


def test_a_car_that_comes_counts_from_where_it_soon_will_be_and_one_that_goes_does_not():
    slots = Slots(2)
    place = Pose2(1.0, 0.0, 0.0)
    comes = slots.take("n1", Pose2(0.4, 0.0, 0.0), hosted=True)
    slots.speed[comes] = 0.25
    assert slots.nearest_m(place) == pytest.approx(0.6)
    assert slots.nearest_m(place, ahead_s=1.5) == pytest.approx(0.6 - 1.5 * 0.25)
    slots.speed[comes] = -0.25
    assert slots.nearest_m(place, ahead_s=1.5) == pytest.approx(0.6)
    slots.speed[comes] = 0.8  # it will have passed by then: it counts from where it is nearest
    assert slots.nearest_m(place, ahead_s=1.5) == pytest.approx(0.0, abs=1e-9)
