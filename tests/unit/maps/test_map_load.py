import msgspec
import pytest

from scm.errors import MapError
from scm.maps.load import MAPS_DIR, load_map, map_names
from scm.maps.vehicle_tags import bound_tag
from scm.records.city_map import VehicleTag

GOOD = (MAPS_DIR / "driving_school.toml").read_text(encoding="utf-8")


def refused(tmp_path, *changes):
    """Return the message about the driving school after some changes of its text."""
    text = GOOD
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    path = tmp_path / "bad.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(MapError) as caught:
        load_map(path)
    message = str(caught.value)
    assert message.startswith(str(path))
    return message


def test_the_maps_that_come_along_are_listed():
    assert {"driving_school", "parking_school"} <= set(map_names())


def test_an_unknown_map_is_refused_with_the_nearest_name():
    with pytest.raises(MapError, match="did you mean 'driving_school'"):
        load_map("drivingschool")


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(MapError, match="no such map file"):
        load_map(tmp_path / "none.toml")


def test_a_map_is_loaded_by_path():
    assert load_map(MAPS_DIR / "driving_school.toml") == load_map("driving_school")


def test_broken_toml_is_refused_with_its_line(tmp_path):
    path = tmp_path / "broken.toml"
    path.write_text("map = 1\nname = \n", encoding="utf-8")
    with pytest.raises(MapError, match=r"broken.toml.*line 2"):
        load_map(path)


@pytest.mark.parametrize(
    ("old", "new", "key", "words"),
    [
        (
            'name = "east_loop"\nwidth_m = 0.257',
            'name = "east_loop"\nwidth_m = "wide"',
            "lanes[1].width_m (east_loop)",
            "expected a number, got text in quotes",
        ),
        ("z_m = 2.8\n", "", "cameras[0] (overhead)", "key z_m is missing"),
        ("z_m = 2.8", "z_m = 2.8\nzoom = 2", "cameras[0] (overhead)", "key zoom is not known here"),
        (
            "z_m = 2.8",
            "z_m = 2.8\nwidht_px = 2",
            "cameras[0] (overhead)",
            "key widht_px is not known here (did you mean 'width_px'?)",
        ),
        ("map = 1\n", "map = 2\n", "map", "expected 1 (the map format), got 2"),
        ("y_m = [-0.095, 1.405]", "y_m = [1.4]", "floor.y_m", "expected 2 values, got 1"),
    ],
)
def test_a_wrong_key_or_type_is_refused_in_plain_words(tmp_path, old, new, key, words):
    message = refused(tmp_path, (old, new))
    assert f": {key}: {words}" in message


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('next = ["east_loop"]', 'next = ["east_lop"]', "did you mean 'east_loop'?"),
        ('next = ["east_loop"]', 'next = ["west_loop"]', "'west_loop' does not connect"),
        (
            "start = [1.747806, 0.291194",
            "start = [1.749806, 0.291194",
            "(crossing_south_east).next: 'east_loop' does not connect",
        ),
        ("at_m = 0.3987", "at_m = 1.5", "(south_east).at_m: expected 0 to 1.3882"),
        ("light_id = 2", "light_id = 1", "lights[1].light_id: 1 is already that of lights[0]"),
        ('name = "b"', 'name = "a"', "spawns[1].name: 'a' is already that of spawns[0]"),
        ("first_vehicle_tag_id = 1", "first_vehicle_tag_id = 0", "more than tag.tag_id = 0, got 0"),
        (
            "first_vehicle_tag_id = 1",
            'first_vehicle_tag_id = 1\nvehicle_tags = [{vehicle = "red", tag_id = 0}]',
            "vehicle_tags[0] (red).tag_id: expected 0 to 586, and not the map's own 0, got 0",
        ),
        (
            "first_vehicle_tag_id = 1",
            "first_vehicle_tag_id = 1\nvehicle_tags = ["
            '{vehicle = "red", tag_id = 7}, {vehicle = "blue", tag_id = 7}]',
            "vehicle_tags[1].tag_id: 7 is already that of vehicle_tags[0]",
        ),
        ('kind = "left_curve"', 'kind = "left_curv"', "did you mean 'left_curve'?"),
        ("width_m = 0.257", "width_m = -0.257", "lanes[0].width_m: expected more than 0"),
        ("z_m = 2.8", "z_m = inf", "cameras[0].z_m: expected a finite number, got inf"),
        ("{length_m = 1.029}", "{length_m = 1.0, radius_m = 2.0}", "got length_m and radius_m"),
        ("from_m = 0.41", "from_m = 1.2", "movement.to_m: expected more than from_m = 1.2"),
        ("x_m = [-0.116, 2.884]", "x_m = [2.884, -0.116]", "floor.x_m: expected [low, high]"),
        ('group = "south_east"', 'group = "south"', "no group of crossing 'south'"),
        ("at_m = 0.54\n", "pose = [0.0, 0.0, 0.0]\n", "expected lane and at_m, or pose alone"),
    ],
)
def test_a_wrong_meaning_is_refused_with_its_key(tmp_path, old, new, words):
    assert words in refused(tmp_path, (old, new))


def test_all_problems_are_told_at_once(tmp_path):
    message = refused(
        tmp_path,
        ('next = ["east_loop"]', 'next = ["nowhere"]'),
        ("light_id = 2", "light_id = 1"),
        ("radius_m = 0.5145", "radius_m = 0.0"),
    )
    assert "3 problem(s)" in message
    assert message.count("\n") == 3


def test_a_name_that_the_map_binds_or_the_city_gives_has_a_tag_of_its_own():
    tags = (VehicleTag(vehicle="red", tag_id=12), VehicleTag(vehicle="blue", tag_id=3))
    city_map = msgspec.structs.replace(load_map("driving_school"), vehicle_tags=tags)
    names = ("red", "blue", "n1", "n3", "n12", "n586", "n587", "n0", "n01", "r1")
    bound = [bound_tag(city_map, name) for name in names]
    assert bound == [12, 3, 1, None, None, 586, None, None, None, None]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('name = "a2"', 'name = "a1"', "bays[2].name: 'a1' is already that of bays[0]"),
        ('name = "a2"', 'name = "a"', "bays[2] (a).name: expected no spawn's name"),
        (
            'name = "a2"',
            'name = "any"',
            "bays[2] (any).name: expected no spawn's name and not 'any'",
        ),
        (
            "pose = [-0.1, 1.7,",
            "pose = [-0.1, 2.7,",
            "pose: expected y from -2.05 to 2.05, got 2.7",
        ),
    ],
)
def test_a_bay_that_makes_no_sense_is_refused(tmp_path, old, new, words):
    text = (MAPS_DIR / "parking_lot.toml").read_text(encoding="utf-8")
    path = tmp_path / "bad.toml"
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(MapError) as caught:
        load_map(path)
    assert words in str(caught.value)
