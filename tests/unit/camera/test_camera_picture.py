"""What a picture shows: floor points at their pixels, near before far, lamps, light and shadow."""

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose

from scm.camera.daylight import Daylight
from scm.camera.floor import Floor
from scm.camera.lens import Lens
from scm.camera.mesh import Behind, Face, mesh_of, part_of
from scm.camera.painter import Painter, Thing
from scm.camera.studio import Studio
from scm.errors import EyeError
from scm.eye.detect import Settings, look
from scm.maps.load import load_map
from scm.maps.route import LanePath
from scm.records.boxes import SnapshotBox
from scm.scenery.bodies import car_rotation
from scm.scenery.solids import prism, rectangle
from scm.scenery.tags import tag_corners

UP = np.eye(3)
RED, BLUE = (0, 0, 250), (250, 0, 0)
FLAT = Daylight(ambient=1.0)


def seen_from(lens, pose):
    return lens.view(car_rotation(pose), np.array([pose.x_m, pose.y_m, 0.0]))


def take(studio, optics, car, cars=(), shown=None, camera="front", t_ns=0):
    return studio.picture(optics, car, [car, *cars], shown or {}, camera, t_ns).copy()


@pytest.mark.parametrize("distortion", [(0.0,) * 5, (-0.2, 0.05, 0.001, -0.001, 0.0)])
def test_the_corners_of_the_maps_tag_are_seen_where_they_are_projected(
    studio, optics, car, distortion
):
    given, pose = optics(distortion=distortion), car(0.57, 0.05, 3.1)
    picture = take(studio, given, pose)
    (tag,) = look(picture[:, :, 1], Settings(), 1.0, 0.0)
    assert tag.tag_id == 0
    lens = Lens(given)
    corners = np.column_stack((tag_corners(0.0762), np.zeros(4)))
    expected = lens.project(seen_from(lens, pose).seen(corners))
    off = [np.linalg.norm(expected - corner, axis=1).min() for corner in np.array(tag.corners_px)]
    assert max(off) < 0.6  # what the detector can do on a tag seen so flatly


def test_spots_on_the_floor_are_exactly_where_they_are_projected(city_map, optics, car):
    floor = Floor(city_map, FLAT).whole
    assert floor is not None
    spots = [(0.45, 0.02), (0.55, 0.1), (0.8, -0.2), (1.3, 0.1)]
    sheet = np.zeros(floor.levels[0].shape[:2])
    rows, columns = np.arange(sheet.shape[0])[:, None], np.arange(sheet.shape[1])
    for x, y in spots:
        texels = floor.texels_per_m
        at = (x - floor.corner[0]) * texels - 0.5, (floor.corner[1] - y) * texels - 0.5
        sheet += np.exp(-((columns - at[0]) ** 2) / 8.0) * np.exp(-((rows - at[1]) ** 2) / 8.0)
    levels = [np.repeat(np.rint(255.0 * sheet)[:, :, None], 3, axis=2).astype(np.uint8)]
    for _ in floor.levels[1:]:
        levels.append(cv2.pyrDown(levels[-1]))
    floor.levels = levels
    lens, pose = Lens(optics()), car(0.0, 0.0)
    view = seen_from(lens, pose)
    canvas = np.zeros((720, 1280, 3), np.uint8)
    floor.paint(canvas, lens, view, 1.0, (224, 720))
    for column, row in lens.project(view.seen(np.array([[x, y, 0.0] for x, y in spots]))):
        left, top = round(column) - 40, round(row) - 40
        grey = canvas[top : top + 81, left : left + 81, 0].astype(float)
        rows, columns = np.indices(grey.shape)
        middle = (columns * grey).sum() / grey.sum() + left, (rows * grey).sum() / grey.sum() + top
        # A spot of 2 mm is a little larger on its near side, and greys are whole numbers.
        assert_allclose(middle, (column, row), atol=0.15)


def box(x, colour, y=0.0, size=0.1):
    foot = rectangle(x, y, size, size)
    mesh = mesh_of((part_of(prism(foot, 0.0, 0.2, colour)),))
    return Thing(mesh, UP, np.zeros(3), np.array([x, y, 0.1]), 0.15)


@pytest.fixture
def painted(optics, car):
    """Paint things before a car at the origin on black; return the picture."""

    def paint(*things):
        lens = Lens(optics())
        canvas = np.zeros((720, 1280, 3), np.uint8)
        Painter(lens, FLAT, 1.0).paint(canvas, seen_from(lens, car(0.0, 0.0)), list(things))
        return canvas

    return paint


@pytest.mark.parametrize("turn", [1, -1])
def test_the_nearer_thing_hides_the_farther_whatever_came_first(painted, turn):
    picture = painted(*[box(0.6, RED), box(1.0, BLUE)][::turn])
    assert tuple(picture[300, 640]) == RED


def test_what_is_behind_the_lens_is_not_painted(painted):
    assert not painted(box(-0.5, RED)).any()


def test_a_thing_that_reaches_behind_the_lens_is_cut(painted):
    foot = rectangle(0.5, 0.3, 3.0, 0.05)
    mesh = mesh_of((part_of(prism(foot, 0.0, 0.2, RED)),))
    picture = painted(Thing(mesh, UP, np.zeros(3), np.array([0.5, 0.3, 0.1]), 1.6))
    columns = picture[:, :, 2].any(axis=0)
    assert columns[0]  # it leaves the picture on the left, where it passes the camera
    assert not columns[700:].any()


def test_parts_are_ordered_by_the_planes_between_them():
    def flat(z):
        return (Face(np.array([[0, 0, z], [1, 0, z], [0, 1, z]]), RED),)

    mesh = mesh_of((flat(0.0), Behind((flat(1.0), Behind(flat(2.0), 0, 1.0, 0.5)), 2, 1.0, 0.5)))
    assert list(mesh.order(np.array([0.0, 0.0, 3.0]))) == [0, 2, 1]
    assert list(mesh.order(np.array([1.0, 0.0, 3.0]))) == [0, 1, 2]
    assert list(mesh.order(np.array([1.0, 0.0, 0.0]))) == [1, 2, 0]


def test_a_car_does_not_see_itself(studio, optics, car):
    own = car(0.3, 0.3)
    empty = take(studio, optics(), own)
    assert (take(studio, optics(), own) == empty).all()
    other = take(studio, optics(), own, [car(1.0, 0.3, name="n2")])
    assert (other != empty).any()


def lamp_pixels(picture, colour, within=60):
    """Count the pixels about as red, green and blue as a lamp."""
    off = np.abs(picture.astype(int) - colour).max(axis=2)
    return int((off < within).sum())


def test_brake_lamps_of_the_car_in_front_are_seen(studio, optics, car):
    own, ahead = car(0.3, 0.6), {"x_m": 0.85, "y_m": 0.6, "name": "n2"}
    dark = take(studio, optics(), own, [car(**ahead)])
    lit = take(studio, optics(), own, [car(**ahead, lights=("brake",))])
    assert lamp_pixels(dark, (60, 50, 255)) < 50
    assert lamp_pixels(lit, (60, 50, 255)) > 400


@pytest.mark.parametrize(
    ("colour", "shown"),
    [("red", (40, 36, 255)), ("yellow", (40, 190, 255)), ("green", (110, 230, 60))],
)
def test_a_signal_head_shows_its_colour(studio, optics, car, colour, shown):
    # Before light 4, which looks north west.
    own = car(1.05, 0.55, -0.63)
    dark = take(studio, optics(), own)
    lit = take(studio, optics(), own, shown={4: colour})
    assert lamp_pixels(lit, shown) > lamp_pixels(dark, shown) + 100


def test_twice_the_light_or_the_exposure_is_twice_as_bright(city_map, optics, car):
    own = car(0.6, 0.5, 0.3)
    dim = take(Studio(city_map, Daylight(intensity=0.4)), optics(), own)
    bright = take(Studio(city_map, Daylight(intensity=0.8)), optics(), own)
    exposed = take(Studio(city_map, Daylight(intensity=0.4)), optics(exposure=2.0), own)
    assert_allclose(bright.astype(float), exposed, atol=1.0)
    middling = (bright > 40) & (bright < 250)
    assert np.median(bright[middling] / dim[middling]) == pytest.approx(2.0, rel=0.02)


def test_the_side_towards_the_sun_is_brighter():
    light = Daylight(azimuth=0.0).on_faces(np.array([[1.0, 0, 0], [-1.0, 0, 0], [0, 0, 1.0]]))
    assert light[0] > light[1]
    assert light[2] == pytest.approx(1.0)


def test_shadows_fall_away_from_the_sun():
    thrown = Daylight(azimuth=0.0, elevation=np.pi / 4).shadow_of(np.array([[0.0, 0.0, 0.2]]))
    assert_allclose(thrown, [[-0.2, 0.0]], atol=1e-12)


def test_impossible_light_is_refused():
    with pytest.raises(EyeError, match="sun elevation: expected"):
        Daylight(elevation=-0.2)


def test_the_floor_in_the_shadow_of_a_car_is_darker(studio, optics, car):
    own = car(0.3, 0.6)
    plain = take(studio, optics(), own).astype(int)
    shaded = take(studio, optics(), own, [car(1.0, 0.6, name="n2")]).astype(int)
    darker = (plain - shaded).sum(axis=2) > 30
    assert darker.sum() > 2000


def test_a_pushed_box_is_seen_where_it_was_pushed_to(optics, car):
    studio, own = Studio(load_map("parking_school_obstacles"), Daylight()), car(-0.4, 0.0)
    before = take(studio, optics(), own)
    box = SnapshotBox(name="right", x_m=0.5, y_m=0.0, yaw_rad=0.4)
    pushed = studio.picture(optics(), own, [own], {}, "front", 0, [box])
    # It stands in the way now: the middle of the picture was the far wall.
    assert (pushed[250, 640] != before[250, 640]).any()
    assert (studio.picture(optics(), own, [own], {}, "front", 0) == before).all()


def test_a_large_city_is_drawn_in_patches_and_looks_alike_from_next_door(optics, car):
    city = load_map("grid:6x6")
    studio = Studio(city, Daylight())
    assert studio._floor.whole is None
    lane = LanePath(city.lanes[0]).at(0.3)
    near, next_door = (car(lane.x + dx, lane.y, lane.yaw) for dx in (0.0, 0.004))
    first = take(studio, optics(), near).astype(int)
    assert first.std() > 20.0
    # Four millimetres on nearly every pixel is as it was, whichever patch it came from.
    second = take(studio, optics(), next_door).astype(int)
    assert (np.abs(first - second).max(axis=2) < 40).mean() > 0.95


@pytest.mark.parametrize("name", ["parking_school", "parking_school_obstacles"])
def test_maps_without_roads_are_pictured_too(optics, car, name):
    picture = take(Studio(load_map(name), Daylight()), optics(), car(-0.7, 0.3))
    assert picture.std() > 10.0


@pytest.mark.parametrize(("roll", "pitch"), [(3.14, 0.0), (1.57, 0.0), (0.0, 1.444), (0.0, -1.7)])
def test_a_car_on_its_roof_side_or_nose_has_pictures_too(studio, optics, car, roll, pitch):
    own = car(1.0, 0.6, roll_rad=roll, pitch_rad=pitch)
    assert take(studio, optics(), own, [car(1.4, 0.6, name="n2")]).shape == (720, 1280, 3)


def test_the_same_instant_is_the_same_picture(city_map, optics, car):
    given = optics(read_noise=2.0, shot_noise=3.0)
    cars = [car(0.3, 0.6), car(0.9, 0.6, name="n2", lights=("left",))]
    first, second = (take(Studio(city_map, Daylight(), 3), given, cars[0], cars[1:]) for _ in "ab")
    assert (first == second).all()
