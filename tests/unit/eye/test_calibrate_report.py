"""What a calibration tells programs: `--look` and `--report` of the Eye's commands."""

import json

import cv2
import numpy as np
import pytest

from scm.__main__ import main
from scm.eye.calibrate.board import find_board
from scm.eye.calibrate.gather import Gathered
from scm.eye.calibrate.report import views_report
from scm.scenery.board import Board

WORDS = ["--squares", "9x6", "--square-m", "0.03"]


def board_picture(blur=0.0):
    cells = np.add.outer(np.arange(6), np.arange(9)) % 2
    page = np.pad((cells * 200 + 20).astype(np.uint8).repeat(40, 0).repeat(40, 1), 60,
                  constant_values=220)  # fmt: skip
    grey = np.full((600, 1200), 220, np.uint8)
    grey[: page.shape[0], : page.shape[1]] = page
    return cv2.GaussianBlur(grey, (0, 0), blur) if blur else grey


@pytest.fixture
def shot(tmp_path):
    path = tmp_path / "board.png"
    cv2.imwrite(str(path), board_picture(0.8))
    return path


def test_looking_finds_the_board_and_measures_nothing(shot, tmp_path, capsys):
    report = tmp_path / "report.json"
    assert main(["eye", "calibrate", str(shot), *WORDS, "--look", "--report", str(report)]) == 0
    assert "in 1 pictures" in capsys.readouterr().out
    told = json.loads(report.read_text("utf-8"))
    (view,) = told["views"]
    assert (view["name"], view["points"], told["lens"]) == (str(shot), 40, None)
    outline = np.array(view["outline_px"])
    assert outline.min(axis=0) == pytest.approx([99.5, 99.5], abs=1.0)
    assert sum(map(sum, told["cover"])) == 40
    assert all(count == 0 for row in told["cover"] for count in row[4:])


def test_views_that_are_refused_are_reported_all_the_same(shot, tmp_path):
    report, out = tmp_path / "report.json", tmp_path / "lens.toml"
    words = ["eye", "calibrate", str(shot), *WORDS, "--out", str(out), "--report", str(report)]
    assert main(words) == 2
    assert not out.exists()
    assert json.loads(report.read_text("utf-8"))["views"][0]["points"] == 40


@pytest.mark.parametrize("more", [[], ["--look", "--out", "x.toml"]])
def test_either_a_lens_or_a_look_is_wanted(shot, more, capsys):
    assert main(["eye", "calibrate", str(shot), *WORDS, *more]) == 2
    assert "--look" in capsys.readouterr().err


def test_a_blurred_board_is_told_from_a_sharp_one(tmp_path):
    board = Board("chessboard", 9, 6, 0.03)

    def sharpness(blur):
        path = tmp_path / f"{blur}.png"
        cv2.imwrite(str(path), board_picture(blur))
        view = find_board(board, cv2.imread(str(path), cv2.IMREAD_GRAYSCALE), str(path))
        told = views_report(board, Gathered((view,), (1200, 600), ()))
        return told["views"][0]["sharpness"]

    assert sharpness(1.6) < 0.4 * sharpness(0.6)
