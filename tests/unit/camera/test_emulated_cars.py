"""Rendered cameras see emulated real cars where they are, not where they say."""

import math

import msgspec
import pytest

from scm.camera.part import CameraPart
from scm.clock import NS_PER_MS, NS_PER_S
from scm.eye.part import EyePart
from scm.maps.load import load_map
from scm.v2x.emulated_cars import EmulatedCars
from scm.v2x.exchange import Incoming
from scm.v2x.messages.camera_frame import CameraFrame
from scm.v2x.messages.emulated_pose import EmulatedPose
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.messages.world_snapshot import SnapshotVehicle, WorldSnapshot

CITY = load_map("driving_school")
NOW_NS = 10_000_000_000
CLAIM = SnapshotVehicle(
    vehicle="n7", kind="real", car="nigel", tag_id=7, x_m=1.3, y_m=0.7, yaw_rad=-0.8,
    speed_mps=0.2, steering_rad=0.1, lights=("brake",),
)  # fmt: skip
TRUTH = EmulatedPose(
    vehicle="n7", t_ns=NOW_NS, x_m=0.6, y_m=0.4, yaw_rad=0.3, speed_mps=0.0, steering_rad=0.2
)


def light(*cars, t_ns=NOW_NS):
    return WorldSnapshot(t_ns=t_ns, tick=1, vehicles=cars)


def seen(told, snapshot):
    cars = EmulatedCars()
    for one in told:
        cars.update(one)
    return cars.seen(snapshot).vehicles


def test_a_real_car_is_seen_where_it_is_without_the_lights_it_claims():
    (car,) = seen([TRUTH], light(CLAIM))
    assert (car.x_m, car.y_m, car.yaw_rad, car.steering_rad) == (0.6, 0.4, 0.3, 0.2)
    assert (car.tag_id, car.lights) == (7, ())


def test_the_eye_tells_where_it_truly_is():
    eye = EyePart(CITY, seed=3)
    out = eye.step(NOW_NS, [Incoming(TRUTH, NOW_NS), Incoming(light(CLAIM), NOW_NS)])
    (pose,) = [message for message in out if isinstance(message, EyePose)]
    assert pose.vehicle == "n7"
    assert math.hypot(pose.x_m - 0.6, pose.y_m - 0.4) < 0.01
    assert pose.yaw_rad == pytest.approx(0.3, abs=0.03)


@pytest.mark.parametrize("kind", ["hosted", "remote"])
def test_cars_of_the_world_cannot_be_moved_by_it(kind):
    claim = msgspec.structs.replace(CLAIM, kind=kind)
    assert seen([TRUTH], light(claim)) == (claim,)


def test_real_cars_that_tell_nothing_are_seen_where_they_say():
    other = msgspec.structs.replace(CLAIM, vehicle="n8")
    assert seen([TRUTH], light(other)) == (other,)


def test_it_is_carried_along_its_arc_to_the_picture_s_time():
    moving = msgspec.structs.replace(TRUTH, yaw_rad=0.0, speed_mps=0.25, yaw_rate_radps=0.5)
    (car,) = seen([moving], light(CLAIM, t_ns=NOW_NS + 20_000_000))
    radius, turned = 0.5, 0.01
    assert car.x_m == pytest.approx(0.6 + radius * math.sin(turned), abs=1e-6)
    assert car.y_m == pytest.approx(0.4 + radius * (1.0 - math.cos(turned)), abs=1e-6)
    assert car.yaw_rad == pytest.approx(turned)


def test_who_has_fallen_silent_was_taken_off_the_floor():
    assert seen([TRUTH], light(CLAIM, t_ns=NOW_NS + 999_000_000)) != ()
    assert seen([TRUTH], light(CLAIM, t_ns=NOW_NS + 1_001_000_000)) == ()


def test_a_car_that_the_city_does_not_know_is_seen_by_its_own_tag():
    assert seen([TRUTH], light()) == ()
    (car,) = seen([msgspec.structs.replace(TRUTH, tag_id=9)], light())
    assert (car.tag_id, car.x_m) == (9, 0.6)


def test_its_own_tag_is_drawn_even_if_the_city_gave_another():
    (car,) = seen([msgspec.structs.replace(TRUTH, tag_id=9)], light(CLAIM))
    assert car.tag_id == 9


def test_places_beyond_all_maps_are_not_believed():
    assert seen([msgspec.structs.replace(TRUTH, x_m=1e300)], light(CLAIM)) == (CLAIM,)


def test_a_cars_own_camera_looks_from_where_the_car_truly_is():
    frames = {}
    for name, reports in (("there", [TRUTH]), ("claimed", [])):
        camera = CameraPart(CITY, seed=3)
        camera.attach(lambda kind, where: kind is CameraFrame)
        put = CLAIM if reports else moved_to(TRUTH)
        out = []
        for t_ns in (NOW_NS - 50 * NS_PER_MS, NOW_NS):
            inbox = [Incoming(msgspec.structs.replace(one, t_ns=t_ns), t_ns) for one in reports]
            out += camera.step(t_ns, [*inbox, Incoming(light(put, t_ns=t_ns), t_ns)])
        out += camera.step(NOW_NS + NS_PER_S, [])
        assert EmulatedPose in {one.kind for one in camera.subscriptions}
        frames[name] = [one.payload for one in out if isinstance(one, CameraFrame)]
    assert frames["there"] == frames["claimed"] != []


def moved_to(truth):
    return msgspec.structs.replace(
        CLAIM, x_m=truth.x_m, y_m=truth.y_m, yaw_rad=truth.yaw_rad,
        steering_rad=truth.steering_rad, lights=(),
    )  # fmt: skip
