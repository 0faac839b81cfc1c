"""Convert priority requests at a junction to SREM, and their status to SSEM, and back.

Lanes are numbered as in the junction's MAPEM (`scm.v2x.etsi.topology`). Times are minute of the
year and millisecond of the minute, UTC; a receiver reads the time nearest to its clock.
"""

import math
from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Literal, NamedTuple

from scm.clock import NS_PER_MS, NS_PER_S
from scm.records.city_map import Junction
from scm.v2x.etsi.cam_spatem import SCALE
from scm.v2x.etsi.codes import number_of, scaled
from scm.v2x.etsi.convert import moment_of, position_of, roadside_station, station_id
from scm.v2x.etsi.mapem import MAX_VELOCITY, Position3d
from scm.v2x.etsi.parts import PROTOCOL_VERSION, IntersectionId
from scm.v2x.etsi.priority import (
    CANCEL,
    REQUEST,
    ROLES,
    STATUSES,
    UPDATE,
    AccessPoint,
    Requester,
    Requestor,
    RequestorPosition,
    RequestorType,
    RequestPackage,
    SignalRequestRecord,
    SignalStatusPackage,
    SignalStatusRecord,
    SremBody,
    SsemBody,
    TransmissionAndSpeed,
)
from scm.v2x.messages.vehicle_state import VehicleState

COUNTS = 128
Verb = Literal["request", "update", "cancel"]

_TYPES: dict[Verb, int] = {"request": REQUEST, "update": UPDATE, "cancel": CANCEL}
_VERBS: dict[int, Verb] = {number: verb for verb, number in _TYPES.items()}
_MAX_LASTS_MS = 60_999
_FORWARD, _REVERSE = 2, 3
NO_LANE = 0
_STANDSTILL_MPS = 0.02


class PriorityRequest(NamedTuple):
    """A request for priority.

    Attributes:
        station_id: Of the car, as in its CAMs.
        number: The car's number of this request, 0 to 255; updates and cancellations keep it.
        junction: The junction's number.
        lane_in, lane_out: Numbers of MAPEM; None: unknown.
        role: One of `ROLES`.
        arrives_ns: Expected arrival at the stop line; None: unknown.
        lasts_s: Duration after that; None: unknown.
        sequence: Counts the car's SREMs.
    """

    station_id: int
    number: int
    junction: int
    lane_in: int | None
    verb: Verb = "request"
    role: str = "basicVehicle"
    lane_out: int | None = None
    arrives_ns: int | None = None
    lasts_s: float | None = None
    sequence: int = 0


class PriorityAnswer(NamedTuple):
    """The status of a request: one of `STATUSES`."""

    request: PriorityRequest
    status: str


def srem_of(request: PriorityRequest, state: VehicleState) -> SremBody:
    """Return the SREM of a request; the state is that of the requesting car.

    Raises:
        KeyError: for an unknown verb.
        ValueError: for an unknown role.
    """
    minute, millisecond = moment_of(state.t_ns)
    arrives = None if request.arrives_ns is None else moment_of(request.arrives_ns)
    package = RequestPackage(
        request=SignalRequestRecord(
            id=IntersectionId(id=request.junction),
            request_id=request.number,
            request_type=_TYPES[request.verb],
            inbound_lane=AccessPoint(lane=request.lane_in or NO_LANE),
            outbound_lane=AccessPoint(lane=request.lane_out) if request.lane_out else None,
        ),
        minute=None if arrives is None else arrives[0],
        second=None if arrives is None else arrives[1],
        duration=None
        if request.lasts_s is None
        else max(0, min(_MAX_LASTS_MS, round(request.lasts_s * 1e3))),
    )
    return SremBody(
        protocol_version=PROTOCOL_VERSION,
        station_id=station_id(state.vehicle),
        timestamp=minute,
        second=millisecond,
        sequence_number=request.sequence % COUNTS,
        requests=(package,),
        requestor=_requestor(request, state),
    )


def _requestor(request: PriorityRequest, state: VehicleState) -> Requestor:
    place = position_of(state.x_m, state.y_m)
    speed = min(MAX_VELOCITY, round(abs(state.speed_mps) * SCALE / 0.02))
    return Requestor(
        id=request.station_id,
        type=RequestorType(role=ROLES.index(request.role)),
        position=RequestorPosition(
            position=Position3d(latitude=place.latitude, longitude=place.longitude),
            heading=round((90.0 - math.degrees(state.yaw_rad)) * 80.0) % 28_800,
            speed=TransmissionAndSpeed(
                transmission=_REVERSE if state.speed_mps < -_STANDSTILL_MPS else _FORWARD,
                speed=speed,
            ),
        ),
        name=state.vehicle,
    )


def requests_of(body: SremBody, near_ns: int) -> tuple[PriorityRequest, ...]:
    """Return the requests of an SREM that arrived about `near_ns`; reserved types are left out."""
    kind = body.requestor.type
    return tuple(
        PriorityRequest(
            station_id=body.requestor.id,
            number=package.request.request_id,
            junction=package.request.id.id,
            lane_in=number_of(package.request.inbound_lane, "lane"),
            verb=_VERBS[package.request.request_type],
            role=ROLES[0 if kind is None else kind.role],
            lane_out=None
            if package.request.outbound_lane is None
            else number_of(package.request.outbound_lane, "lane"),
            arrives_ns=_moment_ns(
                number_of(package, "minute"), number_of(package, "second"), near_ns
            ),
            lasts_s=scaled(package, "duration", 1e-3),
            sequence=body.sequence_number or 0,
        )
        for package in body.requests or ()
        if package.request.request_type in _VERBS
    )


def _moment_ns(minute: int | None, second: int | None, near_ns: int) -> int | None:
    """Return the time nearest to `near_ns` with this minute of the year."""
    if minute is None or second is None:
        return None
    year = datetime.fromtimestamp(near_ns // NS_PER_S, UTC).year
    starts = (datetime(y, 1, 1, tzinfo=UTC).timestamp() for y in (year - 1, year, year + 1))
    times = [
        round(start) * NS_PER_S + minute * 60 * NS_PER_S + second * NS_PER_MS for start in starts
    ]
    return min(times, key=lambda t_ns: abs(t_ns - near_ns))


def ssem_of(
    junction: Junction, answers: Sequence[PriorityAnswer], sequence: int, t_ns: int
) -> SsemBody:
    """Return the SSEM with the status of requests, sent by a junction's roadside station.

    Args:
        junction: The junction.
        answers: One or more; the first 32 are sent.
        sequence: Counts changes of the answers.
        t_ns: When it is sent.
    """
    minute, millisecond = moment_of(t_ns)
    status = SignalStatusRecord(
        sequence_number=sequence % COUNTS,
        id=IntersectionId(id=junction.number),
        sig_status=tuple(_package(answer) for answer in answers[:32]),
    )
    return SsemBody(
        protocol_version=PROTOCOL_VERSION,
        station_id=station_id(roadside_station(junction.name)),
        timestamp=minute,
        second=millisecond,
        sequence_number=sequence % COUNTS,
        status=(status,),
    )


def _package(answer: PriorityAnswer) -> SignalStatusPackage:
    request = answer.request
    arrives = None if request.arrives_ns is None else moment_of(request.arrives_ns)
    return SignalStatusPackage(
        requester=Requester(
            id=request.station_id,
            request=request.number,
            sequence_number=request.sequence % COUNTS,
            role=ROLES.index(request.role),
        ),
        inbound_on=AccessPoint(lane=request.lane_in or NO_LANE),
        outbound_on=AccessPoint(lane=request.lane_out) if request.lane_out else None,
        minute=None if arrives is None else arrives[0],
        second=None if arrives is None else arrives[1],
        status=STATUSES.index(answer.status),
    )


def answers_of(body: SsemBody, station: int) -> dict[tuple[int, int], str]:
    """Return an SSEM's content for one station: (junction, request number) to status."""
    return {
        (record.id.id, package.requester.request): STATUSES[package.status]
        for record in body.status
        for package in record.sig_status
        if package.requester is not None and package.requester.id == station
    }
