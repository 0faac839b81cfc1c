"""Where a camera hangs, from tags on the floor: exactness, honesty, two solutions, wrong tags."""

import tomllib

import cv2
import msgspec
import numpy as np
import pytest

from scm.__main__ import main
from scm.errors import EyeError
from scm.eye.calibrate.locate import known_tags, locate
from scm.eye.camera import camera_model
from scm.eye.detect import detect_tags
from scm.eye.render.floor import draw_map_tag
from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.records.city_map import Camera, MapTag
from scm.records.eye import TagSeen
from scm.scenery.tags import tag_corners

HIGH = Camera(
    name="overhead", x_m=1.5, y_m=-0.2, z_m=2.5, yaw_rad=0.1, tilt_x_rad=0.3, tilt_y_rad=0.18,
    width_px=1920, height_px=1080, fx_px=1250.0, fy_px=1252.0, cx_px=962.0, cy_px=538.0,
    distortion=(-0.1, 0.02, 3e-4, -2e-4, 0.0),
)  # fmt: skip
PLACES = [(0.2, 0.1), (2.6, 0.1), (2.7, 1.2), (0.3, 1.3), (1.5, 0.7), (0.9, 1.1)]
TAGS = {
    i: MapTag(tag_id=i, x_m=x, y_m=y, yaw_rad=0.7 * i, size_m=0.12)
    for i, (x, y) in enumerate(PLACES)
}


def seen_by(camera, tags, noise=0.0, seed=0):
    model, rng, seen = camera_model(camera), np.random.default_rng(seed), []
    for tag in tags.values():
        pose = Pose2(tag.x_m, tag.y_m, tag.yaw_rad)
        floor = np.array([(*pose.apply(x, y), 0.0) for x, y in tag_corners(tag.size_m)])
        a, b, c, d = map(tuple, (model.project(floor) + rng.normal(0, noise, (4, 2))).tolist())
        seen.append(TagSeen(tag_id=tag.tag_id, centre_px=a, corners_px=(a, b, c, d), margin=50.0))
    return seen


def off(place, camera):
    return place.model.extrinsics - camera_model(camera).extrinsics


@pytest.mark.parametrize("lens", ["pinhole", "fisheye"])
@pytest.mark.parametrize("tilts", [(0.0, 0.0), (0.3, 0.18), (-0.6, 0.3), (0.2, -0.7)])
def test_exact_corners_give_the_pose_at_any_tilt(lens, tilts):
    bent = HIGH.distortion if lens == "pinhole" else (-0.02, 0.005, 0.0, 0.0, 0.0)
    camera = msgspec.structs.replace(
        HIGH, lens=lens, distortion=bent, tilt_x_rad=tilts[0], tilt_y_rad=tilts[1]
    )
    located = locate(camera, TAGS, seen_by(camera, TAGS))
    np.testing.assert_allclose(off(located.places[0], camera), np.zeros(6), atol=1e-7)
    assert located.is_sure


def test_a_rendered_picture_at_20_deg_gives_the_pose_within_1_mm_and_5_hundredths_of_a_deg():
    frame = np.full((HIGH.height_px, HIGH.width_px, 3), 150, dtype=np.uint8)
    model = camera_model(HIGH)
    for tag in TAGS.values():
        draw_map_tag(frame, model, tag)
    noisy = frame + np.random.default_rng(0).normal(0.0, 2.0, frame.shape)
    grey = cv2.cvtColor(np.clip(noisy, 0, 255).astype(np.uint8), cv2.COLOR_BGR2GRAY)
    place = locate(HIGH, TAGS, detect_tags(grey)).places[0]
    assert np.degrees(place.tilt_rad) == pytest.approx(20.0, abs=0.3)
    error = off(place, HIGH)
    assert np.abs(error[:3]).max() < 1e-3
    assert np.degrees(np.abs(error[3:])).max() < 0.05


def test_the_stated_covariance_is_honest_with_the_doubt_of_the_lens():
    doubt = np.diag(np.array([1.5, 1.5, 1.0, 1.0, 1e-3, 1e-3, 1e-5, 1e-5, 1e-4]) ** 2)
    total = 0.0
    for seed in range(30):
        rng = np.random.default_rng(100 + seed)
        fx, fy, cx, cy, *bent = rng.multivariate_normal(
            [1250.0, 1252.0, 962.0, 538.0, *HIGH.distortion], doubt
        )
        true = msgspec.structs.replace(
            HIGH, fx_px=fx, fy_px=fy, cx_px=cx, cy_px=cy, distortion=tuple(bent)
        )
        place = locate(HIGH, TAGS, seen_by(true, TAGS, 0.1, seed), doubt, 0.1).places[0]
        error = off(place, HIGH)
        total += error @ np.linalg.solve(place.covariance, error)
    assert 180 - 3.3 * np.sqrt(360) < total < 180 + 3.3 * np.sqrt(360)


def test_both_solutions_of_one_tag_are_weighed():
    far = msgspec.structs.replace(HIGH, tilt_x_rad=0.0, tilt_y_rad=0.1)
    one = {4: msgspec.structs.replace(TAGS[4], size_m=0.076)}
    unsure = locate(far, one, seen_by(far, one, 0.3, 1), corner_std_px=0.3)
    assert len(unsure.places) == 2
    assert not unsure.is_sure
    assert sum(place.weight for place in unsure.places) == pytest.approx(1.0)
    assert locate(HIGH, TAGS, seen_by(HIGH, TAGS, 0.05)).is_sure


def test_a_tag_that_is_not_where_it_was_said_to_be_is_left_out():
    moved = dict(TAGS)
    moved[2] = msgspec.structs.replace(TAGS[2], x_m=TAGS[2].x_m + 0.03)
    located = locate(HIGH, TAGS, seen_by(HIGH, moved, 0.03))
    assert located.wrong == (2,)
    assert np.abs(off(located.places[0], HIGH)[:3]).max() < 2e-3


def test_no_known_tag_is_said_with_those_seen():
    with pytest.raises(EyeError, match="expected a tag of 9 in the picture, got 0, 1"):
        locate(HIGH, {9: TAGS[0]}, seen_by(HIGH, {0: TAGS[0], 1: TAGS[1]}))


def test_more_tags_come_from_a_file_and_twins_are_refused(tmp_path):
    path, city_map = tmp_path / "tags.toml", load_map("driving_school")
    path.write_text("[[tags]]\nid = 7\nx_m = 1.0\ny_m = 0.5\nsize_m = 0.1\n")
    tags = known_tags(city_map, path)
    assert sorted(tags) == [city_map.tag.tag_id, 7]
    path.write_text(path.read_text().replace("7", str(city_map.tag.tag_id)))
    with pytest.raises(EyeError, match="expected each once"):
        known_tags(city_map, path)


def test_the_command_prints_a_block_that_is_a_camera(tmp_path, capsys):
    camera, city_map = load_map("driving_school").cameras[0], load_map("driving_school")
    frame = np.full((camera.height_px, camera.width_px, 3), 150, dtype=np.uint8)
    more, rows = {}, []
    for i, (x, y) in enumerate(PLACES, start=100):
        more[i] = MapTag(tag_id=i, x_m=x, y_m=y * 0.8, size_m=0.12)
        rows.append(f"[[tags]]\nid = {i}\nx_m = {x}\ny_m = {y * 0.8}\nsize_m = 0.12\n")
    for tag in (city_map.tag, *more.values()):
        draw_map_tag(frame, camera_model(camera), tag)
    cv2.imwrite(str(tmp_path / "frame.png"), frame)
    (tmp_path / "tags.toml").write_text("".join(rows))
    words = ["eye", "locate", str(tmp_path / "frame.png"), "--map", "driving_school"]
    assert main([*words, "--tags", str(tmp_path / "tags.toml")]) == 0
    said = capsys.readouterr().out
    block = msgspec.convert(tomllib.loads(said)["cameras"][0], Camera)
    np.testing.assert_allclose(
        camera_model(block).extrinsics, camera_model(camera).extrinsics, atol=2e-3
    )
    assert "# solution A:" in said
    assert said.count("# +-") == 6
