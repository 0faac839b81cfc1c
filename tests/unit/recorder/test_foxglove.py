"""What Foxglove gets: channels of its own schemas, in the form that its reader understands."""

import base64
import io
import json
import math
import struct
from pathlib import Path

import pytest
from mcap.reader import make_reader

from scm.recorder.foxglove import write_foxglove
from scm.recorder.run_index import read_index
from tests.unit.recorder.short_run import PICTURE, YAW_RAD, write_run

LAYOUT = Path(__file__).parents[3] / "scm/api/static/foxglove_layout.json"
READABLE = {"boolean", "string", "number", "integer", "object", "array"}


@pytest.fixture(scope="module")
def channels(tmp_path_factory):
    return channels_of(write_run(tmp_path_factory.mktemp("run") / "run.mcap"))


def channels_of(run):
    """Return a run's messages by topic, with their schemas."""
    stream = io.BytesIO(b"".join(write_foxglove(read_index(run))))
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
        "/n1/scan": "foxglove.PointCloud",
        "/n1/costmap": "foxglove.Grid",
        "/n1/map": "foxglove.Grid",
        "/n1/path": "foxglove.PosesInFrame",
        "/n1/plan": "foxglove.SceneUpdate",
        "/n1/particles": "foxglove.PosesInFrame",
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
    for one in rows[40]["transforms"]:
        turned = one["rotation"]
        assert 2.0 * math.atan2(turned["z"], turned["w"]) == pytest.approx(YAW_RAD)


def test_cars_are_told_again_each_second_because_a_seek_knows_one_message(channels):
    _, rows = channels["/cars"]
    assert len(rows) == 6
    assert [one["id"] for one in rows[-1]["entities"]] == ["n1", "n10"]


def test_a_car_that_left_is_taken_away(tmp_path):
    _, rows = channels_of(write_run(tmp_path / "run.mcap", 2.0, leaves_s=1.5))["/cars"]
    gone = [[one["id"] for one in row["deletions"]] for row in rows]
    assert gone == [[], [], ["n10"]]
    assert [one["id"] for one in rows[-1]["entities"]] == ["n1"]


def test_signals_are_told_when_they_change(channels):
    _, rows = channels["/signals"]
    assert len(rows) == 2
    shown = [{one["texts"][0]["text"] for one in row["entities"]} for row in rows]
    assert shown == [{"R", "D"}, {"G", "D"}]
    for light in rows[1]["entities"]:
        is_green = light["spheres"][0]["color"]["g"] > 0.8
        assert is_green == (light["texts"][0]["text"] == "G")


def test_the_floor_lies_under_the_roads(channels):
    _, (update,) = channels["/map"]
    (roads,) = update["entities"]
    (floor,) = roads["cubes"]
    middle, size = floor["pose"]["position"], floor["size"]
    assert middle["z"] + 0.5 * size["z"] < 0.0
    lines = [(point["x"], point["y"]) for line in roads["lines"] for point in line["points"]]
    assert all(
        abs(at - middle[axis]) <= 0.5 * size[axis] + 1e-9
        for place in lines
        for axis, at in zip("xy", place, strict=True)
    )


def test_a_scan_is_points_where_its_beams_hit_from_where_the_scanner_is(channels):
    _, (cloud,) = channels["/n1/scan"]
    assert cloud["frame_id"] == "n1"
    scanner = cloud["pose"]["position"]
    assert (scanner["x"], scanner["z"]) == pytest.approx((0.1445, 0.1757), abs=1e-4)
    points = list(struct.iter_unpack("<3f", base64.b64decode(cloud["data"])))
    ahead, left, right = [(1.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, -0.5, 0.0)]
    assert [pytest.approx(one, abs=1e-6) for one in (ahead, left, right)] == points
    assert cloud["point_stride"] == 12
    assert [(one["name"], one["offset"]) for one in cloud["fields"]] == [
        ("x", 0),
        ("y", 4),
        ("z", 8),
    ]


def test_a_plan_is_lines_and_obstacles_and_its_particles_are_poses(channels):
    ((plan,),) = [row["entities"] for row in channels["/n1/plan"][1]]
    assert [[(at["x"], at["y"]) for at in one["points"]] for one in plan["lines"]] == [
        [(0.0, 0.0), (1.0, 0.0)],
        [(0.0, 0.0), (1.0, 0.0)],
        [(0.0, 0.0), (1.0, 0.0)],
    ]
    assert plan["lines"][2]["thickness"] < plan["lines"][0]["thickness"]
    (obstacle,) = plan["cubes"]
    assert (obstacle["pose"]["position"]["x"], obstacle["pose"]["position"]["y"]) == (0.5, 0.2)
    (particles,) = channels["/n1/particles"][1]
    assert particles["frame_id"] == plan["frame_id"] == "map"
    turned = particles["poses"][1]["orientation"]
    assert 2.0 * math.atan2(turned["z"], turned["w"]) == pytest.approx(YAW_RAD)


def cells_of(grid):
    """Return rows of cells, each a dict of its fields as unsigned bytes."""
    data, stride = base64.b64decode(grid["data"]), grid["cell_stride"]
    rows = [data[i : i + grid["row_stride"]] for i in range(0, len(data), grid["row_stride"])]
    return [
        [
            {field["name"]: row[i + field["offset"]] for field in grid["fields"]}
            for i in range(0, grid["column_count"] * stride, stride)
        ]
        for row in rows
    ]


def test_a_map_is_a_grid_in_a_frame_that_lies_where_its_car_is(channels):
    _, (grid,) = channels["/n1/map"]
    assert (grid["frame_id"], grid["column_count"]) == ("n1/map", 3)
    assert (grid["cell_size"], grid["row_stride"]) == ({"x": 0.05, "y": 0.05}, 15)
    assert (grid["pose"]["position"]["x"], grid["pose"]["position"]["y"]) == (-1.0, 2.0)
    cells = cells_of(grid)
    assert [[cell["occupancy"] for cell in row] for row in cells] == [[0, 100, 255], [0, 0, 100]]
    free, occupied, unknown = (cell["alpha"] for cell in cells[0])
    assert 0 == unknown < free < occupied == 255
    types = {field["name"]: field["type"] for field in grid["fields"]}
    assert types == {"red": 1, "green": 1, "blue": 1, "alpha": 1, "occupancy": 2}
    _, moves = channels["/tf"]
    (frame,) = [
        one for row in moves for one in row["transforms"] if one["child_frame_id"] == "n1/map"
    ]
    # The car stands at (3, 0.5), turned as on its map, where it is 1 m from the origin.
    assert frame["translation"] == pytest.approx({"x": 2.0, "y": 0.5, "z": 0.0})
    assert frame["rotation"]["w"] == pytest.approx(1.0)
    assert [row["frame_id"] for row in channels["/n1/path"][1]] == ["map", "n1/map"]


def test_a_costmap_is_hot_near_obstacles_and_clear_far_off(channels):
    _, (grid,) = channels["/n1/costmap"]
    ((obstacle, near, far),) = cells_of(grid)
    assert (obstacle["clearance"], near["clearance"], far["clearance"]) == (0, 9, 200)
    assert obstacle["alpha"] > near["alpha"] > far["alpha"] == 0
    assert near["red"] > near["green"]
    assert grid["frame_id"] == "map"


def test_the_layout_shows_topics_and_fields_that_there_are(channels):
    panels = json.loads(LAYOUT.read_text())["configById"]
    topics = set(panels["3D!city"]["topics"])
    topics |= {panels["Image!eye"]["imageMode"]["imageTopic"]}
    topics |= {panels["RosOut!events"]["topicToRender"]}
    assert topics <= set(channels)
    fields = json.loads(channels["/n1/state"][0].data)["properties"]
    for name in ("Plot!speed", "Plot!command"):
        for path in panels[name]["paths"]:
            topic, field = path["value"].split(".")
            assert topic.startswith("/n")
            assert topic.endswith("/state")
            assert field in fields


def test_a_picture_is_the_jpeg_that_was_recorded(channels):
    _, rows = channels["/eye/overhead"]
    assert base64.b64decode(rows[0]["data"]) == PICTURE


def test_warnings_stay_warnings(channels):
    _, rows = channels["/events"]
    assert [(row["level"], row["message"]) for row in rows] == [
        (2, "n1 stands on the map"),
        (3, "n1 hit a wall"),
    ]
