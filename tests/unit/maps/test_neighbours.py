import pytest

from scm.errors import MapError
from scm.maps.load import MAPS_DIR, map_of
from scm.records.city_map import BorderRoad, Neighbour

GOOD = (
    (MAPS_DIR / "driving_school.toml").read_text(encoding="utf-8")
    + """
[[lanes]]
name = "east_out"
width_m = 0.257
start = [1.0, 1.0, 0.0]
segments = [{length_m = 1.0}]
speed_limit_mps = 0.5

[[neighbours]]
city = "lab_b"
origin = [12.0, 0.0, 0.0]
roads = [{out = "east_out", to = "west_in"}]
messages = ["states", "cams", "spatem"]
"""
)


def load(text, tmp_path):
    return map_of(text, tmp_path / "city.toml")


def test_neighbour_is_read_with_its_origin_its_roads_and_its_messages(tmp_path):
    (neighbour,) = load(GOOD, tmp_path).neighbours
    assert neighbour == Neighbour(
        city="lab_b",
        origin=(12.0, 0.0, 0.0),
        roads=(BorderRoad(out="east_out", to="west_in"),),
        messages=("states", "cams", "spatem"),
    )


def test_neighbour_lets_the_other_city_see_nothing_unless_the_map_says_so(tmp_path):
    text = GOOD.replace('messages = ["states", "cams", "spatem"]', "")
    assert load(text, tmp_path).neighbours[0].messages == ()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            'out = "east_out"',
            'out = "east_ou"',
            "roads[0].out: no lane 'east_ou' (did you mean 'east_out'?)",
        ),
        ('out = "east_out"', 'out = "east_loop"', "expected no next lane, got"),
        ('city = "lab_b"', 'city = "Lab B"', "neighbours[0].city"),
        ('"cams"', '"cam"', "messages: no message 'cam' (did you mean 'cams'?)"),
        ("[12.0, 0.0, 0.0]", "[12.0, nan, 0.0]", "origin[1]: expected a finite number, got nan"),
        (
            "[[neighbours]]",
            '[[neighbours]]\ncity = "lab_b"\n\n[[neighbours]]',
            "neighbours[1] (lab_b).city: 'lab_b' is already that of neighbours[0]",
        ),
        (
            "[[neighbours]]",
            '[[neighbours]]\ncity = "lab_c"\nroads = [{out = "east_out", to = "a"}]\n\n'
            "[[neighbours]]",
            "lane 'east_out' already leads out at neighbours[0] (lab_c).roads[0].out",
        ),
    ],
)
def test_wrong_neighbour_is_refused_with_its_key(tmp_path, old, new, words):
    assert old in GOOD
    with pytest.raises(MapError) as caught:
        load(GOOD.replace(old, new, 1), tmp_path)
    assert words in str(caught.value)
