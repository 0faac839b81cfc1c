"""What Foxglove gets: channels of its own schemas, in the form that its reader understands."""

import io
import json

import pytest
from mcap.reader import make_reader

from scm.recorder.foxglove import write_foxglove
from scm.recorder.run_index import read_index
from tests.unit.recorder.short_run import PICTURE, write_run

READABLE = {"boolean", "string", "number", "integer", "object", "array"}


@pytest.fixture(scope="module")
def channels(tmp_path_factory):
    """Messages by topic, with their schemas."""
    index = read_index(write_run(tmp_path_factory.mktemp("run") / "run.mcap"))
    stream = io.BytesIO(b"".join(write_foxglove(index)))
    found = {}
    for schema, channel, message in make_reader(stream).iter_messages():
        assert (channel.message_encoding, schema.encoding) == ("json", "jsonschema")
        rows = found.setdefault(channel.topic, (schema, []))[1]
        rows.append(json.loads(message.data))
    return found


def test_cars_roads_signals_numbers_pictures_and_the_log_are_there(channels):
    kinds = {topic: schema.name for topic, (schema, _) in channels.items()}
    assert kinds == {
        "/map": "foxglove.SceneUpdate",
        "/tf": "foxglove.FrameTransforms",
        "/cars": "foxglove.SceneUpdate",
        "/signals": "foxglove.SceneUpdate",
        "/events": "foxglove.Log",
        "/eye/overhead": "foxglove.CompressedImage",
        "/n1/state": "scm.CarState",
        "/n10/state": "scm.CarState",
    }


def test_every_schema_spells_out_each_object_and_one_type_a_field(channels):
    def check(schema, where):
        assert schema["type"] in READABLE, where
        assert not {"$ref", "anyOf", "oneOf"} & set(schema), where
        if schema["type"] == "object":
            for name, field in schema["properties"].items():
                check(field, f"{where}.{name}")
        if schema["type"] == "array":
            check(schema["items"], f"{where}[]")

    for topic, (schema, _) in channels.items():
        check(json.loads(schema.data), topic)


def test_every_message_has_exactly_the_fields_of_its_schema(channels):
    def check(schema, value, where):
        kind = schema["type"]
        if kind == "object":
            assert set(value) == set(schema["properties"]), where
            for name, field in schema["properties"].items():
                check(field, value[name], f"{where}.{name}")
        elif kind == "array":
            for item in value:
                check(schema["items"], item, f"{where}[]")
        else:
            wanted = {"boolean": bool, "string": str, "number": (int, float), "integer": int}[kind]
            assert isinstance(value, wanted), where

    for topic, (schema, rows) in channels.items():
        for row in rows:
            check(json.loads(schema.data), row, topic)


def test_a_car_is_where_the_run_had_it(channels):
    _, rows = channels["/tf"]
    at = {one["child_frame_id"]: one["translation"]["x"] for one in rows[40]["transforms"]}
    assert at == {"n1": 2.0, "n10": -2.0}


def test_cars_are_told_again_each_second_because_a_seek_knows_one_message(channels):
    _, rows = channels["/cars"]
    assert len(rows) == 6
    assert [one["id"] for one in rows[-1]["entities"]] == ["n1", "n10"]


def test_signals_are_told_when_they_change(channels):
    _, rows = channels["/signals"]
    assert len(rows) == 2
    green = [one for one in rows[1]["entities"] if one["spheres"][0]["color"]["g"] > 0.8]
    assert green


def test_a_picture_is_the_jpeg_that_was_recorded(channels):
    import base64

    _, rows = channels["/eye/overhead"]
    assert base64.b64decode(rows[0]["data"]) == PICTURE


def test_warnings_stay_warnings(channels):
    _, rows = channels["/events"]
    assert [(row["level"], row["message"]) for row in rows] == [
        (2, "n1 stands on the map"),
        (3, "n1 hit a wall"),
    ]
