"""Keys: build, parse, select, match."""

import pytest

from scm.errors import MessageError
from scm.v2x.key import agrees, check_name, everything, intersects, key_of, matches, parse, selector
from scm.v2x.messages.cam import CamRx
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.eye_pose import EyePose


def event(source="world"):
    return CityEvent(severity="info", source=source, t_ns=0, name="n", text="t")


def test_a_key_is_the_city_and_the_fields_that_its_class_names():
    assert key_of("berlin", event()) == "scm/@v1/berlin/event/info/world"


@pytest.mark.parametrize("name", ["", "N7", "n 7", "n/7", "n*", "ü", "a" * 33, "n7\n"])
def test_names_that_zenoh_or_people_would_stumble_over_are_refused(name):
    with pytest.raises(MessageError, match=r"vehicle: got .*expected 1 to 32 of a-z 0-9 _ -"):
        check_name(name, "vehicle")


@pytest.mark.parametrize("name", ["n7", "tag-12", "a" * 32, "0_x"])
def test_ordinary_names_are_accepted(name):
    assert check_name(name, "vehicle") == name


def test_a_bad_name_in_a_message_is_refused_with_its_field():
    with pytest.raises(MessageError, match=r"CityEvent\.source: got 'The World'"):
        key_of("city", event("The World"))


def test_a_selector_leaves_open_what_is_not_named():
    assert selector("city", EyePose, {"vehicle": "n1"}) == "scm/@v1/city/eye/*/pose/n1"
    assert selector("city", CityStop, {}) == "scm/@v1/city/world/stop"


def test_a_selector_refuses_parts_that_the_key_does_not_have():
    with pytest.raises(MessageError, match=r"EyePose.*no part named 'car', only \['camera'"):
        selector("city", EyePose, {"car": "n1"})


def test_a_selector_refuses_wildcards_in_disguise():
    with pytest.raises(MessageError, match=r"EyePose\.vehicle: got '\*\*'"):
        selector("city", EyePose, {"vehicle": "**"})


def test_parse_gives_back_what_built_the_key():
    assert parse("city", CamRx, "scm/@v1/city/v2x/rx/n1/n2/cam") == {
        "receiver": "n1",
        "station": "n2",
    }


@pytest.mark.parametrize(
    "key", ["scm/@v1/other/v2x/rx/n1/n2/cam", "scm/@v1/city/v2x/rx/n1/cam", "scm/@v2/city/x", ""]
)
def test_parse_refuses_keys_of_other_classes_cities_and_versions(key):
    with pytest.raises(MessageError, match=r"CamRx: got key .*expected scm/@v1/city/v2x/rx/"):
        parse("city", CamRx, key)


@pytest.mark.parametrize(
    ("expression", "key", "expected"),
    [
        ("a/*/c", "a/b/c", True),
        ("a/*/c", "a/b/d", False),
        ("a/*/c", "a/b/b/c", False),
        ("a/**", "a/b/c", True),
        ("a/**", "a", True),
        ("a/**", "b/c", False),
        ("a/b/**", "a", False),
        ("a/b", "a/b/c", False),
        ("a/*/c", "a/@b/c", False),
        ("a/**", "a/b/@c/d", False),
        ("a/*/@c/*", "a/b/@c/d", True),
    ],
)
def test_matching_follows_the_rules_of_key_expressions(expression, key, expected):
    assert matches(expression, key) is expected


def test_everything_matches_every_key_of_the_city_and_none_of_another():
    assert matches(everything("city"), key_of("city", event()))
    assert not matches(everything("city"), key_of("city2", event()))


def test_a_message_agrees_with_its_own_key_only():
    assert agrees("scm/@v1/city/event/info/world", event("world"))
    assert not agrees("scm/@v1/city/event/info/n7", event("world"))
    for wrong in ("nR", "", "n 7", "né", "a" * 33):
        assert not agrees(f"scm/@v1/city/event/info/{wrong}", event(wrong))


@pytest.mark.parametrize(
    ("one", "other", "expected"),
    [
        ("a/*/c", "a/b/*", True),
        ("a/*", "b/*", False),
        ("a/**", "a/b/*", True),
        ("a/**", "a/b/@c/*", False),
        ("a/*", "a/*/c", False),
    ],
)
def test_two_expressions_meet_if_one_key_matches_both(one, other, expected):
    assert intersects(one, other) is expected
    assert intersects(other, one) is expected
