"""Scenes of the independent reality: what changes, of whom, when and how far."""

import math

import numpy as np
import pytest

from tests.reality.concealed import Drawn
from tests.reality.numbers import nominal
from tests.reality.scenes import Event, Scene, draw_scene, label_of

USUAL = {"n1": nominal("nigel"), "n2": nominal("nigel")}
CAMERAS, PLACES = ("west", "east"), [(0.5, 0.5), (2.0, 1.0)]


def event(kind, of, adds, since=10.0, until=10.0, back=math.inf, **parameters):
    drawn = Drawn(parameters, adds)
    return Event(kind, of, "step", (("steer_trim", 2.0, drawn),), since, until, back)


def drawn(seed, seconds=7200.0, **more):
    rng = np.random.default_rng(seed)
    return draw_scene(
        ("n1", "n2"), seconds, rng, car="nigel", cameras=CAMERAS, places=PLACES, **more
    )


def test_own_change_is_of_one_car_and_another_of_all():
    scene = Scene(USUAL, [event("car", "n1", {"trim": 0.1}), event("everywhere", "", {"slope": 1})])
    assert [scene.numbers(car, 20.0)["trim"] for car in USUAL] == [0.1, 0.0]
    assert [scene.numbers(car, 20.0)["slope"] for car in USUAL] == [1.0, 1.0]
    assert scene.numbers("n1", 9.0) is USUAL["n1"]


def test_numbers_are_the_same_object_until_they_change():
    scene = Scene(USUAL, [event("car", "n1", {"trim": 0.1}, back=30.0)])
    assert scene.numbers("n1", 20.0) is scene.numbers("n1", 25.0)
    assert scene.numbers("n1", 31.0)["trim"] == 0.0


def test_ramp_grows_evenly_upon_what_was_before():
    scene = Scene(
        USUAL, [event("car", "n1", {"trim": 0.1}), event("car", "n1", {"trim": 0.2}, 20.0, 30.0)]
    )
    assert scene.numbers("n1", 25.0)["trim"] == pytest.approx(0.2)
    assert scene.numbers("n1", 40.0)["trim"] == pytest.approx(0.3)


def test_every_car_feels_the_nearest_of_what_was_spilled():
    def spilled(x):
        adds = {"patch_x": x, "patch_y": 0.0, "patch_radius": 0.29, "patch_rolling": x}
        return event("place", "", adds, x_m=x, y_m=0.0, radius_m=0.3)

    scene = Scene(USUAL, [spilled(1.0), spilled(3.0)])
    for car in USUAL:
        assert scene.numbers(car, 20.0, 1.2, 0.0)["patch_x"] == 1.0
        assert scene.numbers(car, 20.0, 2.9, 0.0)["patch_x"] == 3.0
        assert scene.numbers(car, 9.0, 2.9, 0.0)["patch_rolling"] == 0.0


def test_tag_and_camera_are_seen_and_not_driven():
    scene = Scene(
        USUAL, [event("tag", "n1", {"point_x": 0.01}), event("camera", "east", {"tilt_x": 0.1})]
    )
    assert scene.numbers("n1", 20.0) is USUAL["n1"]
    assert scene.faults("n1", 20.0)["point_x"] == 0.01
    assert scene.faults("n2", 20.0)["point_x"] == 0.0
    assert scene.camera_faults("east", 20.0)["tilt_x"] == 0.1
    assert scene.camera_faults("west", 20.0)["tilt_x"] == 0.0


def test_scenes_have_all_kinds_and_courses_singly_and_two_at_once():
    scenes = [drawn(seed) for seed in range(20)]
    events = [one for scene in scenes for one in scene.events]
    assert {one.kind for one in events} == {"car", "tag", "place", "camera", "everywhere"}
    assert {one.course for one in events} == {"step", "ramp", "intermittent"}
    begins = [[one.since for one in scene.events] for scene in scenes]
    assert any(len(set(times)) < len(times) for times in begins)
    assert all(400.0 <= one.since < 6900.0 for one in events)
    assert all(one.of in CAMERAS for one in events if one.kind == "camera")
    assert len({one.effects[0][0] for one in events if one.kind == "car"}) > 10
    spots = {(p["x_m"], p["y_m"]) for one in events if one.kind == "place"
             for p in [one.effects[0][2].parameters]}  # fmt: skip
    assert spots == set(PLACES)


def test_nothing_happens_to_healthy_cars():
    assert drawn(1, healthy=True).events == ()


def test_label_says_what_changed_whose_and_when():
    scene = drawn(3)
    label = label_of(scene, "nigel")
    for change, one in zip(label["changes"], scene.events, strict=True):
        assert (change["whose"], change["of"], change["begins_s"]) == (one.kind, one.of, one.since)
        assert change["ends_s"] == (None if one.back == math.inf else one.back)
        assert change["names"] == [one.effects[0][0]]
    assert set(label["ordinary"]) == {"n1", "n2"}
