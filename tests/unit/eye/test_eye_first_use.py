"""What a new user does: render a film, locate its camera, play it with the printed blocks."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from scm.__main__ import main
from scm.errors import EyeError
from scm.eye.calibrate.locate import known_tags
from scm.eye.part import EyePart
from scm.eye.sources.choose import source_of
from scm.maps.load import load_map
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.messages.eye_status import EyeStatus

SCHOOL = Path(__file__).parents[3] / "maps" / "driving_school.toml"
START_NS = 10**18
FRAMES, RATE_HZ = 6, 30.0


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    folder = tmp_path_factory.mktemp("first") / "film"
    asked = ["--cars", "3", "--frames", str(FRAMES), "--size", "1280x720", "--noise-sigma", "1.5"]
    assert main(["eye", "render", "driving_school", "--out", str(folder), *asked]) == 0
    return folder


def map_with(block, path):
    """Return the map of the Driving School with another camera."""
    text = SCHOOL.read_text(encoding="utf-8")
    text = re.sub(r"\[\[cameras\]\].*?(?=^\[|\Z)", "", text, flags=re.DOTALL | re.MULTILINE)
    path.write_text(text + "\n" + block, encoding="utf-8")
    return load_map(str(path))


def played(city_map, film):
    """Return the last status and, for each pose, how far it is off, (x, y) [m], and its doubt."""
    camera = city_map.cameras[0]
    part = EyePart(city_map, source=source_of(str(film), rate_hz=camera.rate_hz))
    lines = (film / "truth.jsonl").read_text(encoding="utf-8").splitlines()
    truth = {
        one["t_ns"]: {car["tag_id"]: car for car in one["cars"]} for one in map(json.loads, lines)
    }
    status, off = None, []
    for step in range(200):
        for said in part.step(START_NS + step * 5_000_000, []):
            if isinstance(said, EyeStatus):
                status = said
            if isinstance(said, EyePose):
                car = truth[said.t_ns - START_NS][said.tag_id]
                off.append((said.x_m - car["x_m"], said.y_m - car["y_m"], *said.covariance[:5:4]))
    return status, np.array(off)


def test_a_rendered_film_is_played_at_its_own_times_with_the_camera_beside_it(film, tmp_path):
    city_map = map_with((film / "camera.toml").read_text(encoding="utf-8"), tmp_path / "true.toml")
    assert (city_map.cameras[0].rate_hz, city_map.cameras[0].noise_sigma) == (RATE_HZ, 1.5)
    status, off = played(city_map, film)
    assert len(off) == 3 * FRAMES
    assert np.hypot(*off[:, :2].T).max() < 0.003
    assert [one.code for one in status.complaints] == ["stalled", "source"]  # the film is over


def test_a_camera_located_by_one_small_tag_is_believed_no_more_than_it_may_be(
    film, tmp_path, capsys
):
    said = ["--map", str(tmp_path / "true.toml")]
    map_with((film / "camera.toml").read_text(encoding="utf-8"), tmp_path / "true.toml")
    assert main(["eye", "locate", str(film / "000000.png"), *said]) == 0
    city_map = map_with(capsys.readouterr().out, tmp_path / "located.toml")
    assert len(city_map.cameras[0].place_std) == 6
    status, off = played(city_map, film)
    assert "unsure" in [one.code for one in status.complaints]
    assert np.mean(off[:, :2] ** 2 / off[:, 2:]) < 2.0


def test_tags_that_cannot_lie_on_a_floor_are_refused_each_with_its_reason(tmp_path):
    told = tmp_path / "tags.toml"
    told.write_text("[[tags]]\nid = 999\nx_m = nan\ny_m = 0.0\nsize_m = inf\n", encoding="utf-8")
    with pytest.raises(EyeError, match=r"tag 999: x_m: .*got nan; id: .* 586; size_m: .*got inf"):
        known_tags(load_map("driving_school"), told)
