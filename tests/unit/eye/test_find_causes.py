"""Why no tags are found is said: mirrored, inverted, another family, a wide border."""

import cv2
import numpy as np
import pytest

from scm.__main__ import main
from scm.clock import NS_PER_S
from scm.eye.find.causes import FAMILIES, Causes, cause_of
from scm.scenery.sheet import INK, PAPER
from tests.unit.eye.made_tag_shots import corners_at, picture

OURS = picture([(3, corners_at(80, 80, 60, 0.3)), (7, corners_at(200, 110, 60, -1.2))], (200, 300),
               rng=np.random.default_rng(0))  # fmt: skip
MIRRORED = np.ascontiguousarray(OURS[:, ::-1])


def printed(dictionary, border_cells=1):
    """Grey picture of three markers of OpenCV's, turned by 17 degrees, with noise."""
    family = cv2.aruco.getPredefinedDictionary(dictionary)
    page = np.full((200, 400), 90.0)
    for place, marker_id in enumerate((1, 5, 9)):
        side = 6 * (family.markerSize + 2 * border_cells)
        marker = cv2.aruco.generateImageMarker(family, marker_id, side, borderBits=border_cells)
        paper = INK + (PAPER - INK) / 255.0 * np.pad(marker, 6, constant_values=255)
        left = 30 + 120 * place
        page[60 : 60 + len(paper), left : left + len(paper)] = paper
    turn = cv2.getRotationMatrix2D((200, 100), 17, 1)
    page = cv2.warpAffine(page, turn, (400, 200), borderValue=90)
    page += np.random.default_rng(1).normal(0.0, 2.0, page.shape)
    return np.clip(page, 0, 255).astype(np.uint8)


@pytest.mark.parametrize(
    ("grey", "code", "said"),
    [
        (MIRRORED, "mirrored", "the picture is mirrored: switch off"),
        (255 - OURS, "inverted", "tags are inverted, white on black"),
        (255 - MIRRORED, "inverted", "mirrored and its tags are inverted"),
        (printed(cv2.aruco.DICT_APRILTAG_36h11, 2), "wide_border", "a border two cells wide"),
    ],
)
def test_a_picture_whose_tags_cannot_be_read_names_the_cause(grey, code, said):
    cause = cause_of(grey)
    assert cause.code == code
    assert said in cause.said
    ids = "1, 5, 9" if code == "wide_border" else "3, 7"
    assert cause.said.endswith(f"(seen so: {ids})")


@pytest.mark.parametrize("family", FAMILIES)
def test_another_family_is_named(family):
    cause = cause_of(printed(FAMILIES[family]))
    assert (cause.code, f"of the family {family}," in cause.said) == ("other_family", True)


def test_no_cause_is_invented_for_tags_of_ours_noise_or_stripes():
    noise = np.random.default_rng(2).integers(0, 255, (120, 160), dtype=np.uint8)
    checks = np.kron(np.indices((6, 8)).sum(axis=0) % 2, np.ones((40, 40))) * 200 + 20
    for grey in (OURS, printed(cv2.aruco.DICT_APRILTAG_36h11), noise, checks.astype(np.uint8)):
        assert cause_of(grey) is None


def test_a_stream_is_looked_at_rarely_and_only_while_tags_are_missing(monkeypatch):
    tried = []
    monkeypatch.setattr(
        "scm.eye.find.causes._tried", lambda guess, grey: tried.append(guess.code) and None
    )
    causes = Causes()
    for tenth in range(100):
        causes.see(tenth * NS_PER_S // 10, OURS, missing=False)
    assert tried == []
    for tenth in range(100, 700):
        causes.see(tenth * NS_PER_S // 10, OURS, missing=True)
    assert (len(tried), tried[0]) == (13, "mirrored")  # each guess once within this minute


def test_a_cause_stays_until_tags_are_found_and_is_new_once():
    causes = Causes()
    for tenth in range(25):
        causes.see(tenth * NS_PER_S // 10, MIRRORED, missing=True)
    assert [one.code for one in causes.complaints()] == ["mirrored"]
    assert ([one.code for one in causes.news()], causes.news()) == (["mirrored"], ())
    causes.see(3 * NS_PER_S, OURS, missing=False)
    assert (causes.complaints(), causes.news()) == ((), ())


def test_detect_and_locate_name_the_cause(tmp_path, capsys):
    path = str(tmp_path / "mirrored.png")
    cv2.imwrite(path, MIRRORED)
    assert main(["eye", "detect", path]) == 0
    assert "0 tags: the picture is mirrored" in capsys.readouterr().out
    assert main(["eye", "detect", path, "--json"]) == 0
    assert '"cause": "the picture is mirrored' in capsys.readouterr().out
