"""Floor data in map files: what is read, and what is refused in words."""

import zlib

import cv2
import numpy as np
import pytest

from scm.errors import MapError
from scm.maps.floor_shapes import is_convex, outline_of, pieces_of, signed_area
from scm.maps.grey import read_grey, unpack
from scm.maps.load import MAPS_DIR, load_map
from scm.records.floor import Floor, Patch, Plate, Ramp
from scm.v2x.message import decode, encode
from scm.v2x.messages.world_definition import WorldDefinition

HEAD = """map = 1
name = "n"
title = "t"
source = "s"
[tag]
tag_id = 0
size_m = 0.1
"""
FLOOR = "[floor]\nx_m = [-2.0, 2.0]\ny_m = [-1.0, 1.0]\n"


def loaded(tmp_path, text):
    path = tmp_path / "n.toml"
    path.write_text(HEAD + FLOOR + text, encoding="utf-8")
    return load_map(path)


def refused(tmp_path, text):
    with pytest.raises(MapError) as caught:
        loaded(tmp_path, text)
    return str(caught.value)


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
@pytest.mark.parametrize("ending", ["png", "pgm"])
def test_grey_pictures_are_read_value_for_value(tmp_path, kind, ending):
    values = np.random.default_rng(0).integers(0, np.iinfo(kind).max, (37, 23)).astype(kind)
    values[0, 0] = np.iinfo(kind).max
    path = tmp_path / f"p.{ending}"
    cv2.imwrite(str(path), values)
    assert (unpack(read_grey(path))[::-1] == values).all()


def test_an_array_of_numbers_is_a_picture_too(tmp_path):
    heights = np.linspace(-0.01, 0.02, 12).reshape(3, 4)
    np.save(tmp_path / "h.npy", heights)
    assert unpack(read_grey(tmp_path / "h.npy"))[::-1] == pytest.approx(heights, abs=1e-9)


def test_a_picture_of_greys_may_have_the_form_of_a_coloured_one(tmp_path):
    values = np.arange(16, dtype=np.uint8).reshape(4, 4)
    cv2.imwrite(str(tmp_path / "p.png"), cv2.cvtColor(values, cv2.COLOR_GRAY2BGRA))
    assert (unpack(read_grey(tmp_path / "p.png"))[::-1] == values).all()


@pytest.mark.parametrize(("channel", "got"), [(1, "colours"), (3, "transparent pixels")])
def test_a_picture_that_is_not_grey_is_refused_with_what_to_do(tmp_path, channel, got):
    values = np.full((4, 4, 4), 255, np.uint8)
    values[0, 0, channel] = 9
    cv2.imwrite(str(tmp_path / "p.png"), values)
    with pytest.raises(MapError, match=f"got {got}: save it as greyscale without alpha"):
        read_grey(tmp_path / "p.png")


def test_a_damaged_png_is_refused(tmp_path):
    path = tmp_path / "p.png"
    cv2.imwrite(str(path), np.zeros((40, 40), np.uint8))
    path.write_bytes(path.read_bytes()[:-30])
    with pytest.raises(MapError, match="cannot be read and begins with"):
        read_grey(path)


FRICTION = '[floor.friction_map]\nimage = "{}"\nx_m = [{}]\ny_m = [0.0, 1.0]\n'
HILLS = '[floor.height_map]\nimage = "{}"\nx_m = [0.0, 1.0]\ny_m = [0.0, 1.0]\nm_per_grey = {}\n'


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (FRICTION.format("none.png", "0.0, 1.0"), "floor.friction_map.image: "),
        (FRICTION.format("none.png", "0.0, 1.0"), "there is no such picture"),
        (FRICTION.format("grey.png", "1.0, 0.0"), "friction_map.x_m: expected [low, high]"),
        (
            FRICTION.format("grey.png", "0.0, 1.0") + "grip = [0.0, 3.0]",
            "grip (white): expected 0 to 2, got 3",
        ),
        (HILLS.format("grey.png", "0.1"), "slopes of at most 1 between pixels"),
        (HILLS.format("grey.png", "1e-4"), "rim at height 0 within 0.001 m"),
        ('[[floor.patches]]\nname = "p"\nx_m = 0.0\ny_m = 0.0\n', "got none"),
        ('[[floor.patches]]\nname = "p"\nx_m = 0.0\nradius_m = 1.0\n', "key y_m is missing"),
        (
            '[[floor.patches]]\nname = "p"\nx_m = 0.0\ny_m = 0.0\nradius_m = 1.0\ngrip = -1.0',
            "floor.patches[0] (p).grip: expected 0 to 2, got -1",
        ),
        (
            '[[floor.patches]]\nname = "p"\nx_m = 0.0\ny_m = 0.0\nradius_m = 1.0\nlength_m = 1.0',
            "got radius_m and length_m and width_m",
        ),
        (
            '[[floor.plates]]\nname = "p"\nheight_m = 0.01\npoints = [[0,0],[1,0],[0.2,0.2],[0,1]]',
            "expected a convex outline",
        ),
        (
            '[[floor.ramps]]\nname = "r"\nx_m=0\ny_m=0\nlength_m = 0.1\nwidth_m=1.0\nto_m = 0.1',
            "slope of at most 0.35, got 1",
        ),
        ('[[floor.patches]]\nname = "p"\nradus_m = 1.0\n', "did you mean 'radius_m'?"),
        ("[wind]\nx_mps = 80.0\n", "wind.x_mps: expected -50 to 50, got 80"),
        ("[wind]\ngust_mps = 1.0\ngust_s = 0.0\n", "wind.gust_s: expected more than 0"),
    ],
)  # fmt: skip
def test_bad_floor_data_is_refused_with_key_and_reason(tmp_path, text, words):
    cv2.imwrite(str(tmp_path / "grey.png"), np.tile(np.arange(0, 240, 24, dtype=np.uint8), (9, 1)))
    assert words in refused(tmp_path, text)


def test_the_floor_travels_with_the_map_to_those_without_its_files():
    city_map = load_map("proving_ground")
    sent = WorldDefinition(t_ns=1, seed=2, map=city_map)
    body, attachment = encode(sent)
    assert decode(WorldDefinition, body, attachment).map == city_map
    assert len(body) < 40_000


def test_maps_without_floor_data_say_nothing_of_it():
    floor = load_map("driving_school").floor
    assert floor == Floor(x_m=floor.x_m, y_m=floor.y_m, colour=floor.colour)
    assert "floor.patches" not in (MAPS_DIR / "driving_school.toml").read_text(encoding="utf-8")


def test_outlines_run_counter_clockwise_whatever_way_they_are_given():
    points = ((0.0, 0.0), (0.0, 1.0), (1.0, 1.0))
    assert signed_area(outline_of(Patch(name="p", points=points))) == pytest.approx(0.5)
    square = Plate(name="q", height_m=0.01, x_m=1.0, y_m=2.0, length_m=2.0, width_m=1.0)
    assert signed_area(outline_of(square)) == pytest.approx(2.0)
    assert is_convex(outline_of(square))


def test_a_ramp_rises_along_its_yaw_from_end_to_end():
    ramp = Ramp(name="r", x_m=1.0, y_m=1.0, yaw_rad=np.pi / 2, length_m=2.0, width_m=1.0,
                from_m=0.1, to_m=0.3)  # fmt: skip
    (piece,) = pieces_of(Floor(x_m=(0, 1), y_m=(0, 1), ramps=(ramp,)))
    heights = [piece.at + piece.rise_x * 1.0 + piece.rise_y * y for y in (0.0, 1.0, 2.0)]
    assert heights == pytest.approx([0.1, 0.2, 0.3])


def test_packed_pictures_are_checked_when_they_are_unpacked():
    city_map = load_map("proving_ground")
    samples = city_map.floor.friction_map.samples
    short = type(samples)(rows=9, columns=9, kind="uint8", packed=zlib.compress(b"123"))
    with pytest.raises(MapError, match="cannot be unpacked"):
        unpack(short)
