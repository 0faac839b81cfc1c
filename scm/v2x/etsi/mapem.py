"""The ETSI map of a junction (MAPEM) as JSON records, enlarged city.

A body is the `message` of its-client's JSON schema mapem 2.0.0, restricted to vehicle lanes.
`scm.v2x.etsi.topology` builds it from a map file.
Field sets and units: TS 103 301 with SAE J2735.
"""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from scm.v2x.etsi.codes import coded
from scm.v2x.etsi.parts import (
    ApproachId,
    Byte,
    IntersectionId,
    LaneId,
    Latitude,
    Longitude,
    MinuteOfYear,
    Name,
    Revision,
    SignalGroupId,
    StationId,
)

MAPEM_ID = 5
MAX_NODES, MAX_CONNECTIONS, MAX_APPROACHES, MAX_LANES = 63, 16, 15, 255
FARTHEST_CM = 32_767
MAX_LANE_WIDTH_CM = 32_767

DIRECTIONS = ("ingressPath", "egressPath")
"""LaneDirection, first bit first; likewise `SHARED` and `VEHICLE_LANE`."""
SHARED = (
    "overlappingLaneDescriptionProvided",
    "multipleLanesTreatedAsOneLane",
    "otherNonMotorizedTrafficTypes",
    "individualMotorizedVehicleTraffic",
    "busVehicleTraffic",
    "taxiVehicleTraffic",
    "pedestriansTraffic",
    "cyclistVehicleTraffic",
    "trackedVehicleTraffic",
    "pedestrianTraffic",
)
VEHICLE_LANE = (
    "isVehicleRevocableLane",
    "isVehicleFlyOverLane",
    "hovLaneUseOnly",
    "restrictedToBusUse",
    "restrictedToTaxiUse",
    "restrictedFromPublicUse",
    "hasIRbeaconCoverage",
    "permissionOnRequest",
)
STRAIGHT, LEFT, RIGHT, U_TURN = range(4)
"""The first bits of a manoeuvre."""

_Offset = Annotated[int, coded(-32_768, 32_767)]
MAX_VELOCITY = 8190
Velocity = Annotated[int, coded(0, 8191, unavailable=8191, out_of_range=(MAX_VELOCITY,))]
_Manoeuvres = Annotated[str, Meta(pattern="^[01]{12}$")]
_Shared = Literal[
    "overlappingLaneDescriptionProvided",
    "multipleLanesTreatedAsOneLane",
    "otherNonMotorizedTrafficTypes",
    "individualMotorizedVehicleTraffic",
    "busVehicleTraffic",
    "taxiVehicleTraffic",
    "pedestriansTraffic",
    "cyclistVehicleTraffic",
    "trackedVehicleTraffic",
    "pedestrianTraffic",
]
_VehicleLane = Literal[
    "isVehicleRevocableLane",
    "isVehicleFlyOverLane",
    "hovLaneUseOnly",
    "restrictedToBusUse",
    "restrictedToTaxiUse",
    "restrictedFromPublicUse",
    "hasIRbeaconCoverage",
    "permissionOnRequest",
]


_SpeedLimit = Literal[
    "unknown",
    "maxSpeedInSchoolZone",
    "maxSpeedInSchoolZoneWhenChildrenArePresent",
    "maxSpeedInConstructionZone",
    "vehicleMinSpeed",
    "vehicleMaxSpeed",
    "vehicleNightMaxSpeed",
    "truckMinSpeed",
    "truckMaxSpeed",
    "truckNightMaxSpeed",
    "vehiclesWithTrailersMinSpeed",
    "vehiclesWithTrailersMaxSpeed",
    "vehiclesWithTrailersNightMaxSpeed",
]
_Layer = Literal[
    "none",
    "mixedContent",
    "intersectionData",
    "curveData",
    "roadwaySectionData",
    "parkingAreaData",
    "sharedLaneData",
]


class Position3d(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """1e-7 degree of the enlarged city; elevation 0.1 m."""

    latitude: Latitude
    longitude: Longitude
    elevation: Annotated[int, coded(-4096, 61_439, unavailable=-4096)] | None = None


class SpeedLimit(msgspec.Struct, kw_only=True, frozen=True):
    """0.02 m/s."""

    type: _SpeedLimit = "vehicleMaxSpeed"
    speed: Velocity


class NodeXy(msgspec.Struct, kw_only=True, frozen=True):
    """Offset from the previous node (first: the reference point): 0.01 m east and north."""

    x: _Offset
    y: _Offset


class NodeDelta(msgspec.Struct, kw_only=True, frozen=True):
    """The standard's choice of offsets or positions on the earth; only offsets here."""

    node_xy: NodeXy


class Node(msgspec.Struct, kw_only=True, frozen=True):
    """One point of a centre line."""

    delta: NodeDelta


class NodeList(msgspec.Struct, kw_only=True, frozen=True):
    """A lane's centre line, from the stop line outwards in either driving direction."""

    nodes: Annotated[tuple[Node, ...], Meta(min_length=2, max_length=MAX_NODES)]


class LaneType(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """The standard's choice of lane types; None: not for vehicles, such as a crosswalk."""

    vehicle: Annotated[tuple[_VehicleLane, ...], Meta(max_length=8)] | None = None


class LaneAttributes(msgspec.Struct, kw_only=True, frozen=True):
    """Driving direction, and who else may use the lane."""

    directional_use: Annotated[
        tuple[Literal["ingressPath", "egressPath"], ...], Meta(min_length=1, max_length=2)
    ]
    shared_with: Annotated[tuple[_Shared, ...], Meta(max_length=10)] = ()
    lane_type: LaneType = LaneType(vehicle=())


class ConnectingLane(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """The lane beyond the junction; maneuver: bits straight, left, right, U-turn ..."""

    lane: LaneId
    maneuver: _Manoeuvres | None = None


class Connection(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """A path over the junction, and the SPATEM group that releases it."""

    connecting_lane: ConnectingLane
    signal_group: SignalGroupId | None = None
    connection_id: Byte | None = None


class MapLane(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """A lane that leads to the junction or away from it."""

    lane_id: LaneId
    name: Name | None = None
    ingress_approach: ApproachId | None = None
    egress_approach: ApproachId | None = None
    lane_attributes: LaneAttributes
    maneuvers: _Manoeuvres | None = None
    node_list: NodeList
    connects_to: (
        Annotated[tuple[Connection, ...], Meta(min_length=1, max_length=MAX_CONNECTIONS)] | None
    ) = None


class IntersectionGeometry(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """One junction; lane_width 0.01 m; revision as in its SPATEM."""

    name: Name | None = None
    id: IntersectionId
    revision: Revision
    ref_point: Position3d
    lane_width: Annotated[int, coded(0, 32_767)] | None = None
    speed_limits: Annotated[tuple[SpeedLimit, ...], Meta(min_length=1, max_length=9)] | None = None
    lane_set: Annotated[tuple[MapLane, ...], Meta(min_length=1, max_length=MAX_LANES)]


class MapemBody(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """A MAPEM; timestamp: minute of the year."""

    protocol_version: Byte
    station_id: StationId
    timestamp: MinuteOfYear | None = None
    msg_issue_revision: Revision
    layer_type: _Layer | None = None
    intersections: (
        Annotated[tuple[IntersectionGeometry, ...], Meta(min_length=1, max_length=32)] | None
    ) = None
