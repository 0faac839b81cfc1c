"""Between our own messages and ETSI's records: CAM from a car's state, SPATEM from signal phases.

    enlarged = SCALE * metric        lengths, speeds, accelerations; time and angles as they are
    heading  = 90 deg - yaw          clockwise from north, north = map +y
    mark     = 0.1 s within the hour of UTC; 36000 is beyond it, 36001 is unknown

Times are rounded to the safe side: a minimum end down, a maximum end up. Values beyond a field's
range are written as its code for that, in most fields the largest value; unknown values as the
field's "unavailable". Reading returns a number or None: `scm.v2x.etsi.codes` has the codes.
Field sets and values: EN 302 637-2 v1.4.1 with TS 102 894-2, TS 103 301 with SAE J2735.
"""

import bisect
import hashlib
import math
from datetime import UTC, datetime
from typing import NamedTuple

from scm.clock import NS_PER_MS, NS_PER_S
from scm.geometry import wrap_angle
from scm.records.city_map import Junction
from scm.records.signals import Colour, SignalGroup
from scm.v2x.etsi.cam_spatem import (
    PHASE_STATES,
    REFERENCE_LATITUDE_DEG,
    REFERENCE_LONGITUDE_DEG,
    SCALE,
    STATUS_BITS,
    TIME_CONFIDENCES,
    TIME_MARK_FAR,
    TIME_MARK_UNKNOWN,
    Acceleration,
    BasicContainer,
    CamBody,
    Curvature,
    HighFrequencyContainer,
    IntersectionState,
    LowFrequencyContainer,
    MovementEvent,
    MovementState,
    SpatemBody,
    Timing,
    VehicleHighFrequency,
    VehicleLength,
    YawRate,
)
from scm.v2x.etsi.codes import number_in, number_of, scaled
from scm.v2x.etsi.parts import (
    PROTOCOL_VERSION,
    UNKNOWN_POSITION,
    Heading,
    IntersectionId,
    ReferencePosition,
    Speed,
)
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.vehicle_state import VehicleState

SPEED_MAX = 16382
LENGTH_MAX, WIDTH_MAX = 1022, 61
ACCEL_MAX = 160
CURVATURE_MAX, CURVATURE_MIN, CURVATURE_UNKNOWN = 1022, -1023, 1023
YAW_RATE_MAX = 32766
MAX_LATITUDE, MAX_LONGITUDE = 900_000_000, 1_800_000_000
ASSUMED_LENGTH_M, ASSUMED_WIDTH_M = 0.30, 0.175
"""A Nigel's size, which receivers assume if a CAM has none."""
REVISIONS = 128

_ITS_EPOCH_MS = 1_072_915_200_000
_LEAP_MS = 5_000  # leap seconds from 2004 to now: the ITS time scale does not skip them
_DELTA_TIMES = 65_536
_ITS_TIMES = 2**42
_MARK_NS = NS_PER_S // 10
_MARKS_PER_HOUR = 36_000
_HOUR_NS = 3_600 * NS_PER_S
_MARK_PAST_MS = 300_000
_STANDSTILL_MPS = 0.02

# WGS 84: metres per degree at the reference point.
_A_M, _E2 = 6_378_137.0, 6.694_379_990_141e-3
_PHI = math.radians(REFERENCE_LATITUDE_DEG)
_W2 = 1.0 - _E2 * math.sin(_PHI) ** 2
_NORTH_M: float = math.radians(1.0) * _A_M * (1.0 - _E2) / _W2**1.5
_EAST_M = math.radians(1.0) * _A_M * math.cos(_PHI) / math.sqrt(_W2)

_STATE_OF: dict[Colour, str] = {
    "red": "stop-And-Remain",
    "green": "protected-Movement-Allowed",
    "yellow": "protected-clearance",
    "flashing_red": "stop-Then-Proceed",
    "dark": "dark",
}
_COLOUR_OF: dict[str, Colour] = {state: colour for colour, state in _STATE_OF.items()}
_STATUS_OF = {
    "plan": ("fixedTimeOperation",),
    "adaptive": ("trafficDependentOperation",),
    "priority": ("signalPriorityIsActive",),
    "preempt": ("preemptIsActive",),
    "start": ("standbyOperation",),
    "flash": ("failureFlash",),
}
_STATUS_LENGTH = 16


class CamView(NamedTuple):
    """A CAM in metric units of the table: position of the front bumper's middle, map frame.

    None: unavailable or out of range. Without a latitude or a longitude both `x_m` and `y_m` are
    None. `speed_mps` is negative in reverse, and None if the direction is unknown.
    """

    station_id: int
    x_m: float | None
    y_m: float | None
    yaw_rad: float | None
    speed_mps: float | None
    yaw_rate_radps: float | None
    length_m: float | None
    width_m: float | None

    @property
    def place(self) -> tuple[float, float] | None:
        """Return x and y [m], or None if the CAM has no position."""
        return None if self.x_m is None or self.y_m is None else (self.x_m, self.y_m)


class SignalState(NamedTuple):
    """One group in a SPATEM; seconds count from the message's time stamp."""

    colour: Colour
    min_end_s: float | None
    max_end_s: float | None
    likely_end_s: float | None = None
    likely_confidence: float | None = None


def station_id(name: str) -> int:
    """Return the same 32-bit number for the same station name, on every machine."""
    return int.from_bytes(hashlib.blake2s(name.encode(), digest_size=4).digest(), "big")


def roadside_station(junction: str) -> str:
    """Return the station name of a junction's roadside unit, the one that sends its SPATEM."""
    return f"rsu-{junction}"


def _clamp(value: float, low: int, high: int) -> int:
    return max(low, min(high, round(value)))


def its_ms(t_ns: int) -> int:
    """Return TimestampIts: milliseconds since 2004, leap seconds counted."""
    return t_ns // NS_PER_MS - _ITS_EPOCH_MS + _LEAP_MS


def its_time(t_ns: int) -> int:
    """Return `its_ms` as sent in messages; a clock before 2004 counts up to the wrap."""
    return its_ms(t_ns) % _ITS_TIMES


def delta_time(t_ns: int) -> int:
    """Return generationDeltaTime: `its_ms` mod 65536."""
    return its_ms(t_ns) % _DELTA_TIMES


def generated_ns(body: CamBody, near_ns: int) -> int:
    """Return when a CAM was generated [ns], to the ms, if that is within 32 s of `near_ns`."""
    half = _DELTA_TIMES // 2
    ahead = (body.generation_delta_time - delta_time(near_ns) + half) % _DELTA_TIMES - half
    return (near_ns // NS_PER_MS + ahead) * NS_PER_MS


def heading_of(yaw: float) -> int:
    """Return a yaw [rad] as 0.1 degree clockwise from north, never 3600."""
    return round((90.0 - math.degrees(yaw)) * 10.0) % 3600


def _curvature(state: VehicleState) -> int:
    if abs(state.speed_mps) < _STANDSTILL_MPS:
        return CURVATURE_UNKNOWN
    curvature = state.yaw_rate_radps / state.speed_mps / SCALE
    return _clamp(curvature * 1e4, CURVATURE_MIN, CURVATURE_MAX)


def position_of(x_m: float, y_m: float) -> ReferencePosition:
    """Return a place of the map as a position on the earth; unavailable beyond its range."""
    latitude, longitude = latitude_of(y_m), longitude_of(x_m)
    if abs(latitude) > MAX_LATITUDE or abs(longitude) > MAX_LONGITUDE:
        latitude, longitude = UNKNOWN_POSITION
    return ReferencePosition(latitude=latitude, longitude=longitude)


def latitude_of(y_m: float) -> int:
    """Return the latitude of map y, 1e-7 degree of the enlarged city."""
    return round((REFERENCE_LATITUDE_DEG + y_m * SCALE / _NORTH_M) * 1e7)


def longitude_of(x_m: float) -> int:
    """Return the longitude of map x, 1e-7 degree of the enlarged city."""
    return round((REFERENCE_LONGITUDE_DEG + x_m * SCALE / _EAST_M) * 1e7)


def place_of(latitude: int, longitude: int) -> tuple[float, float] | None:
    """Return map x and y [m] of a position on the earth, or None if either is unavailable."""
    if (
        number_in(ReferencePosition, "latitude", latitude) is None
        or number_in(ReferencePosition, "longitude", longitude) is None
    ):
        return None
    return (
        (longitude * 1e-7 - REFERENCE_LONGITUDE_DEG) * _EAST_M / SCALE,
        (latitude * 1e-7 - REFERENCE_LATITUDE_DEG) * _NORTH_M / SCALE,
    )


def speed_of(speed_mps: float) -> Speed:
    """Return the magnitude of a speed of the table."""
    return Speed(value=_clamp(abs(speed_mps) * SCALE * 100.0, 0, SPEED_MAX))


def cam_of(
    state: VehicleState,
    *,
    length_m: float,
    width_m: float,
    front_m: float,
    low_frequency: LowFrequencyContainer | None = None,
) -> CamBody:
    """Return the CAM of a car; `front_m` reaches from its rear axle to its front bumper."""
    x_m = state.x_m + front_m * math.cos(state.yaw_rad)
    y_m = state.y_m + front_m * math.sin(state.yaw_rad)
    accel = _clamp(state.accel_mps2 * SCALE * 10.0, -ACCEL_MAX, ACCEL_MAX)
    yaw_rate = _clamp(math.degrees(state.yaw_rate_radps) * 100.0, -YAW_RATE_MAX, YAW_RATE_MAX)
    motion = VehicleHighFrequency(
        heading=Heading(value=heading_of(state.yaw_rad)),
        speed=speed_of(state.speed_mps),
        drive_direction=int(state.speed_mps < -_STANDSTILL_MPS),
        vehicle_length=VehicleLength(value=_clamp(length_m * SCALE * 10.0, 1, LENGTH_MAX)),
        vehicle_width=_clamp(width_m * SCALE * 10.0, 1, WIDTH_MAX),
        longitudinal_acceleration=Acceleration(value=accel),
        curvature=Curvature(value=_curvature(state)),
        yaw_rate=YawRate(value=yaw_rate),
    )
    return CamBody(
        protocol_version=PROTOCOL_VERSION,
        station_id=station_id(state.vehicle),
        generation_delta_time=delta_time(state.t_ns),
        basic_container=BasicContainer(reference_position=position_of(x_m, y_m)),
        high_frequency_container=HighFrequencyContainer(
            basic_vehicle_container_high_frequency=motion
        ),
        low_frequency_container=low_frequency,
    )


def _speed_mps(motion: VehicleHighFrequency) -> float | None:
    """Return the signed speed of the table, or None if size or direction is unknown."""
    speed = scaled(motion.speed, "value", 0.01 / SCALE)
    backward = number_of(motion, "drive_direction")
    if not speed or backward is None:
        return 0.0 if speed == 0.0 else None
    return -speed if backward else speed


def read_cam(body: CamBody) -> CamView:
    """Return a CAM in metres of the table; resolution 0.8 mm, 0.1 degree, 0.7 mm/s."""
    motion, position = body.motion, body.position
    heading = scaled(motion.heading, "value", 0.1)
    x_m, y_m = place_of(position.latitude, position.longitude) or (None, None)
    return CamView(
        station_id=body.station_id,
        x_m=x_m,
        y_m=y_m,
        yaw_rad=None if heading is None else wrap_angle(math.radians(90.0 - heading)),
        speed_mps=_speed_mps(motion),
        yaw_rate_radps=scaled(motion.yaw_rate, "value", math.radians(0.01)),
        length_m=scaled(motion.vehicle_length, "value", 0.1 / SCALE),
        width_m=scaled(motion, "vehicle_width", 0.1 / SCALE),
    )


def _mark(end_ns: int | None, now_ns: int, *, up: bool) -> int:
    if end_ns is None:
        return TIME_MARK_UNKNOWN
    if end_ns - now_ns >= _HOUR_NS - _MARK_PAST_MS * NS_PER_MS:
        return TIME_MARK_FAR
    tenths = -(-end_ns // _MARK_NS) if up else end_ns // _MARK_NS
    return tenths % _MARKS_PER_HOUR


def _movement(group: SignalGroup, number: int, spat: Spat) -> MovementState:
    is_guaranteed = spat.mode != "flash" and group.colour in ("red", "green", "yellow")
    likely_ns = group.likely_end_ns if is_guaranteed else None
    timing = Timing(
        min_end_time=_mark(group.min_end_ns if is_guaranteed else None, spat.t_ns, up=False),
        max_end_time=_mark(group.max_end_ns if is_guaranteed else None, spat.t_ns, up=True),
        likely_time=_mark(likely_ns, spat.t_ns, up=False) if likely_ns is not None else None,
        confidence=_confidence(group) if likely_ns is not None else None,
    )
    event = MovementEvent(event_state=PHASE_STATES.index(_STATE_OF[group.colour]), timing=timing)
    return MovementState(signal_group=number, state_time_speed=(event,))


def _confidence(group: SignalGroup) -> int | None:
    """Return the highest class that does not exceed the group's confidence, or None."""
    if group.likely_confidence is None:
        return None
    percent = group.likely_confidence * 100.0
    return max(0, bisect.bisect_right(TIME_CONFIDENCES, percent + 1e-9) - 1)


def moment_of(t_ns: int) -> tuple[int, int]:
    """Return SAE J2735's minute of the year and millisecond of the minute, of UTC."""
    now = datetime.fromtimestamp(t_ns // NS_PER_S, UTC)
    minute = (now.timetuple().tm_yday - 1) * 1440 + now.hour * 60 + now.minute
    return minute, now.second * 1000 + t_ns % NS_PER_S // NS_PER_MS


def spatem_of(spat: Spat, junction: Junction) -> SpatemBody:
    """Return the SPATEM of a junction, sent by its roadside station.

    Raises:
        KeyError: when the Spat names a group that the junction does not have.
    """
    numbers = {group.name: group.number for group in junction.groups}
    minute, millisecond = moment_of(spat.t_ns)
    state = IntersectionState(
        name=spat.junction,
        id=IntersectionId(id=junction.number),
        revision=spat.revision % REVISIONS,
        status=_bits(_STATUS_OF.get(spat.mode, ())),
        moy=minute,
        timestamp=millisecond,
        states=tuple(_movement(group, numbers[group.group], spat) for group in spat.groups),
    )
    return SpatemBody(
        protocol_version=PROTOCOL_VERSION,
        station_id=station_id(roadside_station(spat.junction)),
        timestamp=minute,
        intersections=(state,),
    )


def _bits(names: tuple[str, ...]) -> str:
    return "".join("1" if name in names else "0" for name in STATUS_BITS).ljust(_STATUS_LENGTH, "0")


def _until_s(field: str, of: MovementState, state: IntersectionState) -> float | None:
    """Return the time from a SPATEM's time stamp to a time mark of a group [s], or None."""
    timing = of.state_time_speed[0].timing
    mark = None if timing is None else number_of(timing, field)
    minute, millisecond = number_of(state, "moy"), number_of(state, "timestamp")
    if mark is None or minute is None or millisecond is None:
        return None
    now_ms = minute % 60 * 60_000 + millisecond
    ahead_ms = (mark * 100 - now_ms + _MARK_PAST_MS) % 3_600_000 - _MARK_PAST_MS
    return max(0.0, ahead_ms / 1000.0)


def colours_of(body: SpatemBody) -> dict[int, SignalState]:
    """Return the state of each group number in a SPATEM: colour, and seconds to its ends.

    Only a protected movement is green. Unknown states count as dark. Groups without a number are
    left out.
    """
    return {
        state.signal_group: _signal_state(state, body.intersections[0])
        for state in body.states
        if number_of(state, "signal_group") is not None
    }


def _signal_state(state: MovementState, at: IntersectionState) -> SignalState:
    likely_s = _until_s("likely_time", state, at)
    return SignalState(
        _COLOUR_OF.get(state.event_state, "dark"),
        _until_s("min_end_time", state, at),
        _until_s("max_end_time", state, at),
        likely_s,
        None if likely_s is None else state.confidence,
    )
