"""ETSI facility messages, CAM and SPATEM, as JSON records in the units of the standards.

A 1:14 car is far below the resolution and the trigger thresholds of the standards (1e-7 degree is
15 cm of the full-scale city, and a 4 m step is longer than the map). So the V2X layer uses an
enlarged city: lengths, speeds and accelerations times `SCALE`, time unchanged, positions as
degrees from a reference point. Every field then has its meaning in the standard.

A body is, name by name, the `message` of the open JSON schemas of Orange's its-client (cam 2.4.0,
spatem 2.0.0); `scm.v2x.etsi.json_form` puts their envelope around it.

Field sets and units: EN 302 637-2 v1.4.1 (CAM), TS 103 301 with SAE J2735 phase states (SPATEM).
"""

from typing import Annotated

import msgspec
from msgspec import Meta

from scm.v2x.etsi.codes import coded
from scm.v2x.etsi.parts import (
    Byte,
    DSecond,
    Heading,
    IntersectionId,
    MinuteOfYear,
    Name,
    PathPoint,
    ReferencePosition,
    Revision,
    SignalGroupId,
    Speed,
    StationId,
    StationType,
    Word,
)

SCALE = 14.0
REFERENCE_LATITUDE_DEG = 0.0
REFERENCE_LONGITUDE_DEG = 0.0

CAM_ID = 2
SPATEM_ID = 4
PASSENGER_CAR, ROADSIDE_UNIT = 5, 15
TIME_MARK_FAR, TIME_MARK_UNKNOWN = 36000, 36001
MAX_PATH_POINTS = 40

PHASE_STATES = (
    "unavailable",
    "dark",
    "stop-Then-Proceed",
    "stop-And-Remain",
    "pre-Movement",
    "permissive-Movement-Allowed",
    "protected-Movement-Allowed",
    "permissive-clearance",
    "protected-clearance",
    "caution-Conflicting-Traffic",
)
"""SAE J2735 MovementPhaseState; the index is the number in the message."""
STATUS_BITS = (
    "manualControlIsEnabled",
    "stopTimeIsActivated",
    "failureFlash",
    "preemptIsActive",
    "signalPriorityIsActive",
    "fixedTimeOperation",
    "trafficDependentOperation",
    "standbyOperation",
    "failureMode",
    "off",
    "recentMAPmessageUpdate",
    "recentChangeInMAPassignedLanesIDsUsed",
    "noValidMAPisAvailableAtThisTime",
    "noValidSPATisAvailableAtThisTime",
)
"""IntersectionStatusObject, first bit first; two more are reserved."""

TIME_CONFIDENCES = (21, 36, 47, 56, 62, 68, 73, 77, 81, 85, 88, 91, 94, 96, 98, 100)
"""SAE J2735 TimeIntervalConfidence in percent; the index is the number in the message."""

# Values beyond the standard's range are rejected on decoding: they come from outside.
_TimeMark = Annotated[
    int,
    coded(0, TIME_MARK_UNKNOWN, unavailable=TIME_MARK_UNKNOWN, out_of_range=(TIME_MARK_FAR,)),
]


class VehicleLength(msgspec.Struct, kw_only=True, frozen=True, gc=False):
    """0.1 m, 1023 unknown; confidence: 0 no trailer, 4 unknown.

    Attributes:
        value, confidence: In the units and the confidence classes of the standard.
    """

    value: Annotated[int, coded(1, 1023, unavailable=1023, out_of_range=(1022,))]
    confidence: Annotated[int, coded(0, 4, unavailable=4)] = 0


class Acceleration(msgspec.Struct, kw_only=True, frozen=True, gc=False):
    """0.1 m/s^2, 161 unknown; confidence 0.1 m/s^2, 102 unknown.

    Attributes:
        value, confidence: In the units and the confidence classes of the standard.
    """

    value: Annotated[int, coded(-160, 161, unavailable=161, out_of_range=(-160, 160))] = 161
    confidence: Annotated[int, coded(0, 102, unavailable=102, out_of_range=(101,))] = 102


class Curvature(msgspec.Struct, kw_only=True, frozen=True, gc=False):
    """1e-4 1/m, + = left, 1023 unknown; confidence: a class, 7 unknown.

    Attributes:
        value, confidence: In the units and the confidence classes of the standard.
    """

    value: Annotated[int, coded(-1023, 1023, unavailable=1023, out_of_range=(-1023, 1022))] = 1023
    confidence: Annotated[int, coded(0, 7, unavailable=7, out_of_range=(6,))] = 7


class YawRate(msgspec.Struct, kw_only=True, frozen=True, gc=False):
    """0.01 degree/s, + = left, 32767 unknown; confidence: a class, 8 unknown.

    Attributes:
        value, confidence: In the units and the confidence classes of the standard.
    """

    value: Annotated[
        int, coded(-32_766, 32_767, unavailable=32_767, out_of_range=(-32_766, 32_766))
    ] = 32767
    confidence: Annotated[int, coded(0, 8, unavailable=8, out_of_range=(7,))] = 8


class BasicContainer(msgspec.Struct, kw_only=True, frozen=True, gc=False):
    """Station type, and position of the middle of the front bumper.

    Attributes:
        station_type: By the standard; 5: passenger car.
    """

    station_type: StationType = PASSENGER_CAR
    reference_position: ReferencePosition


class VehicleHighFrequency(msgspec.Struct, kw_only=True, frozen=True, gc=False):
    """The motion of a car.

    Attributes:
        drive_direction: 0 forward, 1 backward, 2 unknown.
        vehicle_width: 0.1 m, 62 unknown.
        curvature: Of its path, by the standard.
        curvature_calculation_mode: 0 from the yaw rate, 1 not, 2 unknown.
    """

    heading: Heading
    speed: Speed
    drive_direction: Annotated[int, coded(0, 2, unavailable=2)] = 0
    vehicle_length: VehicleLength
    vehicle_width: Annotated[int, coded(1, 62, unavailable=62, out_of_range=(61,))]
    longitudinal_acceleration: Acceleration = Acceleration()
    curvature: Curvature = Curvature()
    curvature_calculation_mode: Annotated[int, coded(0, 2, unavailable=2)] = 0
    yaw_rate: YawRate = YawRate()


class HighFrequencyContainer(msgspec.Struct, kw_only=True, frozen=True, gc=False):
    """The standard's choice between a vehicle's and a roadside unit's; the vehicle's."""

    basic_vehicle_container_high_frequency: VehicleHighFrequency


class ExteriorLights(msgspec.Struct, kw_only=True, frozen=True, gc=False):
    """Which lights are switched on, in the order of the standard's bits.

    Attributes:
        low_beam_headlights_on, high_beam_headlights_on, left_turn_signal_on: Whether it is on.
        right_turn_signal_on, daytime_running_lights_on, reverse_light_on: Whether it is on.
        fog_light_on, parking_lights_on: Whether it is on.
    """

    low_beam_headlights_on: bool = False
    high_beam_headlights_on: bool = False
    left_turn_signal_on: bool = False
    right_turn_signal_on: bool = False
    daytime_running_lights_on: bool = False
    reverse_light_on: bool = False
    fog_light_on: bool = False
    parking_lights_on: bool = False


class VehicleLowFrequency(msgspec.Struct, kw_only=True, frozen=True, gc=False):
    """What changes slowly; path_history: newest point first, each from the one before it.

    Attributes:
        vehicle_role: By the standard; 0: nothing special.
    """

    vehicle_role: Annotated[int, coded(0, 15)] = 0
    exterior_lights: ExteriorLights = ExteriorLights()
    path_history: Annotated[tuple[PathPoint, ...], Meta(max_length=MAX_PATH_POINTS)] = ()


class LowFrequencyContainer(msgspec.Struct, kw_only=True, frozen=True, gc=False):
    """The standard's choice, of which there is one so far."""

    basic_vehicle_container_low_frequency: VehicleLowFrequency


class CamBody(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """A CAM; generation_delta_time: milliseconds modulo 65536.

    Attributes:
        protocol_version: Of the message.
        station_id: Its number in messages of the standard.
        generation_delta_time: When it was made, modulo 65 536 [ms].
    """

    protocol_version: Byte
    station_id: StationId
    generation_delta_time: Word
    basic_container: BasicContainer
    high_frequency_container: HighFrequencyContainer
    low_frequency_container: LowFrequencyContainer | None = None

    @property
    def position(self) -> ReferencePosition:
        """Position of the middle of the front bumper."""
        return self.basic_container.reference_position

    @property
    def motion(self) -> VehicleHighFrequency:
        """The motion of the car."""
        return self.high_frequency_container.basic_vehicle_container_high_frequency

    @property
    def slow(self) -> VehicleLowFrequency | None:
        """Role, lights and path, or None if the CAM has none."""
        container = self.low_frequency_container
        return None if container is None else container.basic_vehicle_container_low_frequency


class Timing(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """When a phase ends: 0.1 s within the hour, 36000 far, 36001 unknown.

    `confidence` of `likely_time` is an index into `TIME_CONFIDENCES`.
    """

    min_end_time: _TimeMark
    max_end_time: _TimeMark | None = None
    likely_time: _TimeMark | None = None
    confidence: Annotated[int, coded(0, 15)] | None = None
    next_time: _TimeMark | None = None


class MovementEvent(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """What a group shows now, as an index into `PHASE_STATES`."""

    event_state: Annotated[int, coded(0, 9, unavailable=0)]
    timing: Timing | None = None


class MovementState(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """One signal group of a SPATEM; the first of `state_time_speed` is now."""

    signal_group: SignalGroupId
    state_time_speed: Annotated[tuple[MovementEvent, ...], Meta(min_length=1, max_length=16)]

    @property
    def event_state(self) -> str:
        """SAE J2735 MovementPhaseState by name, e.g. `protected-Movement-Allowed`."""
        return PHASE_STATES[self.state_time_speed[0].event_state]

    @property
    def min_end_time(self) -> int:
        """0.1 s within the hour; 36001 is unknown."""
        timing = self.state_time_speed[0].timing
        return TIME_MARK_UNKNOWN if timing is None else timing.min_end_time

    @property
    def max_end_time(self) -> int:
        """0.1 s within the hour; 36001 is unknown."""
        timing = self.state_time_speed[0].timing
        value = None if timing is None else timing.max_end_time
        return TIME_MARK_UNKNOWN if value is None else value

    @property
    def likely_time(self) -> int:
        """0.1 s within the hour; 36001 is unknown."""
        timing = self.state_time_speed[0].timing
        value = None if timing is None else timing.likely_time
        return TIME_MARK_UNKNOWN if value is None else value

    @property
    def confidence(self) -> float | None:
        """Confidence of `likely_time`, 0 to 1, or None."""
        timing = self.state_time_speed[0].timing
        value = None if timing is None else timing.confidence
        return None if value is None else TIME_CONFIDENCES[value] / 100.0


class IntersectionState(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """One junction of a SPATEM.

    Attributes:
        revision: Must equal that of the map the receiver holds.
        status: 16 characters 0 or 1, one for each of `STATUS_BITS`.
        moy: Minute of the year.      timestamp: Milliseconds within the minute.
    """

    name: Name | None = None
    id: IntersectionId
    revision: Revision
    status: Annotated[str, Meta(pattern="^[01]{16}$")]
    moy: MinuteOfYear | None = None
    timestamp: DSecond | None = None
    states: Annotated[tuple[MovementState, ...], Meta(min_length=1, max_length=255)]


class SpatemBody(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=True):
    """A SPATEM; our roadside units send one junction, of others' messages we read the first."""

    protocol_version: Byte
    station_id: StationId
    timestamp: MinuteOfYear | None = None
    intersections: Annotated[tuple[IntersectionState, ...], Meta(min_length=1, max_length=32)]

    @property
    def intersection(self) -> int:
        """The junction's number."""
        return self.intersections[0].id.id

    @property
    def revision(self) -> int:
        """Of the junction's map."""
        return self.intersections[0].revision

    @property
    def status(self) -> tuple[str, ...]:
        """Names of the set bits: `fixedTimeOperation`, `failureFlash` ..."""
        bits = self.intersections[0].status
        return tuple(
            name
            for name, bit in zip(STATUS_BITS, bits[: len(STATUS_BITS)], strict=True)
            if bit == "1"
        )

    @property
    def states(self) -> tuple[MovementState, ...]:
        """The signal groups."""
        return self.intersections[0].states
