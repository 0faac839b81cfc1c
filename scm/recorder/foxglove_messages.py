"""Foxglove's messages under its own schema names, and their JSON Schemas without references.

Foxglove requires every object to be inline and every field to have one type. It refuses our own
messages' schemas, which have references and allow null.
"""

import math
from typing import Any

import msgspec


class Time(msgspec.Struct, kw_only=True, frozen=True):
    """A time or a duration."""

    sec: int
    nsec: int


class Vector(msgspec.Struct, kw_only=True, frozen=True):
    """A place or a size [m]."""

    x: float
    y: float
    z: float = 0.0


class Quaternion(msgspec.Struct, kw_only=True, frozen=True):
    """A rotation."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    w: float = 1.0


class Vector2(msgspec.Struct, kw_only=True, frozen=True):
    """A size on the floor [m]."""

    x: float
    y: float


class Pose(msgspec.Struct, kw_only=True, frozen=True):
    """Place and rotation."""

    position: Vector
    orientation: Quaternion = Quaternion()


class PosesInFrame(msgspec.Struct, kw_only=True, frozen=True):
    """Poses in a frame."""

    timestamp: Time
    frame_id: str
    poses: tuple[Pose, ...]


class Colour(msgspec.Struct, kw_only=True, frozen=True):
    """Red, green, blue and opacity, 0 to 1."""

    r: float
    g: float
    b: float
    a: float = 1.0


class Transform(msgspec.Struct, kw_only=True, frozen=True):
    """Pose of a frame in its parent."""

    timestamp: Time
    parent_frame_id: str
    child_frame_id: str
    translation: Vector
    rotation: Quaternion


class FrameTransforms(msgspec.Struct, kw_only=True, frozen=True):
    """Poses of frames."""

    transforms: tuple[Transform, ...]


class Cube(msgspec.Struct, kw_only=True, frozen=True):
    """A box around its centre."""

    pose: Pose
    size: Vector
    color: Colour


class Line(msgspec.Struct, kw_only=True, frozen=True):
    """A line through points; `type` 0 joins them all."""

    type: int = 0
    pose: Pose = Pose(position=Vector(x=0.0, y=0.0))
    thickness: float
    scale_invariant: bool = False
    points: tuple[Vector, ...]
    color: Colour
    colors: tuple[Colour, ...] = ()
    indices: tuple[int, ...] = ()


class Label(msgspec.Struct, kw_only=True, frozen=True):
    """A text at a position."""

    pose: Pose
    billboard: bool = True
    font_size: float = 14.0
    scale_invariant: bool = True
    color: Colour
    text: str


class Entity(msgspec.Struct, kw_only=True, frozen=True):
    """An object of the scene; a later one of the same id replaces it."""

    timestamp: Time
    frame_id: str
    id: str
    lifetime: Time = Time(sec=0, nsec=0)
    frame_locked: bool = True
    cubes: tuple[Cube, ...] = ()
    spheres: tuple[Cube, ...] = ()
    lines: tuple[Line, ...] = ()
    texts: tuple[Label, ...] = ()


class Deletion(msgspec.Struct, kw_only=True, frozen=True):
    """An entity to remove; `type` 0: the one of this id, 1: all."""

    timestamp: Time
    type: int
    id: str = ""


class SceneUpdate(msgspec.Struct, kw_only=True, frozen=True):
    """Changes of the scene."""

    deletions: tuple[Deletion, ...] = ()
    entities: tuple[Entity, ...] = ()


class CompressedImage(msgspec.Struct, kw_only=True, frozen=True):
    """A picture as a JPEG file."""

    timestamp: Time
    frame_id: str
    data: bytes
    format: str = "jpeg"


class PackedField(msgspec.Struct, kw_only=True, frozen=True):
    """A number of each point or cell; `type` 1: uint8, 2: int8, 7: float32."""

    name: str
    offset: int
    type: int = 7


class PointCloud(msgspec.Struct, kw_only=True, frozen=True):
    """Points, each `point_stride` bytes of `data`."""

    timestamp: Time
    frame_id: str
    pose: Pose
    point_stride: int
    fields: tuple[PackedField, ...]
    data: bytes


class Grid(msgspec.Struct, kw_only=True, frozen=True):
    """Cells, each `cell_stride` bytes of `data`, row by row; `pose` is the corner of the first."""

    timestamp: Time
    frame_id: str
    pose: Pose
    column_count: int
    cell_size: Vector2
    row_stride: int
    cell_stride: int
    fields: tuple[PackedField, ...]
    data: bytes


class Log(msgspec.Struct, kw_only=True, frozen=True):
    """A line of the log; `level` 2: info, 3: warning, 4: error."""

    timestamp: Time
    level: int
    message: str
    name: str
    file: str = ""
    line: int = 0


class CarState(msgspec.Struct, kw_only=True, frozen=True):
    """A car's report for plots; `steering` is 0 if not reported."""

    timestamp: Time
    x_m: float
    y_m: float
    yaw_rad: float
    speed_mps: float
    lateral_speed_mps: float
    yaw_rate_radps: float
    accel_mps2: float
    throttle: float
    steering: float
    steering_rad: float
    mode: str
    owner_epoch: int


def turned(yaw_rad: float) -> Quaternion:
    """Return the rotation about z."""
    return Quaternion(z=math.sin(0.5 * yaw_rad), w=math.cos(0.5 * yaw_rad))


def schema_of(kind: type) -> dict[str, Any]:
    """Return the JSON Schema of one of these records with all objects inline."""
    (schemas,), parts = msgspec.json.schema_components([kind], ref_template="{name}")
    return _spelled_out(schemas, parts)


def _spelled_out(schema: dict[str, Any], parts: dict[str, Any]) -> dict[str, Any]:
    if "$ref" in schema:
        return _spelled_out(parts[schema["$ref"]], parts)
    plain: dict[str, Any] = {
        name: schema[name] for name in ("type", "contentEncoding") if name in schema
    }
    if schema["type"] == "object":
        plain["properties"] = {
            name: _spelled_out(field, parts) for name, field in schema["properties"].items()
        }
    if schema["type"] == "array":
        plain["items"] = _spelled_out(schema["items"], parts)
    return plain
