"""The Eye over REST: cameras, poses, how far they lay from the truth, and calibrations."""

import os
import struct
import threading
import time
from pathlib import Path

import cv2
import numpy as np
import pytest

from scm.api.app import create_app
from scm.api.calibration_jobs import LARGEST_PICTURE, MOST_CAMERAS, MOST_VIEWS, size_of
from scm.api.folders import Folders, folders_in
from scm.api.keys import KeyRing
from scm.api.problem import RefusedError
from scm.records.eye import Calibrated, InForce, TagSeen
from scm.store.memory import MemoryStore
from scm.v2x.message import Refused
from scm.v2x.messages.calibration_request import CalibrationReply, CalibrationRequest
from scm.v2x.messages.eye_frame import EyeFrame
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.messages.eye_status import EyeStatus
from scm.v2x.messages.eye_tags import EyeTags
from scm.v2x.messages.eye_track import EyeTrack

API = "/api/v1"
EYE = f"{API}/eye"
LENS = """lens = "pinhole"
width_px = 800
height_px = 500
fx_px = 660.0
fy_px = 663.0
cx_px = 404.0
cy_px = 246.0
distortion = [-0.15, 0.05, 0.0005, -0.0004, 0.0]
rms_px = 0.09
views = 14
covariance = []
"""
PLACE = """[[cameras]]
name = "overhead"
x_m = 1.0
y_m = 0.5
z_m = 2.5
width_px = 800
height_px = 500
fx_px = 660.0
fy_px = 663.0
cx_px = 404.0
cy_px = 246.0
"""

PLACE_BENT = PLACE + "distortion = [-0.15, 0.05, 0.0005, -0.0004, 0.0]\n"


@pytest.fixture
def app(view, fake_city, city_map, tmp_path):
    return create_app(view, fake_city.ask, city_map, folders=folders_in(tmp_path))


@pytest.fixture
def seen(hear, snapshot):
    """Let a car drive 4 s along x at 0.5 m/s while the Eye sees it `off` metres wrong."""

    def drive(*offs, camera="overhead", car="n1", from_s=1.0, every_s=0.5):
        for i, (x_off, y_off) in enumerate(offs):
            at_s = from_s + every_s * i
            hear(at_s, snapshot(at_s, tick=i + 1, n1=(0.5 * at_s, 1.0, 0.0)))
            pose = EyePose(
                camera=camera, vehicle=car, tag_id=1, t_ns=round(at_s * 1e9),
                x_m=0.5 * at_s + x_off, y_m=1.0 + y_off, yaw_rad=0.01,
                covariance=(4e-6, 0.0, 0.0, 0.0, 9e-6, 0.0, 0.0, 0.0, 1e-4),
            )  # fmt: skip
            hear(at_s, pose)
        tags = EyeTags(camera=camera, t_ns=round(at_s * 1e9), latency_ms=20.0, tags=TAGS)
        hear(at_s, tags)

    return drive


def tag(tag_id, side=30.0, hamming=None):
    corners = ((0.0, side), (side, side), (side, 0.0), (0.0, 0.0))
    return TagSeen(
        tag_id=tag_id, centre_px=(side / 2, side / 2), corners_px=corners, margin=80.04,
        hamming=hamming,
    )  # fmt: skip


TAGS = (tag(0, 28.0, 0), tag(1, hamming=1), tag(77))


def jpeg(width=64, height=48, value=128):
    return cv2.imencode(".jpg", np.full((height, width), value, np.uint8))[1].tobytes()


def png(width=64, height=48):
    return cv2.imencode(".png", np.zeros((height, width), np.uint8))[1].tobytes()


class TestPoses:
    def test_a_pose_has_its_doubt_and_its_residual(self, client, seen):
        seen((0.003, 0.004))
        (row,) = client("GET", f"{EYE}/poses").json()["items"]
        assert (row["camera"], row["vehicle"], row["tag_id"]) == ("overhead", "n1", 1)
        assert (row["std_x_m"], row["std_y_m"], row["std_yaw_rad"]) == (0.002, 0.003, 0.01)
        assert row["residual"] == {"position_mm": 5.0, "x_mm": 3.0, "y_mm": 4.0, "yaw_deg": 0.573}

    def test_residuals_have_mean_share_worst_and_bias(self, client, seen):
        seen((0.003, 0.004), (0.0, 0.0), (0.006, 0.008))
        told = client("GET", f"{EYE}/cameras/overhead/residuals").json()
        stats = told["stats"]
        assert (stats["samples"], stats["mean_mm"], stats["worst_mm"]) == (3, 5.0, 10.0)
        assert (stats["bias_x_mm"], stats["bias_y_mm"]) == (3.0, 4.0)
        assert (stats["bias_yaw_deg"], stats["yaw_std_deg"]) == (0.573, 0.0)
        assert [one["vehicle"] for one in told["vehicles"]] == ["n1"]
        assert [one["x_mm"] for one in told["samples"]] == [3.0, 0.0, 6.0]

    def test_a_shorter_window_and_fewer_samples_can_be_asked_for(self, client, seen):
        seen(*[(0.001 * i, 0.0) for i in range(8)])
        path = f"{EYE}/cameras/overhead/residuals"
        short = client("GET", f"{path}?window_s=1").json()
        assert [one["x_mm"] for one in short["samples"]] == [5.0, 6.0, 7.0]
        few = client("GET", f"{path}?most=4").json()
        assert few["stats"]["samples"] == 8
        assert [one["x_mm"] for one in few["samples"]] == [1.0, 3.0, 5.0, 7.0]
        none = client("GET", f"{path}?vehicle=n2").json()
        assert (none["stats"]["samples"], none["stats"]["mean_mm"]) == (0, None)

    def test_two_samples_a_second_are_kept(self, client, seen):
        seen(*[(0.001 * i, 0.0) for i in range(9)], every_s=0.25)
        samples = client("GET", f"{EYE}/cameras/overhead/residuals").json()["samples"]
        assert [one["x_mm"] for one in samples] == [0.0, 2.0, 4.0, 6.0, 8.0]

    def test_a_world_started_again_begins_anew(self, client, seen):
        seen((0.001, 0.0), (0.002, 0.0), from_s=20.0)
        seen((0.005, 0.0), from_s=2.0)
        samples = client("GET", f"{EYE}/cameras/overhead/residuals").json()["samples"]
        assert [one["x_mm"] for one in samples] == [5.0]

    def test_residuals_of_a_camera_never_heard_are_not_found(self, client):
        assert client("GET", f"{EYE}/cameras/other/residuals").status_code == 404

    def test_a_tag_is_told_with_its_owner_size_and_place(self, client, seen):
        seen((0.0, 0.0), car="tag-77")
        seen((0.0, 0.0))
        state = client("GET", f"{EYE}/cameras/overhead").json()
        floor, car, stray = state["state"]["known"]
        assert (floor["what"], floor["size_px"], floor["x_m"]) == ("map", 28.0, 0.0)
        assert (car["what"], car["vehicle"], car["x_m"]) == ("car", "n1", 0.5)
        assert (stray["what"], stray["vehicle"], stray["x_m"]) == ("other", "", 0.5)
        assert [one["hamming"] for one in (floor, car, stray)] == [0, 1, None]
        assert {one["margin"] for one in (floor, car, stray)} == {80.0}
        assert state["mounted"]["z_m"] == 2.8

    def test_a_tag_is_forgotten_after_a_minute(self, client, seen, hear):
        seen((0.0, 0.0))
        hear(30.0)
        assert client("GET", f"{EYE}/cameras/overhead").json()["state"]["known"][1]["seen_s"] == 29
        hear(62.0)
        assert client("GET", f"{EYE}/cameras/overhead").json()["state"]["known"] == []


class TestViews:
    path = f"{EYE}/cameras/overhead/views"

    def test_pictures_are_kept_shown_and_thrown_away(self, client):
        assert client("POST", self.path, content=jpeg()).json()["name"] == "0001.jpg"
        made = client("POST", self.path, content=png())
        assert (made.status_code, made.json()["name"]) == (201, "0002.png")
        shown = client("GET", made.headers["location"])
        assert (shown.headers["content-type"], shown.content) == ("image/png", png())
        left = client("DELETE", f"{self.path}/0001.jpg").json()["views"]
        assert [one["name"] for one in left] == ["0002.png"]
        assert client("POST", self.path, content=png()).json()["name"] == "0003.png"
        assert client("DELETE", self.path).json() == {"views": [], "findings": None}

    def test_without_a_body_it_is_the_newest_frame(self, client, hear):
        assert client("POST", self.path).status_code == 404
        picture = jpeg(value=90)
        hear(1.0, EyeFrame(camera="overhead", t_ns=7, width_px=64, height_px=48, payload=picture))
        made = client("POST", self.path)
        assert client("GET", made.headers["location"]).content == picture

    @pytest.mark.parametrize(
        "what",
        [
            b"GIF89a",
            b"\xff\xd8\xff",
            b"\x89PNG\r\n\x1a\n",
            b"x" * 99,
            b"\xff\xd8\xff\xe0\0\2\0\xc0\0\x11\x08\0\x30\0\x40",
        ],
    )
    def test_what_is_no_picture_is_refused(self, client, what):
        refused = client("POST", self.path, content=what)
        assert (refused.status_code, refused.json()["code"]) == (422, "invalid")
        assert "JPEG or PNG" in refused.json()["detail"]

    def test_a_picture_of_another_size_is_refused(self, client):
        client("POST", self.path, content=jpeg())
        refused = client("POST", self.path, content=jpeg(width=80))
        assert "expected 64 x 48 px as 0001.jpg, got 80 x 48 px" in refused.json()["detail"]

    def test_a_file_too_large_is_refused(self, client):
        refused = client("POST", self.path, content=b"\xff" * (LARGEST_PICTURE + 1))
        assert (refused.status_code, refused.json()["code"]) == (413, "too_large")
        assert "at most 8388608 bytes" in refused.json()["detail"]

    def test_too_many_pictures_are_refused(self, client, tmp_path):
        folder = tmp_path / "calibrations" / "views" / "overhead"
        folder.mkdir(parents=True)
        for number in range(MOST_VIEWS):
            (folder / f"{number:04d}.jpg").write_bytes(jpeg())
        assert client("POST", self.path, content=jpeg()).status_code == 409

    def test_pictures_of_too_many_cameras_are_refused(self, client, tmp_path):
        for number in range(MOST_CAMERAS):
            (tmp_path / "calibrations" / "views" / f"c{number}").mkdir(parents=True)
        refused = client("POST", self.path, content=jpeg())
        assert (refused.status_code, refused.json()["code"]) == (409, "full")

    def test_a_progressive_jpeg_has_its_size_read_behind_other_segments(self):
        head = b"\xff\xd8" + b"\xff\xe0" + struct.pack(">H", 6) + b"abcd"
        frame = b"\xff\xc2" + struct.pack(">HBHH", 17, 8, 300, 400)
        assert size_of(head + frame) == (400, 300)
        with pytest.raises(RefusedError):
            size_of(head)


class TestShelf:
    def test_a_disk_that_cannot_be_written_is_told(self, view, fake_city, city_map, client_of):
        nowhere = Folders(calibrations=Path("/sys/calibrations"))
        client = client_of(create_app(view, fake_city.ask, city_map, folders=nowhere))
        body, new = {"toml": LENS}, {"If-None-Match": "*"}
        answer = client("PUT", f"{EYE}/calibrations/lab", json=body, headers=new)
        assert (answer.status_code, answer.json()["code"]) == (507, "not_written")

    @pytest.mark.parametrize(("toml", "kind"), [(LENS, "lens"), (PLACE, "place")])
    def test_a_calibration_is_kept_read_and_downloaded(self, client, toml, kind):
        new = {"If-None-Match": "*"}
        made = client("PUT", f"{EYE}/calibrations/lab", json={"toml": toml}, headers=new)
        assert (made.status_code, made.json()["row"]["kind"]) == (201, kind)
        (row,) = client("GET", f"{EYE}/calibrations").json()["items"]
        assert (row["name"], row["width_px"], row["reported"]) == ("lab", 800, False)
        file = client("GET", f"{EYE}/calibrations/lab/file.toml")
        assert file.text == toml
        assert 'filename="lab.toml"' in file.headers["content-disposition"]
        assert client("GET", f"{EYE}/calibrations/lab/report").status_code == 404

    def test_nobody_overwrites_what_he_did_not_see(self, client):
        path, new = f"{EYE}/calibrations/lab", {"If-None-Match": "*"}
        first = client("PUT", path, json={"toml": PLACE}, headers=new)
        assert client("PUT", path, json={"toml": LENS}, headers=new).status_code == 412
        assert client("PUT", path, json={"toml": LENS}).status_code == 428
        mine = {"If-Match": first.headers["etag"]}
        assert client("PUT", path, json={"toml": LENS}, headers=mine).status_code == 200
        assert client("DELETE", path, headers=mine).status_code == 412
        tag = client("GET", path).headers["etag"]
        assert client("DELETE", path, headers={"If-Match": tag}).status_code == 200
        assert client("GET", path).status_code == 404

    @pytest.mark.parametrize(
        "toml",
        ["[", "x = 1", PLACE + PLACE, PLACE.replace("0.5", '"a"'), LENS.replace("pinhole", "eye")],
    )
    def test_what_is_no_calibration_is_refused_with_the_reason(self, client, toml):
        new = {"If-None-Match": "*"}
        refused = client("PUT", f"{EYE}/calibrations/lab", json={"toml": toml}, headers=new)
        assert refused.status_code == 422
        assert "toml: expected" in refused.json()["detail"]

    def test_the_newest_comes_first_and_its_report_goes_with_it(self, client, tmp_path):
        new, folder = {"If-None-Match": "*"}, tmp_path / "calibrations"
        for name in ("a", "b", "c"):
            client("PUT", f"{EYE}/calibrations/{name}", json={"toml": PLACE}, headers=new)
        for age, name in enumerate("bca"):
            os.utime(folder / f"{name}.toml", (1000 - age, 1000 - age))
        rows = client("GET", f"{EYE}/calibrations").json()["items"]
        assert [row["name"] for row in rows] == ["b", "c", "a"]
        (folder / "b.json").write_text('{"is_sure": true}')
        assert client("GET", f"{EYE}/calibrations/b/report").json() == {"is_sure": True}
        tag = client("GET", f"{EYE}/calibrations/b").headers["etag"]
        client("DELETE", f"{EYE}/calibrations/b", headers={"If-Match": tag})
        assert sorted(path.name for path in folder.iterdir()) == ["a.toml", "c.toml"]

    def test_a_full_shelf_takes_no_more(self, client, monkeypatch):
        monkeypatch.setattr("scm.api.calibration_repository.MAX_CALIBRATIONS", 1)
        new = {"If-None-Match": "*"}
        for name, status in (("a", 201), ("b", 409)):
            path = f"{EYE}/calibrations/{name}"
            made = client("PUT", path, json={"toml": PLACE}, headers=new)
            assert made.status_code == status

    def test_a_file_put_there_by_hand_that_is_none_is_passed_over(self, client, tmp_path):
        folder = tmp_path / "calibrations"
        folder.mkdir()
        (folder / "notes.toml").write_bytes(b"\xff\xfe")
        assert client("GET", f"{EYE}/calibrations").json()["items"] == []

    def test_without_a_shelf_it_says_how_to_get_one(self, view, fake_city, city_map, client_of):
        client = client_of(create_app(view, fake_city.ask, city_map))
        assert "--data FOLDER" in client("GET", f"{EYE}/calibrations").json()["detail"]


BOARD = {"columns": 9, "rows": 6, "square_m": 0.03}


class TestMeasuring:
    def wait(self, client, accepted):
        assert accepted.status_code == 202, accepted.text
        for _ in range(2400):
            row = client("GET", accepted.headers["location"]).json()
            if row["state"] not in ("waiting", "running"):
                return row
            time.sleep(0.05)
        raise AssertionError(row)

    def test_without_pictures_there_is_nothing_to_measure(self, client):
        assert client("POST", f"{EYE}/cameras/overhead/lens", json=BOARD).status_code == 404

    def test_pictures_without_a_board_fail_in_words(self, client):
        client("POST", TestViews.path, content=jpeg())
        row = self.wait(client, client("POST", f"{EYE}/cameras/overhead/lens", json=BOARD))
        assert row["state"] == "failed"
        assert "chessboard of 9 x 6 squares" in row["error"]

    def test_a_name_that_is_taken_is_refused_before_the_work(self, client):
        new = {"If-None-Match": "*"}
        client("PUT", f"{EYE}/calibrations/lab", json={"toml": PLACE}, headers=new)
        client("POST", TestViews.path, content=jpeg())
        path = f"{EYE}/cameras/overhead"
        for noun, body in (("lens", BOARD), ("place", {})):
            refused = client("POST", f"{path}/{noun}", json={**body, "save_as": "lab"})
            assert (refused.status_code, refused.json()["code"]) == (409, "exists")
        body = {"save_as": "new", "lens": "lab"}
        assert "which is a place" in client("POST", f"{path}/place", json=body).json()["detail"]

    def test_of_two_who_ask_for_one_name_neither_loses_what_was_found(
        self, client, monkeypatch, tmp_path
    ):
        both = threading.Event()

        def measure(words, tell):
            assert both.wait(20.0)
            Path(words[words.index("--out") + 1]).write_text(LENS)
            Path(words[words.index("--report") + 1]).write_text("{}")

        monkeypatch.setattr("scm.api.calibration_jobs._run", measure)
        client("POST", TestViews.path, content=jpeg())
        path, body = f"{EYE}/cameras/overhead/lens", {**BOARD, "save_as": "glass"}
        asked = [client("POST", path, json=body) for _ in range(2)]
        both.set()
        kept = {self.wait(client, one)["result"].split("/")[-1] for one in asked}
        assert kept == {"glass", "glass-2"}
        assert {path.stem for path in (tmp_path / "calibrations").glob("*.json")} == kept

    def test_a_camera_that_the_map_does_not_know_has_no_place_to_find(self, client):
        refused = client("POST", f"{EYE}/cameras/other/place", json={"save_as": "x"})
        assert refused.status_code == 404


WHY = {"by": "ada", "reason": "it was moved"}


class TestInForce:
    """`PLACE` was found with `LENS`, so its doubt goes with it."""

    path = f"{EYE}/cameras/overhead/calibration"

    @pytest.fixture
    def shelf(self, client):
        def put(**texts):
            for name, toml in texts.items():
                new = {"If-None-Match": "*"}
                path = f"{EYE}/calibrations/{name}"
                assert client("PUT", path, json={"toml": toml}, headers=new).is_success

        return put

    @pytest.fixture
    def eye(self, fake_city):
        told = InForce(now=Calibrated(place="lab"), since_ns=7, by="ada", before=Calibrated())
        reply = CalibrationReply(camera="overhead", in_force=told)
        fake_city.answers[CalibrationRequest] = reply
        return fake_city

    def test_a_place_is_asked_for_with_the_lens_it_was_found_with(self, client, shelf, eye):
        shelf(lab=PLACE_BENT, glass=LENS, other=LENS.replace("660.0", "661.0"))
        body = {"calibration": "lab", **WHY}
        reply = client("PUT", self.path, json=body, headers={"Idempotency-Key": "k1"})
        assert reply.json()["in_force"]["now"] == {"lens": "", "place": "lab"}
        (asked,) = eye.asked
        assert (asked.camera, asked.verb, asked.calibration) == ("overhead", "use", "lab")
        assert (asked.by, asked.reason, asked.request_id) == ("ada", "it was moved", "k1")
        assert (asked.place.name, asked.place.z_m, asked.lens.views) == ("overhead", 2.5, 14)

    def test_a_place_found_with_the_map_s_lens_goes_alone(self, client, shelf, eye):
        shelf(lab=PLACE, glass=LENS)
        client("PUT", self.path, json={"calibration": "lab", **WHY})
        assert (eye.asked[0].place.z_m, eye.asked[0].lens) == (2.5, None)

    def test_a_lens_goes_without_a_place(self, client, shelf, eye):
        shelf(glass=LENS)
        client("PUT", self.path, json={"calibration": "glass", **WHY})
        assert (eye.asked[0].place, eye.asked[0].lens.fx_px) == (None, 660.0)

    def test_what_was_before_is_put_back(self, client, eye):
        assert client("POST", f"{self.path}/back", json=WHY).status_code == 200
        (asked,) = eye.asked
        assert (asked.camera, asked.verb, asked.reason) == ("overhead", "back", "it was moved")

    def test_a_calibration_that_the_eye_would_not_trust_needs_an_explicit_yes(
        self, client, shelf, eye
    ):
        shelf(lab=PLACE)
        eye.answers[CalibrationRequest] = Refused(code="unsure", detail="good to 30 mm only")
        refused = client("PUT", self.path, json={"calibration": "lab", **WHY})
        assert (refused.status_code, refused.json()["code"]) == (409, "unsure")
        client("PUT", self.path, json={"calibration": "lab", **WHY, "accept_unsure": True})
        assert [one.accept_unsure for one in eye.asked] == [False, True]

    def test_nothing_is_asked_that_cannot_be(self, client, shelf, eye):
        shelf(lab=PLACE.replace("overhead", "south"))
        other = f"{EYE}/cameras/south/calibration"
        for path, body, status, said in (
            (self.path, {"calibration": "lab", **WHY}, 422, "place of camera 'south'"),
            (self.path, {"calibration": "none", **WHY}, 404, "calibration named 'none'"),
            (other, {"calibration": "lab", **WHY}, 404, "camera on the map named 'south'"),
            (self.path, {"calibration": "lab", "reason": ""}, 422, ""),
        ):
            refused = client("PUT", path, json=body)
            assert (refused.status_code, said in refused.json()["detail"]) == (status, True)
        assert client("POST", f"{other}/back", json=WHY).status_code == 404
        assert eye.asked == []

    def test_the_eye_s_own_no_is_told_in_its_words(self, client, shelf, fake_city):
        shelf(lab=PLACE)
        no = Refused(code="invalid", detail="map tags are 34.2 px from where")
        fake_city.answers[CalibrationRequest] = no
        refused = client("PUT", self.path, json={"calibration": "lab", **WHY})
        assert (refused.status_code, refused.json()["detail"]) == (422, no.detail)

    def test_a_camera_tells_what_it_sees_by(self, client, hear):
        told = InForce(now=Calibrated(lens="glass"), since_ns=7, by="ada", reason="new lens")
        hear(1.0, EyeStatus(camera="overhead", t_ns=1, good=True, in_force=told))
        state = client("GET", f"{EYE}/cameras/overhead").json()["state"]
        assert state["in_force"]["now"] == {"lens": "glass", "place": ""}
        assert (state["in_force"]["since_ns"], state["in_force"]["reason"]) == (7, "new lens")

    def test_it_takes_an_engineer_and_tells_whose_key_it_was(
        self, view, eye, city_map, client_of, tmp_path
    ):
        ring = KeyRing(MemoryStore())
        app = create_app(view, eye.ask, city_map, keys=ring, folders=folders_in(tmp_path))
        for owner, role, status in (("ben", "operator", 403), ("eva", "engineer", 200)):
            headers = {"Authorization": f"Bearer {ring.add(owner, role, now_s=0)}"}
            reply = client_of(app)("POST", f"{self.path}/back", json=WHY, headers=headers)
            assert reply.status_code == status
        assert [asked.by for asked in eye.asked] == ["eva"]


def test_tags_of_the_cars_in_the_city_and_a_board_are_printed(client, hear, snapshot):
    hear(1.0, snapshot(blue=(0.0, 0.0, 0.0)))
    reply = client("GET", f"{EYE}/print/tags.pdf")
    assert reply.headers["content-type"] == "application/pdf"
    assert reply.content.startswith(b"%PDF")
    assert b"floor of driving_school - tag 0" in reply.content
    assert b"blue - tag 1" in reply.content  # as the city has it, whatever its name
    named = client("GET", f"{EYE}/print/tags.pdf?vehicles=n5&map_tag=false").content
    assert (b"n5 - tag 5" in named, b"floor of " in named) == (True, False)
    refused = client("GET", f"{EYE}/print/tags.pdf?vehicles=red")
    assert (refused.status_code, "no tag is bound" in refused.json()["detail"]) == (422, True)
    board = client("GET", f"{EYE}/print/board.pdf?board=charuco").content
    assert b"--board charuco --squares 9x6 --square-m 0.03 --marker-m 0.022" in board
    large = client("GET", f"{EYE}/print/board.pdf?square_mm=60")
    assert (large.status_code, "expected paper A2" in large.json()["detail"]) == (422, True)


def track(vehicle="n1", **more):
    rows = tuple(tuple(4e-6 if i == j else 0.0 for j in range(6)) for i in range(6))
    return EyeTrack(
        vehicle=vehicle, tag_id=1, t_ns=7, x_m=1.23456, y_m=0.5, yaw_rad=0.1, speed_mps=0.2,
        lateral_speed_mps=0.0, yaw_rate_radps=0.0, covariance=rows, age_s=0.05, stale=False, **more
    )  # fmt: skip


def test_tracks_of_all_cameras_are_heard_while_somebody_asks_for_them(client, view, hear):
    def hears():
        return EyeTrack in {one.kind for one in view.subscriptions}

    hear(1.0, track())
    assert (hears(), client("GET", f"{EYE}/tracks").json()) == (False, {"tracks": []})
    assert hears()
    hear(1.5, track(flags=("roof_tag_size",), cameras=("overhead",)), track("n2"))
    first, second = client("GET", f"{EYE}/tracks").json()["tracks"]
    assert (first["vehicle"], second["vehicle"]) == ("n1", "n2")
    assert (first["x_m"], first["std_x_m"], first["age_s"]) == (1.2346, 0.002, 0.05)
    assert (first["flags"], first["cameras"]) == (["roof_tag_size"], ["overhead"])
    hear(4.0)
    assert client("GET", f"{EYE}/tracks").json() == {"tracks": []}  # the Eye fell silent
    hear(9.5)
    assert not hears()
