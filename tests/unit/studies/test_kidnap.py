import math

import pytest

from studies.kidnap import STEP_S, measures

KNOWN, WRONG, UNKNOWN = (True, True, 0.0), (True, False, 0.1), (False, False, 0.2)


def test_car_has_recovered_when_its_pose_begins_to_stay_right():
    found = measures([WRONG, KNOWN, UNKNOWN, UNKNOWN, *[KNOWN] * 300])
    assert found["recovered"] == 1.0
    assert found["recovered_s"] == pytest.approx(5 * STEP_S)
    assert found["wrong_s"] == pytest.approx(STEP_S)
    assert found["stood_s"] == pytest.approx(2 * STEP_S)
    assert (found["wrong_m"], found["unknown_m"]) == (0.1, 0.4)


@pytest.mark.parametrize("steps", [[*[KNOWN] * 200, WRONG] * 3, [UNKNOWN] * 300])
def test_car_that_is_wrong_again_or_never_knows_has_not_recovered(steps):
    found = measures(steps)
    assert found["recovered"] == 0.0
    assert math.isnan(found["recovered_s"])


def test_car_that_recovers_late_is_not_soon():
    found = measures([*[UNKNOWN] * 251, *[KNOWN] * 300])
    assert found["recovered"] == 0.0
    assert found["recovered_s"] == pytest.approx(252 * STEP_S)
