"""MAPEM: TS 103 301 with SAE J2735; each node takes the smallest of the six sizes of offsets."""

from collections.abc import Mapping
from typing import Any

from scm.errors import MessageError
from scm.v2x.etsi.mapem import DIRECTIONS, MAPEM_ID, SHARED, VEHICLE_LANE, MapemBody
from scm.v2x.uper.parts import (
    INTERSECTION_ID,
    POSITION_3D,
    Bits,
    Chosen,
    Each,
    Fields,
    Flags,
    Only,
    header_of,
    plain,
    read_header,
)

_SIZES = ((512, 1), (1024, 2), (2048, 3), (4096, 4), (8192, 5), (32_768, 6))


class _NodeXy:
    """An offset, in as few bits as it needs."""

    def to_asn(self, record: Mapping[str, Any]) -> tuple[str, dict[str, int]]:
        offset = record["node_xy"]
        far = max(offset["x"], offset["y"], -offset["x"] - 1, -offset["y"] - 1)
        return f"node-XY{next(number for limit, number in _SIZES if far < limit)}", offset

    def of_asn(self, value: tuple[str, dict[str, int]]) -> dict[str, dict[str, int]]:
        if not value[0].startswith("node-XY"):
            msg = f"node: expected an offset in x and y, got {value[0]}, which is not read here"
            raise MessageError(msg)
        return {"node_xy": value[1]}


class _LaneType:
    """A vehicle lane; records have no other kind."""

    _flags = Flags(VEHICLE_LANE)

    def to_asn(self, record: Mapping[str, Any]) -> tuple[str, tuple[int, int]]:
        if "vehicle" not in record:
            msg = "lane_type: got a lane that is none for vehicles, which is not written here"
            raise MessageError(msg)
        return "vehicle", self._flags.to_asn(record["vehicle"])

    def of_asn(self, value: tuple[str, Any]) -> dict[str, list[str]]:
        return {"vehicle": self._flags.of_asn(value[1])} if value[0] == "vehicle" else {}


_MANOEUVRES = Bits(12)
_ATTRIBUTES = Fields(
    ("directional_use", "directionalUse", Flags(DIRECTIONS)),
    ("shared_with", "sharedWith", Flags(SHARED)),
    ("lane_type", "laneType", _LaneType()),
)
_CONNECTION = Fields(
    (
        "connecting_lane",
        "connectingLane",
        Fields(("lane", "lane"), ("maneuver", "maneuver", _MANOEUVRES)),
    ),
    ("signal_group", "signalGroup"),
    ("connection_id", "connectionID"),
)
_LANE = Fields(
    ("lane_id", "laneID"),
    ("name", "name"),
    ("ingress_approach", "ingressApproach"),
    ("egress_approach", "egressApproach"),
    ("lane_attributes", "laneAttributes", _ATTRIBUTES),
    ("maneuvers", "maneuvers", _MANOEUVRES),
    (
        "node_list",
        "nodeList",
        Chosen("nodes", Only("nodes", Each(Fields(("delta", "delta", _NodeXy()))))),
    ),
    ("connects_to", "connectsTo", Each(_CONNECTION)),
)
_GEOMETRY = Fields(
    ("name", "name"),
    ("id", "id", INTERSECTION_ID),
    ("revision", "revision"),
    ("ref_point", "refPoint", POSITION_3D),
    ("lane_width", "laneWidth"),
    ("speed_limits", "speedLimits", Each(Fields(("type", "type"), ("speed", "speed")))),
    ("lane_set", "laneSet", Each(_LANE)),
)
_MAP = Fields(
    ("timestamp", "timeStamp"),
    ("msg_issue_revision", "msgIssueRevision"),
    ("layer_type", "layerType"),
    ("intersections", "intersections", Each(_GEOMETRY)),
)


def to_asn(body: MapemBody) -> dict[str, Any]:
    """Return a MAPEM's value of ASN.1."""
    record = plain(body)
    return {"header": header_of(record, MAPEM_ID), "map": _MAP.to_asn(record)}


def of_asn(value: dict[str, Any]) -> dict[str, Any]:
    """Return the record of a MAPEM's value of ASN.1; road segments are left out."""
    return {**read_header(value), **_MAP.of_asn(value["map"])}
