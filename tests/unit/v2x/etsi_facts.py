"""What its-client's JSON schemas say of the fields that we send, restated in a table of our own.

A record is a dictionary; a name that ends in `?` may be missing, every other must be there, and no
further names are allowed (the schemas do allow them inside a message: ours has none). (low, high)
is an integer, a list is [item, fewest, most], text in a tuple one of these words.
"""

WORD, BYTE, ID32 = (0, 65_535), (0, 255), (0, 2**32 - 1)
LATITUDE, LONGITUDE = (-900_000_000, 900_000_001), (-1_800_000_000, 1_800_000_001)
ITS_TIME, MINUTE = (0, 4_398_046_511_103), (0, 527_040)
ANGLE, SURE, REVISION = (0, 3601), (1, 127), (0, 127)
DELTA, AXIS = (-131_071, 131_072), (0, 4095)


def with_confidence(low, high, least, most):
    return {"value": (low, high), "confidence": (least, most)}


ALTITUDE = with_confidence(-100_000, 800_001, 0, 15)
POSITION = {
    "latitude": LATITUDE,
    "longitude": LONGITUDE,
    "position_confidence_ellipse": {
        "semi_major": AXIS,
        "semi_minor": AXIS,
        "semi_major_orientation": ANGLE,
    },
    "altitude": ALTITUDE,
}
POINT = {
    "path_position": {
        "delta_latitude": DELTA,
        "delta_longitude": DELTA,
        "delta_altitude": (-12_700, 12_800),
    },
    "path_delta_time?": (1, 65_535),
}
HEAD = {"protocol_version": BYTE, "station_id": ID32}
LIGHTS = (
    *("low_beam_headlights_on", "high_beam_headlights_on", "left_turn_signal_on"),
    *("right_turn_signal_on", "daytime_running_lights_on", "reverse_light_on"),
    *("fog_light_on", "parking_lights_on"),
)
CAM = HEAD | {
    "generation_delta_time": WORD,
    "basic_container": {"station_type": BYTE, "reference_position": POSITION},
    "high_frequency_container": {
        "basic_vehicle_container_high_frequency": {
            "heading": with_confidence(0, 3601, 1, 127),
            "speed": with_confidence(0, 16_383, 1, 127),
            "drive_direction": (0, 2),
            "vehicle_length": with_confidence(1, 1023, 0, 4),
            "vehicle_width": (1, 62),
            "longitudinal_acceleration": with_confidence(-160, 161, 0, 102),
            "curvature": with_confidence(-1023, 1023, 0, 7),
            "curvature_calculation_mode": (0, 2),
            "yaw_rate": with_confidence(-32_766, 32_767, 0, 8),
        }
    },
    "low_frequency_container?": {
        "basic_vehicle_container_low_frequency": {
            "vehicle_role": (0, 15),
            "exterior_lights": dict.fromkeys(LIGHTS, bool),
            "path_history": [POINT, 0, 40],
        }
    },
}
EVENT = {"cause": BYTE, "subcause?": BYTE}
DENM = HEAD | {
    "management_container": {
        "action_id": {"originating_station_id": ID32, "sequence_number": WORD},
        "detection_time": ITS_TIME,
        "reference_time": ITS_TIME,
        "termination?": (0, 1),
        "event_position": {
            "latitude": LATITUDE,
            "longitude": LONGITUDE,
            "altitude?": ALTITUDE,
            "position_confidence_ellipse?": {
                "semi_major_confidence": AXIS,
                "semi_minor_confidence": AXIS,
                "semi_major_orientation": ANGLE,
            },
        },
        "awareness_distance?": (0, 7),
        "relevance_traffic_direction?": (0, 3),
        "validity_duration?": (0, 86_400),
        "transmission_interval?": (1, 10_000),
        "station_type?": BYTE,
    },
    "situation_container?": {"information_quality": (0, 7), "event_type": EVENT},
    "location_container?": {
        "event_speed?": with_confidence(0, 16_383, 1, 127),
        "event_position_heading?": with_confidence(0, 3601, 1, 127),
        "detection_zones_to_event_position?": [{"path": [POINT, 0, 40]}, 1, 7],
    },
}
CPM = HEAD | {
    "management_container": {"reference_time": ITS_TIME, "reference_position": POSITION},
    "sensor_information_container?": [
        {"sensor_id": BYTE, "sensor_type": (0, 31), "shadowing_applies": bool}, 1, 128,
    ],
    "perceived_object_container?": [
        {
            "measurement_delta_time": (-2048, 2047),
            "position": dict.fromkeys(
                ("x_coordinate", "y_coordinate"), with_confidence(-131_072, 131_071, 1, 4096)
            ),
            "object_id?": WORD,
            "velocity?": {
                "cartesian_velocity": dict.fromkeys(
                    ("x_velocity", "y_velocity"), with_confidence(-16_383, 16_383, 1, 127)
                )
            },
            "angles?": {"z_angle": with_confidence(0, 3601, 1, 127)},
            "z_angular_velocity?": with_confidence(-255, 256, 0, 7),
            "object_dimension_x?": with_confidence(1, 256, 1, 32),
            "object_dimension_y?": with_confidence(1, 256, 1, 32),
            "sensor_id_list?": [BYTE, 1, 128],
            "classification?": [
                {"object_class": {"vehicle": BYTE}, "confidence": (1, 101)}, 1, 8,
            ],
        },
        0,
        255,
    ],
}  # fmt: skip
JUNCTION = {"id": WORD, "region?": WORD}
MARK = (0, 36_001)
SPATEM = HEAD | {
    "timestamp?": MINUTE,
    "intersections": [
        {
            "name?": str,
            "id": JUNCTION,
            "revision": REVISION,
            "status": "^[01]{16}$",
            "moy?": MINUTE,
            "timestamp?": WORD,
            "states": [
                {
                    "signal_group": BYTE,
                    "state_time_speed": [
                        {
                            "event_state": (0, 9),
                            "timing?": {
                                "min_end_time": MARK,
                                "max_end_time?": MARK,
                                "likely_time?": MARK,
                                "confidence?": (0, 15),
                            },
                        },
                        1,
                        16,
                    ],
                },
                1,
                255,
            ],
        },
        1,
        32,
    ],
}
PLACE = {"latitude": LATITUDE, "longitude": LONGITUDE, "elevation?": (-4096, 61_439)}
MANOEUVRES, OFFSET, APPROACH = "^[01]{12}$", (-32_768, 32_767), (0, 15)
MAPEM = HEAD | {
    "timestamp?": MINUTE,
    "msg_issue_revision": REVISION,
    "layer_type?": ("intersectionData",),
    "intersections?": [
        {
            "name?": str,
            "id": JUNCTION,
            "revision": REVISION,
            "ref_point": PLACE,
            "lane_width?": (0, 32_767),
            "speed_limits?": [{"type": ("vehicleMaxSpeed",), "speed": (0, 8191)}, 1, 9],
            "lane_set": [
                {
                    "lane_id": BYTE,
                    "name?": str,
                    "ingress_approach?": APPROACH,
                    "egress_approach?": APPROACH,
                    "lane_attributes": {
                        "directional_use": [("ingressPath", "egressPath"), 1, 2],
                        "shared_with": [("individualMotorizedVehicleTraffic",), 0, 10],
                        "lane_type": {"vehicle": [("isVehicleRevocableLane",), 0, 8]},
                    },
                    "maneuvers?": MANOEUVRES,
                    "node_list": {
                        "nodes": [{"delta": {"node_xy": {"x": OFFSET, "y": OFFSET}}}, 2, 63]
                    },
                    "connects_to?": [
                        {
                            "connecting_lane": {"lane": BYTE, "maneuver?": MANOEUVRES},
                            "signal_group?": BYTE,
                            "connection_id?": BYTE,
                        },
                        1,
                        16,
                    ],
                },
                1,
                255,
            ],
        },
        1,
        32,
    ],
}
ACCESS = {"lane": BYTE, "approach": APPROACH, "connection": BYTE}
SREM = HEAD | {
    "timestamp?": MINUTE,
    "second": WORD,
    "sequence_number?": REVISION,
    "requests?": [
        {
            "request": {
                "id": JUNCTION,
                "request_id": BYTE,
                "request_type": (0, 3),
                "inbound_lane": ACCESS,
                "outbound_lane?": ACCESS,
            },
            "minute?": MINUTE,
            "second?": WORD,
            "duration?": WORD,
        },
        1,
        32,
    ],
    "requestor": {
        "id": ID32,
        "type?": {"role": (0, 23), "request?": (0, 15)},
        "position?": {
            "position": PLACE,
            "heading?": (0, 28_800),
            "speed?": {"transmission": (0, 7), "speed": (0, 8191)},
        },
        "name?": str,
    },
}
SSEM = HEAD | {
    "timestamp?": MINUTE,
    "second": WORD,
    "sequence_number?": REVISION,
    "status": [
        {
            "sequence_number": REVISION,
            "id": JUNCTION,
            "sig_status": [
                {
                    "requester?": {
                        "id": ID32,
                        "request": BYTE,
                        "sequence_number": REVISION,
                        "role?": (0, 23),
                    },
                    "inbound_on": ACCESS,
                    "outbound_on?": ACCESS,
                    "minute?": MINUTE,
                    "second?": WORD,
                    "duration?": WORD,
                    "status": (0, 7),
                },
                1,
                32,
            ],
        },
        1,
        32,
    ],
}
FACTS = {
    "cam": CAM, "cpm": CPM, "denm": DENM, "mapem": MAPEM,
    "spatem": SPATEM, "srem": SREM, "ssem": SSEM,
}  # fmt: skip


def schema_of(fact):
    """Return a row of the table as a JSON schema."""
    if isinstance(fact, dict):
        return {
            "type": "object",
            "required": [name for name in fact if not name.endswith("?")],
            "properties": {name.rstrip("?"): schema_of(inner) for name, inner in fact.items()},
            "additionalProperties": False,
        }
    if isinstance(fact, list):
        item, fewest, most = fact
        return {"type": "array", "items": schema_of(item), "minItems": fewest, "maxItems": most}
    if isinstance(fact, tuple) and isinstance(fact[0], int):
        return {"type": "integer", "minimum": fact[0], "maximum": fact[1]}
    if isinstance(fact, tuple):
        return {"enum": list(fact)}
    if isinstance(fact, str):
        return {"type": "string", "pattern": fact}
    return {"type": "boolean" if fact is bool else "string"}
