"""Our car beside CommonRoad's models of equal parameters; `docs/evidence.md` shows the pictures."""

import numpy as np
import pytest

pytest.importorskip("vehiclemodels", reason="pip install commonroad-vehicle-models")

from tests.physics import commonroad_twin as twin

CALM = [m for m in twin.MANOEUVRES if m.name != "beyond the grip"]


@pytest.fixture(scope="module", params=CALM, ids=[m.name for m in CALM])
def driven(request):
    mine, angle = twin.ours(request.param)
    return mine, twin.single_track(mine, angle), twin.multi_body(mine, angle)


def rms(values):
    return float(np.sqrt(np.mean(values**2)))


def test_the_multi_body_model_turns_as_our_car_within_one_percent(driven):
    mine, _, multi_body = driven
    assert rms(multi_body.yaw_rate - mine.yaw_rate) < 0.01 * np.abs(mine.yaw_rate).max()


def test_the_single_track_model_turns_as_our_car_within_two_percent(driven):
    mine, single_track, _ = driven
    assert rms(single_track.yaw_rate - mine.yaw_rate) < 0.02 * np.abs(mine.yaw_rate).max()


def test_both_models_end_within_two_centimetres_of_our_car(driven):
    mine, *others = driven
    for other in others:
        assert np.hypot(other.x[-1] - mine.x[-1], other.y[-1] - mine.y[-1]) < 0.02


def test_both_models_slide_sideways_as_our_car(driven):
    mine, *others = driven
    for other in others:
        off = rms(other.lateral_speed - mine.lateral_speed)
        assert off < 0.03 * np.abs(mine.lateral_speed).max()


def test_beyond_the_grip_only_the_multi_body_model_stays_with_our_car():
    mine, angle = twin.ours(twin.MANOEUVRES[-1])
    single_track, multi_body = twin.single_track(mine, angle), twin.multi_body(mine, angle)
    linear = rms(single_track.yaw_rate - mine.yaw_rate)
    assert rms(multi_body.yaw_rate - mine.yaw_rate) < 0.25 * linear
    assert linear > 0.1
