"""Calibrating on drawn pictures: boards seen through a known lens, with noise and blur."""

from functools import cache

import cv2
import numpy as np
import pytest

from scm.__main__ import main
from scm.errors import EyeError
from scm.eye.calibrate.board import find_board
from scm.eye.calibrate.gather import from_files
from scm.eye.calibration_files import load_calibration
from scm.eye.camera import camera_model
from scm.records.city_map import Camera
from scm.scenery.board import Board
from scm.scenery.tags import tag_picture

LENS = Camera(
    name="lab", x_m=0.0, y_m=0.0, z_m=1.0, width_px=800, height_px=500,
    fx_px=660.0, fy_px=663.0, cx_px=404.0, cy_px=246.0, distortion=(-0.15, 0.05, 5e-4, -4e-4, 0.0),
)  # fmt: skip
WIDE = Camera(
    name="lab", x_m=0.0, y_m=0.0, z_m=1.0, width_px=800, height_px=500, lens="fisheye",
    fx_px=330.0, fy_px=331.0, cx_px=404.0, cy_px=246.0, distortion=(-0.03, 0.01, -0.004, 5e-4, 0.0),
)  # fmt: skip
SQUARE_M, CELL_PX, MARGIN_PX = 0.03, 48, 48
BOARDS = {
    "chessboard": Board("chessboard", 9, 6, SQUARE_M),
    "charuco": Board("charuco", 9, 6, SQUARE_M, 0.022),
    "tags": Board("tags", 6, 4, SQUARE_M * 1.5, SQUARE_M * 1.5 * 8 / 12),
}


@cache
def page_of(kind):
    """Return the print with a white margin, and its texels a metre."""
    board = BOARDS[kind]
    if kind == "chessboard":
        cells = np.add.outer(np.arange(board.rows), np.arange(board.columns)) % 2
        page = (cells * 255).astype(np.uint8).repeat(CELL_PX, 0).repeat(CELL_PX, 1)
    elif kind == "charuco":
        dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
        made = cv2.aruco.CharucoBoard((9, 6), SQUARE_M, 0.022, dictionary)
        page = made.generateImage((9 * CELL_PX, 6 * CELL_PX))
    else:
        cell = CELL_PX * 3 // 2 // 12
        rows = [
            np.hstack([np.pad(tag_picture(6 * row + i, cell), cell, constant_values=255)
                       for i in range(6)])
            for row in reversed(range(4))
        ]  # fmt: skip
        page = np.vstack(rows)
    return np.pad(page, MARGIN_PX, constant_values=255), CELL_PX / SQUARE_M


@cache
def rays_of(camera, fine):
    rows, columns = camera.height_px * fine, camera.width_px * fine
    pixels = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1)
    model, flat = camera_model(camera), ((pixels + 0.5) / fine - 0.5).reshape(-1, 1, 2)
    # a few of the model's own rounds do for a picture, and it has a million of them
    few = (cv2.TERM_CRITERIA_COUNT, 12, 0.0)
    if camera.lens == "fisheye":
        bent = model.distortion[:4]
        ideal = cv2.fisheye.undistortPoints(flat, model.matrix, bent, criteria=few)
    else:
        ideal = cv2.undistortPoints(flat, model.matrix, model.distortion, None, None, None, few)
    rays = np.concatenate((ideal.reshape(-1, 2), np.ones((rows * columns, 1))), axis=-1)
    return rays.astype(np.float32)


def picture(kind, camera, turn, middle, rng):
    """Return a grey frame (height, width) of a board whose middle is there in the camera's axes."""
    page, scale = page_of(kind)
    fine = 2
    rotation = cv2.Rodrigues(np.array(turn, dtype=float))[0]
    right, up, out = (rays_of(camera, fine) @ rotation.astype(np.float32)).T
    begin = (middle @ rotation).astype(np.float32)
    ahead = begin[2] * out > 0.0
    reach = np.divide(begin[2], out, out=np.zeros_like(out), where=ahead)
    half = np.array(page.shape[::-1], dtype=np.float32) / 2.0 - 0.5
    shape = camera.height_px * fine, camera.width_px * fine
    at = [
        np.where(ahead, (along * reach - begin[i]) * np.float32(scale) + half[i], -1e4)
        .astype(np.float32)
        .reshape(shape)
        for i, along in enumerate((right, up))
    ]
    seen = cv2.remap(page, *at, cv2.INTER_LINEAR, borderValue=120)
    small = cv2.resize(seen, None, fx=1 / fine, fy=1 / fine, interpolation=cv2.INTER_AREA)
    return np.clip(small + rng.normal(0.0, 2.0, small.shape), 0, 255).astype(np.uint8)


def stances(count, lean, rng, camera):
    """Turns and middles of boards over the frame, in OpenCV's camera axes."""
    places = [(0.3, 0.3), (0.7, 0.3), (0.5, 0.5), (0.3, 0.7), (0.7, 0.7), (0.5, 0.3), (0.5, 0.7)]
    wide = camera.lens == "fisheye"
    if wide:
        places += [(0.15, 0.15), (0.85, 0.15), (0.85, 0.85), (0.15, 0.85)]
    for i in range(count):
        across, down = places[i % len(places)]
        side = 2.4 * i
        far = camera.fx_px * 0.27 / camera.width_px / (0.5 if i % 3 else 0.7)
        pixel = np.array([[across * camera.width_px, down * camera.height_px]])
        ray = np.append(camera_model(camera).undistort(pixel)[0], 1.0)
        tilt = lean * rng.uniform(0.7, 1.0)
        turn = np.array([np.cos(side) * tilt, np.sin(side) * tilt, rng.uniform(-0.3, 0.3)])
        if wide:  # the board faces the camera from there, but for its lean
            angle = np.arctan(np.hypot(*ray[:2]))
            ray /= np.linalg.norm(ray)
            aside = angle * np.array([-ray[1], ray[0], 0.0]) / np.hypot(*ray[:2])
            turn = cv2.Rodrigues(cv2.Rodrigues(aside)[0] @ cv2.Rodrigues(turn)[0])[0].ravel()
        yield turn, ray * far


@pytest.fixture(scope="module")
def shots(tmp_path_factory):
    """Return a function that draws a set of pictures once and returns their paths."""
    made = {}

    def draw(kind, camera, count, lean):
        key = (kind, camera.lens, count, lean)
        if key not in made:
            folder, rng = tmp_path_factory.mktemp("shots"), np.random.default_rng(7)
            made[key] = []
            for i, (turn, middle) in enumerate(stances(count, lean, rng, camera)):
                path = folder / f"{i:02}.png"
                cv2.imwrite(str(path), picture(kind, camera, turn, middle, rng))
                made[key].append(path)
        return made[key]

    return draw


def words(kind, paths, out, *more):
    board = BOARDS[kind]
    marker = ["--marker-m", str(board.marker_m)] if board.marker_m else []
    return [
        "eye", "calibrate", *map(str, paths), "--board", kind, "--squares",
        f"{board.columns}x{board.rows}", "--square-m", str(board.square_m), *marker,
        "--out", str(out), *more,
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("kind", "camera"),
    [("chessboard", LENS), ("charuco", LENS), ("tags", LENS), ("charuco", WIDE), ("tags", WIDE)],
)
def test_a_lens_is_recovered_from_pictures_within_its_deviations(
    shots, tmp_path, kind, camera, capsys
):
    out = tmp_path / "lens.toml"
    more, count = (["--fisheye"], 22) if camera.lens == "fisheye" else ([], 11)
    code = main(words(kind, shots(kind, camera, count, 0.6), out, *more))
    assert code == 0, capsys.readouterr()
    found = load_calibration(out)
    truth = np.array([camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px, *camera.distortion])
    known = found.deviations > 0.0
    off = np.abs(found.values - truth)[known] / found.deviations[known]
    assert off.max() < 5.0, off
    assert found.deviations[0] < 0.01 * camera.fx_px
    assert found.rms_px < 0.35
    assert found.views >= 8  # in some the board is cut by the frame


def test_boards_parallel_to_the_picture_are_refused_with_2_and_nothing_is_written(
    shots, tmp_path, capsys
):
    out = tmp_path / "lens.toml"
    assert main(words("chessboard", shots("chessboard", LENS, 4, 0.02), out)) == 2
    printed = capsys.readouterr()
    assert "focal length and distance cannot be separated" in printed.err
    assert "to add, the most informative first:" in printed.out
    assert not out.exists()


def test_inner_corners_given_as_squares_are_named_as_the_likely_mistake(shots):
    board = Board("chessboard", 8, 5, SQUARE_M)
    with pytest.raises(EyeError, match=r"counts squares: a board of 8 x 5 inner corners is 9x6"):
        from_files(board, shots("chessboard", LENS, 11, 0.6)[:2], lambda _: None)


def test_pictures_of_two_sizes_are_refused_by_name(shots, tmp_path):
    first = shots("chessboard", LENS, 11, 0.6)[0]
    small = tmp_path / "small.png"
    cv2.imwrite(str(small), cv2.imread(str(first))[:400])
    with pytest.raises(EyeError, match=r"small\.png: expected 800 x 500 px as .*, got 800 x 400"):
        from_files(BOARDS["chessboard"], [first, small], lambda _: None)


def test_of_a_film_each_new_place_where_the_board_is_held_still_is_one_view(shots, tmp_path):
    path = tmp_path / "film.avi"
    film = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 10.0, (800, 500))
    paths = shots("chessboard", LENS, 11, 0.6)
    for shown in (1, 1, 1, 2, 4, 4, 1, 1):  # 2 is gone before it was held still, 1 is not new again
        film.write(cv2.imread(str(paths[shown])))
    film.release()
    gathered = from_files(BOARDS["chessboard"], [path], lambda _: None)
    assert [view.name for view in gathered.views] == ["frame 1", "frame 5"]
    assert gathered.size == (800, 500)


def test_a_tag_grid_counts_from_its_lower_left():
    page, _ = page_of("tags")
    view = find_board(BOARDS["tags"], page, "page")
    low, right = view.pixels[0], view.pixels[4]
    assert low[1] > page.shape[0] * 0.7
    assert right[0] > low[0]
    np.testing.assert_allclose(view.points[4] - view.points[0], [SQUARE_M * 1.5, 0, 0], atol=1e-12)


def test_a_sliver_of_the_board_is_no_view():
    page, _ = page_of("tags")
    one_tag = np.ascontiguousarray(page[-MARGIN_PX - 76 :, : MARGIN_PX + 76])
    assert find_board(BOARDS["tags"], one_tag, "x") is None
    assert find_board(BOARDS["tags"], np.full((200, 300), 90, dtype=np.uint8), "x") is None


@pytest.mark.parametrize(
    ("board", "words_of_error"),
    [
        (("chessboard", 2, 6, 0.03), "squares: expected 3 to 60"),
        (("chessboard", 9, 6, 0.0), "square_m: expected above 0, got 0.0"),
        (("tags", 6, 4, 0.03), "marker_m: expected above 0 and below"),
        (("charuco", 9, 6, 0.03, 0.03), "marker_m: expected above 0 and below"),
        (("tags", 30, 20, 0.03, 0.02), "got up to 599"),
        (("charuco", 9, 6, 0.03, 0.02, "DICT_9X9"), "expected a name as DICT_4X4_50"),
        (("charuco", 12, 10, 0.03, 0.02), "holds 50 markers, the board has 60"),
    ],
)
def test_a_board_that_cannot_be_is_refused(board, words_of_error):
    with pytest.raises(EyeError, match=words_of_error):
        Board(*board)


def test_neither_pictures_nor_camera_is_bad_input(tmp_path, capsys):
    assert main(words("chessboard", [], tmp_path / "lens.toml")) == 2
    assert "only one of these" in capsys.readouterr().err
