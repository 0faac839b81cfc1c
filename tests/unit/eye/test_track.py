"""Tracks: motion between sightings, order, gates, identity, hand-over, age."""

import math
from dataclasses import replace

import numpy as np
import pytest

from scm.eye.track.motion import predict
from scm.eye.track.perception import collective_perception
from scm.eye.track.sighting import Sighting
from scm.eye.track.tracks import MAX_CAMERAS, MAX_CARS, MEMORY_NS, Tracks
from scm.geometry import Pose2
from scm.v2x.message import decode, encode
from scm.v2x.messages.cpm import CpmTx

FRAME_NS = 33_000_000
START_NS = 1_000_000_000
WHITE = np.diag([2e-4, 2e-4, 8e-4]) ** 2
SHARED = np.diag([1e-3, 1e-3, 1e-3]) ** 2


def saw(x, y, frame, yaw=0.0, camera="a", vehicle="n1", tag_id=1, **more):
    return Sighting(
        camera, tag_id, vehicle, START_NS + frame * FRAME_NS, Pose2(x, y, yaw),
        WHITE + SHARED + more.get("common_mode", 0.0), SHARED, **more,
    )  # fmt: skip


def drive(tracks, frames, speed=0.26, first=0, **more):
    """Sightings of a car going along x from x = 0 at frame 0."""
    for frame in range(first, first + frames):
        one = saw(speed * frame * FRAME_NS * 1e-9, 0.5, frame, **more)
        tracks.see([one], one.t_ns)
    return START_NS + (first + frames - 1) * FRAME_NS


def only(tracks, t_ns):
    (track,) = tracks.at(t_ns)
    return track


@pytest.mark.parametrize("speed", [0.26, 4.0])
def test_a_steady_car_is_told_ahead_of_its_last_sighting_and_with_its_speed(speed):
    tracks = Tracks()
    last = drive(tracks, 30, speed)
    track = only(tracks, last + 50_000_000)
    ahead = speed * ((last - START_NS) * 1e-9 + 0.05)
    assert track.x_m == pytest.approx(ahead, abs=1e-3 + 0.01 * speed * 0.05)
    assert track.speed_mps == pytest.approx(speed, rel=0.02)
    assert (track.flags, track.cameras, track.stale) == ((), ("a",), False)


def test_a_car_going_round_is_told_on_its_circle():
    tracks, radius, turn = Tracks(), 0.5, 0.52
    for frame in range(60):
        yaw = turn * frame * FRAME_NS * 1e-9
        one = saw(radius * math.sin(yaw), -radius * math.cos(yaw), frame, yaw)
        tracks.see([one], one.t_ns)
    yaw = turn * (59 * FRAME_NS * 1e-9 + 0.2)
    track = only(tracks, one.t_ns + 200_000_000)
    assert (track.x_m, track.y_m) == pytest.approx(
        (radius * math.sin(yaw), -radius * math.cos(yaw)), abs=2e-3
    )
    assert track.yaw_rate_rad_s == pytest.approx(turn, rel=0.02)


def test_the_slope_of_the_prediction_is_that_of_its_differences():
    mean = np.array([[0.3, 0.2, 0.7, 1.1, 0.05, 0.9, 1e-3, -1e-3, 2e-3]])
    dt, nothing = np.array([0.05]), np.zeros((1, 1, 3, 3))
    none = predict(mean, np.zeros((1, 9, 9)), nothing, dt)[1]
    for state in range(6):
        step = np.zeros(9)
        step[state] = 1e-6
        up, down = (predict(mean + d, np.zeros((1, 9, 9)), nothing, dt)[0] for d in (step, -step))
        slope = ((up - down) / 2e-6)[0]
        if state == 3:
            slope[6:] = 0.0  # that a fast car loses its offset sooner is left out
        direction = np.outer(step, step)[None] * 1e12
        grown = predict(mean, direction, nothing, dt)[1] - none
        np.testing.assert_allclose(grown[0], np.outer(slope, slope), atol=2e-3)


def test_doubt_grows_while_a_car_is_hidden_until_it_is_stale_and_dropped():
    tracks = Tracks()
    last = drive(tracks, 30)
    stds = [only(tracks, last + ms * 1_000_000).covariance[0, 0] ** 0.5 for ms in (0, 200, 400)]
    assert stds[0] < stds[1] < stds[2] < 0.1
    assert not only(tracks, last + 499_000_000).stale
    assert only(tracks, last + 501_000_000).stale
    assert tracks.at(last + MEMORY_NS + 1) == ()


def test_one_cameras_sightings_do_not_average_its_offset_away():
    tracks = Tracks()
    last = drive(tracks, 300)
    covariance = only(tracks, last).covariance
    assert covariance[0, 0] > 0.9 * SHARED[0, 0]
    assert covariance[2, 2] > 0.9 * SHARED[2, 2]


def test_late_frames_of_another_camera_give_what_they_would_have_given_in_time():
    rng = np.random.default_rng(4)
    frames = []
    for frame in range(40):
        x = 0.26 * frame * FRAME_NS * 1e-9
        a, b = 2e-4 * rng.standard_normal(2)
        frames.append(saw(x + a, 0.5, frame, camera="ab"[frame % 2]))
        frames[-1] = frames[-1] if frame % 2 else saw(x + b, 0.5, frame, camera="a")
    ordered, mixed = Tracks(), Tracks()
    for one in frames:
        ordered.see([one], one.t_ns)
    for one, two in zip(frames[::2], frames[1::2], strict=True):
        mixed.see([two], two.t_ns)
        mixed.see([one], two.t_ns)
    now = frames[-1].t_ns
    assert mixed.refused == 0
    assert only(mixed, now).x_m == only(ordered, now).x_m
    np.testing.assert_array_equal(only(mixed, now).covariance, only(ordered, now).covariance)


def test_a_frame_that_comes_too_late_or_from_the_future_is_refused_and_counted():
    tracks = Tracks()
    last = drive(tracks, 15)
    tracks.at(last)
    tracks.see([saw(0.0, 0.5, 1)], last)
    tracks.see([saw(0.0, 0.5, 30)], last)
    tracks.see([saw(math.nan, 0.5, 10)], last)
    assert tracks.refused == 3
    assert only(tracks, last).t_ns == last
    assert only(tracks, last).age_s == 0.0


def test_one_wild_sighting_leaves_the_track_alone():
    tracks, calm = Tracks(), Tracks()
    drive(tracks, 20)
    drive(calm, 20)
    wild = saw(1.5, 1.0, 20)
    tracks.see([wild], wild.t_ns)
    assert only(tracks, wild.t_ns).x_m == only(calm, wild.t_ns).x_m


def test_a_car_carried_elsewhere_is_followed_after_three_agreeing_sightings():
    tracks = Tracks()
    drive(tracks, 20)
    places = []
    for frame in range(20, 23):
        there = saw(1.5, 1.0, frame)
        tracks.see([there], there.t_ns)
        places.append(only(tracks, there.t_ns).x_m)
    assert max(places[:2]) < 0.3
    assert places[2] == pytest.approx(1.5)
    assert "jumped" in only(tracks, there.t_ns).flags


def test_wild_sightings_that_do_not_agree_never_move_it():
    tracks = Tracks()
    drive(tracks, 20)
    for frame in range(20, 26):
        there = saw(1.5 if frame % 2 else 2.8, 1.0, frame)
        tracks.see([there], there.t_ns)
    assert only(tracks, there.t_ns).x_m < 0.3


def test_two_places_with_one_id_are_a_duplicate_and_the_track_stays():
    tracks = Tracks()
    drive(tracks, 20)
    for frame in range(20, 28):
        x = 0.26 * frame * FRAME_NS * 1e-9
        here, there = saw(x, 0.5, frame), saw(1.5, 1.0, frame, camera="b")
        tracks.see([here, there], here.t_ns)
    track = only(tracks, here.t_ns)
    assert track.x_m == pytest.approx(x, abs=2e-3)
    assert "duplicate" in track.flags


def test_two_cameras_a_little_apart_disagree():
    tracks = Tracks()
    drive(tracks, 20)
    for frame in range(20, 28):
        x = 0.26 * frame * FRAME_NS * 1e-9
        here, there = saw(x, 0.5, frame), saw(x + 0.03, 0.5, frame, camera="b")
        tracks.see([here, there], here.t_ns)
    assert only(tracks, here.t_ns).flags == ("disagree",)


def test_a_tag_of_nobody_is_unknown_and_a_car_seen_once_is_tentative():
    tracks = Tracks()
    one = saw(1.0, 1.0, 0, vehicle="tag-9", tag_id=9)
    tracks.see([one], one.t_ns)
    assert only(tracks, one.t_ns).flags == ("tentative", "unknown")


def test_another_id_in_the_place_of_a_car_is_wrong():
    tracks = Tracks()
    drive(tracks, 20)
    last = drive(tracks, 5, first=20, vehicle="n2", tag_id=2)
    flags = {track.vehicle: track.flags for track in tracks.at(last)}
    assert flags == {"n1": (), "n2": ("wrong_id",)}


def test_a_car_whose_tag_changes_is_flagged():
    tracks = Tracks()
    drive(tracks, 20)
    last = drive(tracks, 1, first=20, tag_id=5)
    assert only(tracks, last).flags == ("wrong_id",)


def test_what_is_wrong_with_a_camera_is_said_of_its_tracks():
    tracks = Tracks()
    last = drive(tracks, 5, flags=("bumped",))
    assert only(tracks, last).flags == ("bumped",)
    last = drive(tracks, 5, first=5)
    assert only(tracks, last).flags == ()


def test_a_car_passes_from_one_camera_to_another_without_a_jump():
    tracks, places = Tracks(), []
    for frame in range(90):
        x = 0.26 * frame * FRAME_NS * 1e-9
        seen = []
        if frame < 60:
            seen.append(saw(x + 1e-3, 0.5, frame))
        if frame >= 30:
            seen.append(saw(x - 1.5e-3, 0.5, frame, camera="b"))
        tracks.see(seen, seen[0].t_ns)
        places.append(only(tracks, seen[0].t_ns).x_m - x)
    steps = np.abs(np.diff(places[20:]))
    assert steps.max() < 5e-4, "the cameras are 2.5 mm apart"
    assert only(tracks, seen[0].t_ns).cameras == ("b",)


def test_lean_that_all_cameras_share_is_never_less_than_itself():
    tracks, common_mode = Tracks(), np.diag([4e-4, 4e-4, 0.0]) ** 2
    last = drive(tracks, 60, common_mode=common_mode)
    assert only(tracks, last).covariance[0, 0] > common_mode[0, 0] + 0.8 * SHARED[0, 0]


def test_fifty_cars_keep_their_own_names():
    tracks = Tracks()
    for frame in range(5):
        seen = [saw(0.1 * i, 0.5, frame, vehicle=f"n{i}", tag_id=i) for i in range(50)]
        tracks.see(seen, seen[0].t_ns)
    found = {track.vehicle: round(track.x_m, 3) for track in tracks.at(seen[0].t_ns)}
    assert found == {f"n{i}": round(0.1 * i, 3) for i in range(50)}


def test_tracks_are_told_as_collective_perception_in_its_own_units():
    tracks = Tracks()
    last = drive(tracks, 30)
    drive(tracks, 1, first=30, vehicle="once", tag_id=3)
    message = collective_perception(tracks.at(last), "rsu-eye", last)
    (car,) = message.body.perceived_object_container
    middle = only_named(tracks, last, "n1").x_m + 0.08
    assert car.position.x_coordinate.value == round(middle * 14.0 * 100.0)
    assert car.velocity.cartesian_velocity.x_velocity.value == pytest.approx(364, abs=6)
    assert car.angles.z_angle.value == 900
    assert car.object_dimension_x.value == 42
    assert car.sensor_id_list == (0,)
    assert decode(CpmTx, encode(message)[0]) == message


def only_named(tracks, t_ns, name):
    return next(track for track in tracks.at(t_ns) if track.vehicle == name)


HUGE, NOUGHT = np.full((3, 3), 1e300), np.zeros((3, 3))
HOSTILE = {
    "not a number": {"covariance": np.full((3, 3), np.nan)},
    "huge": {"covariance": HUGE},
    "negative": {"covariance": -WHITE},
    "without doubt": {"covariance": NOUGHT, "shared": NOUGHT, "common_mode": NOUGHT},
    "endless shared": {"shared": np.full((3, 3), np.inf)},
    "common mode not a number": {"common_mode": np.full((3, 3), np.nan)},
    "more shared than all": {"shared": 2.0 * (WHITE + SHARED)},
    "far away": {"pose": Pose2(1e300, 0.0, 0.0)},
    "no such tag": {"tag_id": 2**60},
    "long ago": {"t_ns": -(2**80)},
    "far in the future": {"t_ns": 2**80},
}


@pytest.mark.parametrize("changed", HOSTILE.values(), ids=HOSTILE)
@pytest.mark.parametrize("first", [False, True])
def test_a_sighting_that_cannot_be_is_refused_and_harms_no_track(changed, first):
    tracks = Tracks()
    last = START_NS if first else drive(tracks, 5)
    bad = replace(saw(0.0, 0.5, 5, camera="b"), t_ns=last, vehicle="n2")
    told = [replace(bad, **{"vehicle": name, **changed}) for name in ("n1", "n1", "n2", "n2")]
    for one in told:
        tracks.see([one], last)
    assert tracks.refused == len(told)
    if not first:
        assert only(tracks, last).x_m == pytest.approx(0.26 * 4 * FRAME_NS * 1e-9, abs=1e-3)


def test_names_that_never_end_fill_neither_cameras_nor_cars():
    tracks = Tracks()
    tracks.see([saw(0.0, 0.5, 0, camera=f"c{i}") for i in range(MAX_CAMERAS + 9)], START_NS)
    cars = [saw(0.0, 0.5, 1, camera="c0", vehicle=f"v{i}") for i in range(MAX_CARS + 9)]
    tracks.see(cars[: MAX_CARS + 5], START_NS + FRAME_NS)
    tracks.see(cars[MAX_CARS + 5 :], START_NS + FRAME_NS)
    assert tracks.refused == 9 + 10
    assert len(tracks.at(START_NS + FRAME_NS)) == MAX_CARS


def test_only_cameras_of_the_city_are_heard_where_they_are_known():
    tracks = Tracks(cameras=("a", "b"))
    tracks.see([saw(0.0, 0.5, 0, camera="z")], START_NS)
    assert (tracks.refused, tracks.at(START_NS)) == (1, ())


def told_late(tracks, late_ns, apart):
    """Two cameras see ten cars stand; the second tells each car by itself, and later."""
    for frame in range(12):
        seen = [saw(0.2 * i, 0.5, frame, vehicle=f"n{i}", tag_id=i) for i in range(10)]
        now = seen[0].t_ns
        tracks.see(seen, now)
        late = [replace(one, camera="b", t_ns=one.t_ns - late_ns) for one in seen]
        for some in [[one] for one in late] if apart else [late]:
            tracks.see(some, now)
    return now


def test_a_frame_that_is_told_car_by_car_is_taken_in_as_one(monkeypatch):
    frames = []
    monkeypatch.setattr(
        "scm.eye.track.tracks.updated", lambda fleet, frame: frames.append(len(frame)) or fleet
    )
    tracks = Tracks()
    now = told_late(tracks, 0, apart=True)
    tracks.at(now)
    assert set(frames) == {10}


def test_a_network_camera_that_is_a_fifth_of_a_second_late_is_heard():
    tracks = Tracks()
    now = told_late(tracks, 200_000_000, apart=False)
    assert tracks.refused == 0
    assert {frozenset(track.cameras) for track in tracks.at(now)} == {frozenset("ab")}
