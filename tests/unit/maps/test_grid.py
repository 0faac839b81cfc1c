"""Scanned grids: what a cell is, by its picture and its yaml, and what is refused."""

import struct
import tracemalloc
import zlib

import cv2
import numpy as np
import pytest

from scm.errors import MapError
from scm.maps.grid import MAX_CELLS, load_occupancy
from scm.maps.load import load_map

# Occupied, unknown as map savers write it, free.
THREE = np.array([[0, 205, 254]], np.uint8)


def scan(folder, picture=THREE, **changes):
    """Write a picture, given as pixels or as bytes, and its yaml; a key of None is left out."""
    if isinstance(picture, bytes):
        (folder / "room.png").write_bytes(picture)
    elif picture is not None:
        cv2.imwrite(str(folder / "room.png"), picture)
    keys = {
        "image": "room.png",
        "resolution": 0.05,
        "origin": [0.0, 0.0, 0.0],
        "negate": 0,
        "occupied_thresh": 0.65,
        "free_thresh": 0.196,
    } | changes
    path = folder / "room.yaml"
    lines = [f"{key}: {value}\n" for key, value in keys.items() if value is not None]
    path.write_text("".join(lines), encoding="utf-8")
    return path


def cells_of(path):
    """Return the grid as text, top row first: # occupied, . free, ? unknown."""
    grid = load_occupancy(path)
    signs = np.where(grid.free, ".", np.where(grid.occupied, "#", "?"))[::-1]
    return ["".join(row) for row in signs]


def chunk(name, body):
    return struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))


def png(header, *chunks):
    """Return a PNG picture, which OpenCV would not write."""
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        chunk(name, body)
        for name, body in ((b"IHDR", struct.pack(">IIBBBBB", *header)), *chunks, (b"IEND", b""))
    )


PALETTE = b"".join(bytes([grey] * 3) for grey in THREE[0])
PICTURES = {
    "grey": THREE,
    "grey of 16 bits": THREE.astype(np.uint16) * 257,
    "colours": cv2.cvtColor(THREE, cv2.COLOR_GRAY2BGR),
    "colours and alpha": cv2.cvtColor(THREE, cv2.COLOR_GRAY2BGRA),
    "palette": png(
        (3, 1, 8, 3, 0, 0, 0), (b"PLTE", PALETTE), (b"IDAT", zlib.compress(b"\0\0\1\2"))
    ),
    "grey and alpha": png(
        (3, 1, 8, 4, 0, 0, 0), (b"IDAT", zlib.compress(b"\0\0\xff\xcd\xff\xfe\xff"))
    ),
    "PGM": b"P5\n# CREATOR: map_saver 0.050 m/pix\n3 1\n255\n\x00\xcd\xfe",
    "PGM of 16 bits": b"P5 3 1 65535\n\x00\x00\xcd\xcd\xfe\xfe",
    "PGM as text": b"P2\n3 1 # columns, rows\n255\n0 205\n254\n",
    "PGM with white of 51": b"P5 3 1 51\n\x00\x29\x33",
    "PGM with DOS lines": b"P5\r\n3 1\r\n255\r\n\x00\xcd\xfe",
    "PPM": b"P6 3 1 255\n\x00\x00\x00\xcd\xcd\xcd\xfe\xfe\xfe",
}


@pytest.mark.parametrize("threshold", [0.196, 0.25])
@pytest.mark.parametrize("kind", PICTURES)
def test_every_kind_of_grey_picture_is_read_and_the_unknown_is_never_free(
    tmp_path, kind, threshold
):
    assert cells_of(scan(tmp_path, PICTURES[kind], free_thresh=threshold)) == ["#?."]


def test_a_bitmap_has_walls_and_free_cells(tmp_path):
    assert cells_of(scan(tmp_path, b"P1\n3 1\n1 0 1\n")) == ["#.#"]


def test_it_is_said_that_grey_205_is_unknown_though_the_threshold_calls_it_free(tmp_path):
    path = scan(tmp_path, np.repeat(THREE, 5, axis=0), free_thresh=0.25)
    assert "5 cells of grey 205 are unknown" in load_occupancy(path).notes[0]
    assert load_occupancy(scan(tmp_path)).notes == ()


def test_transparent_cells_are_unknown_in_every_mode(tmp_path):
    picture = np.full((1, 2, 4), 255, np.uint8)
    picture[0, 1, 3] = 254
    for mode in ("trinary", "scale"):
        assert cells_of(scan(tmp_path, picture, mode=mode)) == [".?"]
    assert "1 cells that are not opaque" in load_occupancy(scan(tmp_path, picture)).notes[0]


def test_in_mode_scale_the_thresholds_alone_decide(tmp_path):
    assert cells_of(scan(tmp_path, mode="scale", free_thresh=0.25)) == ["#.."]


def test_in_mode_raw_greys_are_per_cent_and_what_is_above_100_is_unknown(tmp_path):
    picture = np.array([[0, 19, 20, 65, 66, 100, 101, 255]], np.uint8)
    assert cells_of(scan(tmp_path, picture, mode="raw")) == ["..??##??"]
    wide = picture.astype(np.uint16) * 257
    assert cells_of(scan(tmp_path, wide, mode="raw")) == ["..??##??"]


@pytest.mark.parametrize(
    ("written", "cells"),
    [
        *((value, "#?.") for value in (0, '"0"', "false", '"False"', "no", "0.0", '"off"', None)),
        *((value, ".##") for value in (1, '"1"', "true", '"yes"', "1.0")),
    ],
)
def test_negate_counts_by_its_value(tmp_path, written, cells):
    assert cells_of(scan(tmp_path, negate=written)) == [cells]


def test_a_negated_map_has_a_negated_unknown(tmp_path):
    assert cells_of(scan(tmp_path, 255 - THREE, negate=1, free_thresh=0.25)) == ["#?."]


@pytest.mark.parametrize(
    "changes",
    [
        {"resolution": '"0.05"'},
        {"resolution": "5e-2"},  # YAML 1.1 takes it for text
        {"origin": '["1", 2, "-0.5"]'},
        {"origin": '"[1.0, 2, -.5]"'},
        {"origin": "(1, 2, -0.5)"},
        {"occupied_thresh": '"0.65"', "free_thresh": '"0.196"'},
        {"mode": '"Trinary"'},
        {"image": '"room.png"'},
    ],
)
def test_values_count_whatever_way_they_are_written(tmp_path, changes):
    grid = load_occupancy(scan(tmp_path, **({"origin": [1, 2, -0.5]} | changes)))
    assert (grid.cell_m, tuple(grid.origin)) == (0.05, (1.0, 2.0, -0.5))
    assert grid.free.sum() == 1


def test_a_picture_is_found_by_any_path(tmp_path):
    folder = tmp_path / "Karte (2) für uns"
    folder.mkdir()
    cv2.imwrite(str(folder / "room.png"), THREE)
    for image in ("room.png", str(folder / "room.png"), f"../{folder.name}/room.png"):
        path = scan(folder, None, image=image)
        assert cells_of(path.rename(folder / "Room 1.YAML")) == ["#?."]


def test_keys_that_mean_nothing_are_reported(tmp_path):
    assert load_occupancy(scan(tmp_path, author="me")).notes == (
        "keys that mean nothing here: author",
    )


@pytest.mark.parametrize(
    ("picture", "changes", "words"),
    [
        (b"", {}, "expected a picture such as PNG or PGM that is whole, got one that cannot be"),
        (b"hello world", {}, "begins with b'hello wo': save it anew"),
        (b"\x89PNG\r\n\x1a\n", {}, "begins with b'\\x89PNG"),
        (b"BM" + 24 * b"\x7f", {}, "begins with b'BM"),
        (b"P5 3 3 255\n\xff", {}, "expected 3 x 3 pixels, got 1"),
        (b"P5 0 3 255\n", {}, "expected 0 x 3 pixels, got 0"),
        (b"P5 1 1 0\n\x00", {}, "expected a largest grey value of 1 to 65535, got 0"),
        (b"P5 1 1 99\n\xff", {}, "expected grey values of 0 to 99, got 255"),
        (b"P2 2 1 255\n1 -1\n", {}, "its pixels must be whole numbers"),
        (b"P5 99999 99999 255\n", {}, f"at most {MAX_CELLS} pixels, got 99999 x 99999"),
        (png((90000, 90000, 8, 0, 0, 0, 0)), {}, f"at most {MAX_CELLS} pixels, got 90000 x 90000"),
        (None, {"image": "none.pgm"}, "none.pgm: there is no such picture"),
        (THREE, {"image": "/home/me/room.png"}, "room.png lies beside room.yaml: write `image: ro"),
        (THREE, {"image": "maps\\room.png"}, "room.png lies beside room.yaml"),
        (None, {"image": "."}, "expected a picture, got a folder"),
        (None, {"image": '""'}, "image: expected the name of a picture file, got ''"),
        (None, {"image": "[a, b]"}, "image: expected the name of a picture file"),
        (None, {"image": "x" * 5000}, "cannot be read: File name too long"),
        (None, {"resolution": "fine"}, "resolution: expected a finite number, got 'fine'"),
        (None, {"resolution": "true"}, "resolution: expected a finite number, got True"),
        (None, {"resolution": 0}, "resolution: expected 0.0001 to 100, got 0"),
        (None, {"resolution": ".nan"}, "resolution: expected a finite number, got nan"),
        (None, {"origin": "[0, 0]"}, r"origin: expected [x, y, yaw], got [0, 0]"),
        (None, {"origin": "[0, null, 0]"}, r"origin[1]: expected a finite number, got None"),
        (None, {"origin": "[0, 0, 90]"}, r"origin[2]: expected -6.28319 to 6.28319 rad, got 90"),
        (None, {"origin": None}, "key origin is missing: expected a scanned map"),
        (None, {"free_thresh": None, "free_tresh": 0.2}, "got free_tresh (did you mean 'free_thr"),
        (None, {"occupied_thresh": 65}, "occupied_thresh: expected 0 to 1, got 65"),
        (None, {"free_thresh": 0.7}, "free_thresh: expected at most occupied_thresh (0.65)"),
        (None, {"negate": "maybe"}, "negate: expected 0 or 1, got 'maybe'"),
        (None, {"negate": 2}, "negate: expected 0 or 1, got 2"),
        (None, {"mode": "raw", "negate": 1}, "negate: expected 0 in mode raw"),
        (None, {"mode": "grey"}, "mode: expected trinary, scale, raw, got 'grey'"),
        (None, {"mode": "scale\nmode: raw"}, "line 8: the key 'mode' stands twice"),
        (None, {"mode": "'"}, "not a YAML file that can be read"),
        (np.full((2, 2), 205, np.uint8), {}, "expected free cells, got none: 0 occupied, 4 unk"),
    ],
)
def test_a_bad_scan_is_refused_in_words_that_name_its_yaml(tmp_path, picture, changes, words):
    with pytest.raises(MapError) as caught:
        load_map(scan(tmp_path, picture, **changes))
    assert words in str(caught.value)
    assert str(caught.value).startswith(f"{tmp_path / 'room.yaml'}: ")


def test_a_picture_without_its_yaml_is_refused(tmp_path):
    scan(tmp_path)
    with pytest.raises(MapError, match=r"got a picture: give the \.yaml that describes its cells"):
        load_map(tmp_path / "room.png")


@pytest.mark.parametrize("depth", [np.uint8, np.uint16])
def test_a_scan_takes_at_most_40_bytes_a_cell(tmp_path, depth):
    room = np.pad(np.full((598, 598, 3), np.iinfo(depth).max, depth), ((1, 1), (1, 1), (0, 0)))
    path = scan(tmp_path, room, resolution=0.01, origin=[-3.0, -3.0, 0.0])
    tracemalloc.start()
    load_map(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 40 * 600 * 600
