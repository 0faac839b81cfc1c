"""The truth beside a rendered frame, against what is in the frame."""

import itertools
import json
import math

import numpy as np
import pytest

from scm.__main__ import main
from scm.errors import EyeError
from scm.eye.camera import camera_model
from scm.eye.detect import detect_tags
from scm.eye.picture import read_picture
from scm.eye.render import effects
from scm.eye.render.car import tag_on_roof
from scm.eye.render.covers import Layer, common
from scm.eye.render.motion import Driven, gathered
from scm.eye.render.scene import bare_floor, camera_over
from scm.eye.render.shots import Look, Studio
from scm.eye.render.traffic import rings, tours
from scm.eye.render.visible import visible_share
from scm.eye.source import grey_of
from scm.maps.load import load_map
from scm.v2x.messages.world_snapshot import SnapshotVehicle

FLOOR = bare_floor(1.5, 0.9)
SIZE = (800, 480)
SOFT = Look(defocus_px=0.8)


def driven(x, y, yaw=0.0, speed=0.0, turn=0.0, tag_id=1):
    car = SnapshotVehicle(
        vehicle=f"n{tag_id}", kind="hosted", car="nigel", tag_id=tag_id, x_m=x, y_m=y,
        yaw_rad=yaw, speed_mps=speed, steering_rad=0.0,
    )  # fmt: skip
    return Driven(car, turn)


PARKED = [
    driven(0.25, 0.3, 0.4, tag_id=1), driven(0.9, 0.15, -1.1, tag_id=2),
    driven(1.1, 0.55, 2.0, tag_id=3), driven(0.5, 0.6, 3.0, tag_id=4),
]  # fmt: skip


def found_in(shot):
    return {tag.tag_id: np.array(tag.corners_px) for tag in detect_tags(grey_of(shot.image))}


def off_px(shot):
    """RMS of found corners against the truth; every tag in sight must have been found."""
    found = found_in(shot)
    assert set(found) == {i for i, tag in shot.tags.items() if tag.visible > 0.99}
    return np.sqrt(np.mean([(found[i] - shot.tags[i].corners_px) ** 2 for i in found]))


@pytest.fixture(scope="module")
def overhead():
    return camera_over(FLOOR, SIZE, height_m=1.5)


STRONG = (-0.36, 0.12, 0.001, -0.001, 0.0)


@pytest.mark.parametrize(
    "lens",
    [{}, {"tilt_rad": math.radians(20.0)}, {"distortion": STRONG}, {"fisheye": True}],
    ids=["straight", "tilted", "bent", "fisheye"],
)
def test_corners_are_found_where_the_truth_says(lens):
    shot = Studio(FLOOR, camera_over(FLOOR, SIZE, 1.2, **lens), SOFT).shoot(PARKED)
    assert len(shot.tags) == 5
    assert off_px(shot) < 0.1


def test_a_camera_tilted_by_44_degrees_sees_the_whole_floor():
    shot = Studio(FLOOR, camera_over(FLOOR, SIZE, 1.5, math.radians(44.0))).shoot(PARKED)
    assert all(tag.visible > 0.99 for tag in shot.tags.values())


def test_a_moving_cars_picture_is_the_average_of_where_it_was(overhead):
    moving = driven(0.4, 0.35, 0.3, speed=1.5, turn=2.0)
    exposure = 0.006
    times = (np.arange(24) + 0.5) / 24 * exposure - exposure / 2
    still = Studio(FLOOR, overhead)
    views = [still.shoot([Driven(moving.after(t))]).image.astype(float) for t in times]
    shot = Studio(FLOOR, overhead, Look(exposure_s=exposure)).shoot([moving])
    off = shot.image - np.mean(views, axis=0)
    frozen = views[12] - np.mean(views, axis=0)
    assert shot.tags[1].smear_px > 4.0
    assert off.std() < 0.25 * frozen.std()


def test_smear_is_speed_times_exposure_through_the_lens(overhead):
    moving = driven(0.5, 0.3, 0.0, speed=1.0)
    shot = Studio(FLOOR, overhead, Look(exposure_s=0.01)).shoot([moving])
    scale = overhead.camera.fx_px / (overhead.camera.z_m - 0.129165)
    assert shot.tags[1].smear_px == pytest.approx(0.01 * scale, rel=0.03)


def test_a_rolling_shutter_shows_a_car_where_it_was_when_its_row_was_read(overhead):
    rolling = 0.03
    moving = driven(0.6, 0.62, 0.0, speed=1.0)
    global_ = Studio(FLOOR, overhead, SOFT).shoot([moving])
    look = Look(defocus_px=0.8, rolling_s=rolling)
    shot = Studio(FLOOR, overhead, look).shoot([moving])
    assert off_px(shot) < 0.15
    ahead = found_in(shot)[1] - found_in(global_)[1]
    late = (found_in(shot)[1][:, 1] / (SIZE[1] - 1) - 0.5) * rolling
    scale = overhead.camera.fx_px / (overhead.camera.z_m - 0.129165)
    assert ahead[:, 0] == pytest.approx(scale * late, abs=0.35)
    assert late.mean() < -0.005


def test_a_global_shutter_shows_a_car_where_it_is(overhead):
    moving = driven(0.6, 0.62, 0.0, speed=1.0)
    shot = Studio(FLOOR, overhead).shoot([moving])
    expected = overhead.project(tag_on_roof(moving.car))
    np.testing.assert_allclose(shot.tags[1].corners_px, expected)


def test_a_row_gathers_every_sample_by_how_long_it_saw_it():
    times = np.linspace(0.0, 1.0, 11)
    weights = gathered(times, np.array([0.5, 0.3]), 0.4)
    assert weights.sum(axis=1) == pytest.approx([1.0, 1.0])
    assert weights @ times == pytest.approx([0.5, 0.3])
    assert weights[0, [2, 3, 5, 7, 8]] == pytest.approx([0.0, 0.125, 0.25, 0.125, 0.0], abs=1e-9)


def test_vignetting_darkens_the_corners_of_a_frame(overhead):
    plain = Studio(FLOOR, overhead).shoot([]).image[:4, :4].astype(float)
    dark = Studio(FLOOR, overhead, Look(vignetting=0.3)).shoot([]).image[:4, :4].astype(float)
    assert dark.mean() / plain.mean() == pytest.approx(0.7, abs=0.02)


def test_defocus_smears_cars_and_floor_alike(overhead):
    plain = Studio(FLOOR, overhead).shoot(PARKED).image
    soft = Studio(FLOOR, overhead, Look(defocus_px=2.5)).shoot(PARKED).image
    assert np.abs(soft - effects.defocus(plain, 2.5).astype(int)).max() <= 1
    assert np.abs(soft - plain.astype(int)).max() > 60


def test_a_shaking_camera_smears_along_its_way(overhead):
    plain = Studio(FLOOR, overhead).shoot(PARKED).image
    shaken = Studio(FLOOR, overhead, Look(blur_px=5.0, blur_rad=0.7)).shoot(PARKED).image
    assert np.abs(shaken - effects.motion_blur(plain, 5.0, 0.7).astype(int)).max() <= 1


def test_a_lamp_lights_cars_too_by_up_to_three_tenths(overhead):
    plain = Studio(FLOOR, overhead).shoot(PARKED).image.astype(float)
    lit = Studio(FLOOR, overhead, Look(lamps=1)).shoot(PARKED).image
    fair = (plain > 60) & (plain < 190)
    gain = lit[fair] / plain[fair]
    assert gain.min() > 0.98
    assert gain.max() == pytest.approx(1.3, abs=0.02)


def test_light_from_one_side_differs_by_its_gradient(overhead):
    plain = Studio(FLOOR, overhead).shoot([]).image.astype(float)
    lit = Studio(FLOOR, overhead, Look(gradient=0.4)).shoot([]).image
    gain = lit[plain > 60] / plain[plain > 60]
    assert (gain.min(), gain.max()) == pytest.approx((0.8, 1.2), abs=0.03)


def test_a_glare_saturates_in_a_spot_and_leaves_the_rest(overhead):
    plain = Studio(FLOOR, overhead).shoot([]).image.astype(int)
    shiny = Studio(FLOOR, overhead, Look(glares=1)).shoot([]).image
    core = (shiny == 255).all(axis=2).sum()
    assert 0.6 < core / (np.pi / 4 * 0.06 * 0.014 * SIZE[0] ** 2) < 1.1
    assert np.median(shiny - plain) <= 3


def test_a_compressed_frame_is_what_jpeg_leaves_of_it(overhead):
    plain = Studio(FLOOR, overhead).shoot(PARKED).image
    packed = Studio(FLOOR, overhead, Look(jpeg=60)).shoot(PARKED).image
    assert np.array_equal(packed, effects.jpeg(plain, 60))
    assert not np.array_equal(packed, plain)


def test_noise_has_its_sigma_at_middle_grey_and_changes_from_frame_to_frame(overhead):
    plain = Studio(FLOOR, overhead).shoot([]).image.astype(float)
    studio = Studio(FLOOR, overhead, Look(noise_sigma=6.0))
    first, second = (studio.shoot([]).image for _ in range(2))
    middle = (plain > 110) & (plain < 146)
    assert (first - plain)[middle].std() == pytest.approx(6.0, rel=0.05)
    assert not np.array_equal(first, second)


def test_a_tag_half_out_of_the_frame_is_half_visible(overhead):
    """The tag's middle is brought to the frame's right edge."""
    x = 0.6
    for _ in range(6):
        middle = overhead.project(tag_on_roof(driven(x, 0.35).car)).mean(axis=0)
        x += (SIZE[0] - 0.5 - middle[0]) / 560.0
    shot = Studio(FLOOR, overhead).shoot([driven(x, 0.35)])
    assert shot.tags[1].visible == pytest.approx(0.5, abs=0.02)


def test_a_car_outside_the_frame_shows_nothing(overhead):
    assert Studio(FLOOR, overhead).shoot([driven(9.0, 0.3)]).tags[1].visible == 0.0


def test_a_wall_before_the_maps_tag_hides_it():
    city = load_map("driving_school")
    steep = camera_over(city, SIZE, 2.5, math.radians(44.0))
    assert Studio(city, steep).shoot([]).tags[0].visible < 0.05
    upright = camera_over(city, SIZE, 2.5)
    assert Studio(city, upright).shoot([]).tags[0].visible == 1.0


def test_a_layer_over_half_a_print_hides_half_of_it():
    corners = np.array([[10.0, 50.0], [50.0, 50.0], [50.0, 10.0], [10.0, 10.0]])
    solid = np.ones((100, 20))
    layer = Layer((10, 0), np.zeros((100, 20, 3), dtype=np.uint8), solid, solid)
    assert visible_share(corners, (200, 200), [], [layer]) == pytest.approx(0.5, abs=0.02)
    assert visible_share(corners, (200, 200), [], []) == 1.0


def test_a_car_over_the_maps_tag_hides_it(overhead):
    shot = Studio(FLOOR, overhead).shoot([driven(-0.08, 0.0)])
    assert shot.tags[0].visible < 0.05
    assert set(found_in(shot)) == {1}


def test_of_two_cars_in_one_place_the_nearer_hides_the_others_tag(overhead):
    alone = Studio(FLOOR, overhead).shoot([driven(0.3, 0.3, tag_id=1)])
    both = Studio(FLOOR, overhead).shoot([driven(0.3, 0.3, tag_id=1), driven(0.32, 0.3, tag_id=2)])
    assert (alone.tags[1].visible, both.tags[2].visible) == (1.0, 1.0)
    assert both.tags[1].visible < 0.4


def test_hands_and_cables_hide_what_the_truth_says_they_hide(overhead):
    plain = Studio(FLOOR, overhead, seed=4).shoot(PARKED)
    shot = Studio(FLOOR, overhead, Look(hands=2, cables=3), seed=4).shoot(PARKED)
    assert not np.array_equal(plain.image, shot.image)
    assert min(tag.visible for tag in shot.tags.values()) < 0.95
    off = np.abs(shot.image.astype(int) - plain.image).max(axis=2)
    clear = [tag for tag in shot.tags.values() if tag.visible == 1.0]
    for tag in clear:
        x, y = np.rint(tag.corners_px.mean(axis=0)).astype(int)
        lighter = plain.image[y - 4 : y + 5, x - 4 : x + 5].mean()
        assert off[y - 4 : y + 5, x - 4 : x + 5].mean() < 0.36 * lighter  # a shadow at most


def test_a_frame_depends_on_its_cars_alone_not_on_frames_before(overhead):
    look = Look(vignetting=0.3, glares=1, hands=1, defocus_px=1.0, exposure_s=0.004)
    used, fresh = Studio(FLOOR, overhead, look), Studio(FLOOR, overhead, look)
    moving = [driven(0.3, 0.3, 0.5, speed=1.0)]
    used.shoot(PARKED, 0)
    used.shoot([driven(0.8, 0.4, 1.0, speed=2.0)], 700_000_000)
    assert np.array_equal(used.shoot(moving, 50).image, fresh.shoot(moving, 50).image)


@pytest.mark.usefixtures("sceneries_drawn_anew")
def test_the_same_seed_gives_the_same_pictures(overhead):
    look = Look(noise_sigma=4.0, hands=1, lamps=1, jpeg=80)
    first, again = (Studio(FLOOR, overhead, look, 7).shoot(PARKED).image for _ in range(2))
    assert np.array_equal(first, again)


def test_grey_frames_are_the_coloured_ones_in_grey(overhead):
    grey = Studio(FLOOR, overhead, Look(colour=False)).shoot(PARKED).image
    assert np.array_equal(grey, grey_of(Studio(FLOOR, overhead).shoot(PARKED).image))


def test_what_two_rectangles_share():
    assert common((0, 0, 4, 4), (2, 1, 9, 9)) == (
        (slice(1, 4), slice(2, 4)), (slice(0, 3), slice(0, 2)),
    )  # fmt: skip
    assert common((0, 0, 2, 2), (2, 0, 4, 2)) is None


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("on_lanes", [False, True])
def test_cars_of_a_film_never_touch(seed, on_lanes):
    city = load_map("driving_school") if on_lanes else bare_floor(3.0, 1.5)
    rng = np.random.default_rng(seed)
    cars = tours(city, 6 if on_lanes else 12, 0.3 if on_lanes else 0.8, 3.0, rng, on_lanes=on_lanes)
    for t in np.arange(0.0, 3.0, 0.25):
        noses = [car.at(t).pose.apply(0.08, 0.0) for car in cars]
        assert min(math.dist(a, b) for a, b in itertools.combinations(noses, 2)) > 0.2


def test_cars_on_lanes_stay_on_them_and_turn_as_they_do():
    city = load_map("driving_school")
    for car in tours(city, 5, 0.25, 2.0, np.random.default_rng(0), on_lanes=True):
        a, b = car.at(1.0), car.at(1.01)
        moved = Driven(a.car, a.yaw_rate_rad_s).after(0.01)
        assert (moved.x_m, moved.y_m) == pytest.approx((b.car.x_m, b.car.y_m), abs=5e-5)
        assert math.remainder(moved.yaw_rad - b.car.yaw_rad, math.tau) == pytest.approx(0, abs=1e-4)


def test_more_cars_than_there_is_room_for_are_refused():
    with pytest.raises(EyeError, match=r"room for 90 cars on the floor, found \d+"):
        tours(bare_floor(1.5, 0.9), 90, 0.5, 1.0, np.random.default_rng(0), on_lanes=False)


def test_a_floor_of_3_8_by_2_m_has_room_for_50_cars():
    assert len(tours(bare_floor(3.8, 2.1), 50, 1.0, 1.0, np.random.default_rng(0), on_lanes=False))


def test_every_second_ring_goes_the_other_way_round():
    turns = [line.yaw[-1] - line.yaw[0] for line in rings(bare_floor(3.0, 1.5).floor)]
    assert turns == pytest.approx([math.tau, -math.tau])


def test_the_command_writes_frames_truth_and_camera(tmp_path, capsys):
    words = "eye render parking_school --cars 2 --frames 2 --size 640x400 --jpeg 90 --hands"
    assert main([*words.split(), "--out", str(tmp_path / "film")]) == 0
    lines = (tmp_path / "film/truth.jsonl").read_text().splitlines()
    truths = [json.loads(line) for line in lines]
    assert [truth["t_ns"] for truth in truths] == [0, 33333333]
    assert len(truths[1]["cars"]) == 2
    image = read_picture(tmp_path / "film" / truths[1]["image"])
    assert image.shape == (400, 640, 3)
    assert "2 frames" in capsys.readouterr().out


def test_the_written_camera_is_the_true_one(tmp_path):
    import msgspec

    from scm.eye.render.scene import camera_toml
    from scm.records.city_map import Camera

    model = camera_over(FLOOR, SIZE, 1.5, 0.2, fisheye=True)
    read = msgspec.toml.decode(camera_toml(model.camera))
    camera = msgspec.convert(read["cameras"][0], Camera)
    points = np.array([[0.1, 0.2, 0.1], [1.0, 0.7, 0.0]])
    np.testing.assert_array_equal(camera_model(camera).project(points), model.project(points))


def test_the_command_names_every_option_that_cannot_be(tmp_path, capsys):
    words = "eye render driving_school --frames 0 --vignetting 2 --jpeg 300 --tilt-deg 60"
    assert main([*words.split(), "--out", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert all(name in said for name in ("--frames", "--vignetting", "--jpeg", "--tilt-deg"))
