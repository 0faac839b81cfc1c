"""Made-up CAMs and tracks, and a detector for them, for the tests of checks and fusion."""

import math

from scm.clock import NS_PER_S, nanoseconds
from scm.maps.load import load_map
from scm.maps.route import Roads
from scm.traffic.misbehaviour.detector import Detector
from scm.traffic.misbehaviour.ground import Ground
from scm.v2x.etsi.convert import cam_of
from scm.v2x.messages.eye_track import EyeTrack
from scm.v2x.messages.vehicle_state import VehicleState

START_NS = 1_795_000_000_000_000_000
RSU = "rsu-crossing"
MAP = load_map("driving_school")
ROADS = Roads(MAP)
LANE = ROADS.lane("crossing_south_east")
FRONT_M = 0.23


def ground():
    return Ground(MAP, lambda _x, _y: True)


def detector(*checks):
    """Return a detector with some checks, or with all of them."""
    return Detector(ground(), checks=checks or None)


def state(t_s, s_m, v=0.2, a=0.0, name="n1", shift=(0.0, 0.0), turn=0.0):
    """Return a car so far along the lane to the crossing, then shifted and turned."""
    pose = LANE.at(s_m)
    return VehicleState(
        vehicle=name,
        t_ns=START_NS + round(t_s * NS_PER_S),
        seq=1,
        x_m=pose.x + shift[0],
        y_m=pose.y + shift[1],
        yaw_rad=math.remainder(pose.yaw + turn, math.tau),
        speed_mps=v,
        lateral_speed_mps=0.0,
        yaw_rate_radps=0.0,
        accel_mps2=a,
        steering_rad=0.0,
        throttle=0.0,
        steering=0.0,
        source="simulated",
        epoch=1,
        mode="drive",
    )


def body(told, length_m=0.3):
    return cam_of(told, length_m=length_m, width_m=0.175, front_m=FRONT_M)


def receive(judge, told, station=None, receiver=RSU, sent_ns=None, lost_s=0.0, **options):
    """Let a detector hear the CAM of a state."""
    sent = told.t_ns if sent_ns is None else sent_ns
    lost_ns = nanoseconds(lost_s)
    return judge.receive(station or told.vehicle, receiver, sent, body(told, **options), lost_ns)


def track(told, vehicle=None, stale=False, std=0.003, age_s=0.0):
    """Return what the Eye tells of a car that is in a state."""
    row = (std, std, 0.01, 0.01, 0.01, 0.1)
    covariance = tuple(tuple(s * s if i == j else 0.0 for j in range(6)) for i, s in enumerate(row))
    return EyeTrack(
        vehicle=vehicle or told.vehicle,
        tag_id=1,
        t_ns=told.t_ns,
        x_m=told.x_m,
        y_m=told.y_m,
        yaw_rad=told.yaw_rad,
        speed_mps=told.speed_mps,
        lateral_speed_mps=0.0,
        yaw_rate_radps=0.0,
        covariance=covariance,
        age_s=age_s,
        stale=stale,
    )
