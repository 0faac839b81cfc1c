"""Sudden stop: from some moment on it reports to stand, and drives on.

p' = p(t*), v' = 0, t* with 5 % for each CAM while it drives
a lie while it drives, or once it is 20 m of the full city away
"""

import math
import random

from scm.traffic.misbehaviour.attack import MIN_LIE_MPS, Attack, Frame, Scene, Sent, Transform
from scm.traffic.misbehaviour.forge import driven, moved
from scm.v2x.etsi.cam_spatem import SCALE
from scm.v2x.etsi.convert import CamView, read_cam

CHANCE = 0.05
AWAY_M = 20.0 / SCALE


def _start(rng: random.Random, scene: Scene) -> Transform:
    del scene
    stop: CamView | None = None

    def send(frame: Frame) -> list[Sent]:
        nonlocal stop
        reported = read_cam(frame.body)
        is_driving = abs(reported.speed_mps or 0.0) > MIN_LIE_MPS
        if stop is None and is_driving and reported.place is not None and rng.random() < CHANCE:
            stop = reported
        if stop is None or stop.place is None or reported.place is None:
            return [Sent(frame, lies=False)]
        body = moved(frame.body, *stop.place)
        body = driven(body, speed_mps=0.0, yaw_rad=stop.yaw_rad, accel_mps2=0.0)
        away = math.dist(reported.place, stop.place) >= AWAY_M
        return [Sent(frame._replace(body=body), lies=is_driving or away)]

    return send


ATTACK = Attack("a stop that does not happen", _start)
