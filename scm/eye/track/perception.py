"""Tracks as a collective perception message, as a roadside unit with cameras sends it."""

import math
from collections.abc import Sequence

from scm.clock import NS_PER_MS
from scm.eye.track.sighting import Track
from scm.scenery.bodies import NIGEL, CarBody
from scm.v2x.etsi.cam_spatem import REFERENCE_LATITUDE_DEG, REFERENCE_LONGITUDE_DEG, SCALE
from scm.v2x.etsi.convert import its_ms, station_id
from scm.v2x.etsi.cpm import (
    MAX_OBJECTS,
    PASSENGER_CAR,
    Angle,
    Angles,
    AngularVelocity,
    CartesianVelocity,
    Classification,
    Coordinate,
    CpmBody,
    Dimension,
    ManagementContainer,
    ObjectClass,
    PerceivedObject,
    Position,
    SensorInformation,
    Velocity,
    VelocityComponent,
)
from scm.v2x.etsi.parts import PROTOCOL_VERSION, ReferencePosition
from scm.v2x.messages.cpm import CpmTx

SIGMAS_95 = 1.96
"""Number of standard deviations of a 95 % interval."""
TURN_CLASSES_DEG = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
COORDINATE_LEAST, COORDINATE_MOST, COORDINATE_BEYOND = -131_072, 131_071, 4095
VELOCITY_LEAST, VELOCITY_MOST = -16_383, 16_382
BEYOND, TURN_MOST, LENGTH_MOST = 126, 255, 255


def collective_perception(
    tracks: Sequence[Track], station: str, t_ns: int, body: CarBody = NIGEL
) -> CpmTx:
    """Return a roadside unit's message; stale and tentative tracks are left out.

    Args:
        tracks: As `Tracks.at` gives them; at most the newest 255.
        station: Of the roadside unit, as on the bus.
        t_ns: The reference time.
        body: The dimensions of the cars.
    """
    reported = [one for one in tracks if not one.stale and "tentative" not in one.flags]
    reported = sorted(reported, key=lambda one: one.age_s)[:MAX_OBJECTS]
    cameras = sorted({name for one in reported for name in one.cameras})
    sensors = tuple(SensorInformation(sensor_id=index) for index in range(len(cameras)))
    objects = (_perceived(one, cameras, t_ns, body) for one in reported)
    container = ManagementContainer(
        reference_time=max(0, its_ms(t_ns)),
        reference_position=ReferencePosition(
            latitude=round(REFERENCE_LATITUDE_DEG * 1e7),
            longitude=round(REFERENCE_LONGITUDE_DEG * 1e7),
        ),
    )
    filled = CpmBody(
        protocol_version=PROTOCOL_VERSION,
        station_id=station_id(station),
        management_container=container,
        sensor_information_container=sensors or None,
        perceived_object_container=tuple(objects),
    )
    return CpmTx(station=station, t_ns=t_ns, body=filled)


def _perceived(track: Track, cameras: list[str], t_ns: int, body: CarBody) -> PerceivedObject:
    c, s = math.cos(track.yaw_rad), math.sin(track.yaw_rad)
    ahead, left = sum(body.x_span) / 2.0, sum(body.y_span) / 2.0
    std = track.covariance.diagonal() ** 0.5
    along, across = track.speed_mps, track.lateral_speed_mps
    speed_std = float(max(std[3], std[4]))
    turn = math.degrees(track.yaw_rate_rad_s)
    return PerceivedObject(
        measurement_delta_time=_within((track.t_ns - t_ns) / NS_PER_MS, -2048, 2047),
        object_id=track.tag_id,
        position=Position(
            x_coordinate=_coordinate(track.x_m + c * ahead - s * left, float(std[0])),
            y_coordinate=_coordinate(track.y_m + s * ahead + c * left, float(std[1])),
        ),
        velocity=Velocity(
            cartesian_velocity=CartesianVelocity(
                x_velocity=_velocity(c * along - s * across, speed_std),
                y_velocity=_velocity(s * along + c * across, speed_std),
            )
        ),
        angles=Angles(
            z_angle=Angle(
                value=round((90.0 - math.degrees(track.yaw_rad)) * 10.0) % 3600,
                confidence=_within(math.degrees(SIGMAS_95 * std[2]) * 10.0, 1, BEYOND),
            )
        ),
        z_angular_velocity=AngularVelocity(
            value=_within(turn, -TURN_MOST, TURN_MOST),
            confidence=sum(math.degrees(SIGMAS_95 * std[5]) > most for most in TURN_CLASSES_DEG),
        ),
        object_dimension_x=_dimension(body.x_span),
        object_dimension_y=_dimension(body.y_span),
        sensor_id_list=tuple(cameras.index(name) for name in track.cameras) or None,
        classification=(Classification(object_class=ObjectClass(vehicle=PASSENGER_CAR)),),
    )


def _within(value: float, low: int, high: int) -> int:
    return max(low, min(high, round(value)))


def _coordinate(value_m: float, std_m: float) -> Coordinate:
    value = _within(value_m * SCALE * 100.0, COORDINATE_LEAST, COORDINATE_MOST)
    confidence = _within(SIGMAS_95 * std_m * SCALE * 100.0, 1, COORDINATE_BEYOND)
    return Coordinate(value=value, confidence=confidence)


def _velocity(value_mps: float, std_mps: float) -> VelocityComponent:
    value = _within(value_mps * SCALE * 100.0, VELOCITY_LEAST, VELOCITY_MOST)
    confidence = _within(SIGMAS_95 * std_mps * SCALE * 100.0, 1, BEYOND)
    return VelocityComponent(value=value, confidence=confidence)


def _dimension(span: tuple[float, float]) -> Dimension:
    return Dimension(value=_within((span[1] - span[0]) * SCALE * 10.0, 1, LENGTH_MOST))
