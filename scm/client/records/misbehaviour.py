"""Records of misbehaviour.

Written by docs/make/client.py: do not change it here.
"""

import msgspec

from scm.client.records.misbehaviour_parts import (
    Acceleration,
    BasicContainer,
    Curvature,
    Heading,
    Observation,
    Speed,
    VehicleLength,
)


class YawRate(msgspec.Struct, kw_only=True, frozen=True):
    """0.01 degree/s, + = left, 32767 unknown; confidence: a class, 8 unknown.

    Attributes:
        value: By the units of the standard.
        confidence: How sure that is, in the steps of the standard.
    """

    value: int = 32767
    confidence: int = 8


class VehicleHighFrequency(msgspec.Struct, kw_only=True, frozen=True):
    """How a car moves.

    Attributes:
        heading: 0.1 degree clockwise from north, map +y, 3601 unknown; confidence likewise, 127
            unknown.
        speed: 0.01 m/s, 16383 unknown; confidence 0.01 m/s, 127 unknown.
        drive_direction: 0 forward, 1 backward, 2 unknown.
        vehicle_length: 0.1 m, 1023 unknown; confidence: 0 no trailer, 4 unknown.
        vehicle_width: 0.1 m, 62 unknown.
        longitudinal_acceleration: 0.1 m/s^2, 161 unknown; confidence 0.1 m/s^2, 102 unknown.
        curvature: Of its path, by the standard.
        curvature_calculation_mode: 0 from the yaw rate, 1 not, 2 unknown.
        yaw_rate: 0.01 degree/s, + = left, 32767 unknown; confidence: a class, 8 unknown.
    """

    heading: Heading
    speed: Speed
    drive_direction: int = 0
    vehicle_length: VehicleLength
    vehicle_width: int
    longitudinal_acceleration: Acceleration | None = None
    curvature: Curvature | None = None
    curvature_calculation_mode: int = 0
    yaw_rate: YawRate | None = None


class HighFrequencyContainer(msgspec.Struct, kw_only=True, frozen=True):
    """The standard's choice between a vehicle's and a roadside unit's; the vehicle's.

    Attributes:
        basic_vehicle_container_high_frequency: How a car moves.
    """

    basic_vehicle_container_high_frequency: VehicleHighFrequency


class ExteriorLights(msgspec.Struct, kw_only=True, frozen=True):
    """Which lights are switched on, in the order of the standard's bits.

    Attributes:
        low_beam_headlights_on: Whether they are on.
        high_beam_headlights_on: Whether they are on.
        left_turn_signal_on: Whether it is on.
        right_turn_signal_on: Whether it is on.
        daytime_running_lights_on: Whether they are on.
        reverse_light_on: Whether it is on.
        fog_light_on: Whether it is on.
        parking_lights_on: Whether they are on.
    """

    low_beam_headlights_on: bool = False
    high_beam_headlights_on: bool = False
    left_turn_signal_on: bool = False
    right_turn_signal_on: bool = False
    daytime_running_lights_on: bool = False
    reverse_light_on: bool = False
    fog_light_on: bool = False
    parking_lights_on: bool = False


class DeltaPosition(msgspec.Struct, kw_only=True, frozen=True):
    """From a reference: 1e-7 degree, 131072 unknown; 0.01 m up, 12800 unknown.

    Attributes:
        delta_latitude: Against the reference position [1e-7 degree].
        delta_longitude: Against the reference position [1e-7 degree].
        delta_altitude: Against the reference position [cm].
    """

    delta_latitude: int
    delta_longitude: int
    delta_altitude: int = 12800


class PathPoint(msgspec.Struct, kw_only=True, frozen=True):
    """Where a car was; path_delta_time: 0.01 s from here to the point before it in the list.

    Attributes:
        path_position: From a reference: 1e-7 degree, 131072 unknown; 0.01 m up, 12800 unknown.
        path_delta_time: Since the point before [10 ms].
    """

    path_position: DeltaPosition
    path_delta_time: int | None = None


class VehicleLowFrequency(msgspec.Struct, kw_only=True, frozen=True):
    """What changes slowly; path_history: newest point first, each from the one before it.

    Attributes:
        vehicle_role: By the standard; 0: nothing special.
        exterior_lights: Which lights are switched on, in the order of the standard's bits.
        path_history: Where a car was; path_delta_time: 0.01 s from here to the point before it in
            the list.
    """

    vehicle_role: int = 0
    exterior_lights: ExteriorLights | None = None
    path_history: tuple[PathPoint, ...] = ()


class LowFrequencyContainer(msgspec.Struct, kw_only=True, frozen=True):
    """The standard's choice, of which there is one so far.

    Attributes:
        basic_vehicle_container_low_frequency: What changes slowly; path_history: newest point
            first, each from the one before it.
    """

    basic_vehicle_container_low_frequency: VehicleLowFrequency


class CamBody(msgspec.Struct, kw_only=True, frozen=True):
    """A CAM; generation_delta_time: milliseconds modulo 65536.

    Attributes:
        protocol_version: Of the message.
        station_id: Its number in messages of the standard.
        generation_delta_time: When it was made, modulo 65 536 [ms].
        basic_container: Who and where: the middle of the front bumper.
        high_frequency_container: The standard's choice between a vehicle's and a roadside unit's;
            the vehicle's.
        low_frequency_container: The standard's choice, of which there is one so far.
    """

    protocol_version: int
    station_id: int
    generation_delta_time: int
    basic_container: BasicContainer
    high_frequency_container: HighFrequencyContainer
    low_frequency_container: LowFrequencyContainer | None = None


class EvidenceCam(msgspec.Struct, kw_only=True, frozen=True):
    """A CAM that was judged, and when it was sent.

    Attributes:
        t_ns: When it was true, by the clock of who tells it [ns].
        body: The message itself, by the names of the standard.
    """

    t_ns: int
    body: CamBody


class EvidencePose(msgspec.Struct, kw_only=True, frozen=True):
    """Where the Eye saw the station's own tag: the rear axle, map frame.

    Attributes:
        t_ns: When it was true, by the clock of who tells it [ns].
        x_m: To the right on the map [m].
        y_m: Up on the map [m].
        yaw_rad: Direction, counter-clockwise from map x [rad].
        speed_mps: Speed, + = forward [m/s].
    """

    t_ns: int
    x_m: float
    y_m: float
    yaw_rad: float
    speed_mps: float


class MisbehaviourReport(msgspec.Struct, kw_only=True, frozen=True):
    """After ETSI TS 103 759: who, since when, which classes of observations, and the evidence.

    Told when a station becomes suspect, and every ten seconds while it stays so.

    Attributes:
        suspect: The station by its name on the bus.
        suspect_id: Its number in the CAMs; not that of its name where it lies about it.
        t_ns: When it was true, by the clock of who tells it [ns].
        since_ns: Since when it is suspected.
        score: What is held against it, as in `MisbehaviourScores`.
        observations: The worst first.
        evidence: CAMs in order of time: each that gave points, and the one before it.
        seen: Where the Eye saw it, if it did.
    """

    suspect: str
    suspect_id: int
    t_ns: int
    since_ns: int
    score: float
    observations: tuple[Observation, ...]
    evidence: tuple[EvidenceCam, ...]
    seen: EvidencePose | None = None
