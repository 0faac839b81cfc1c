"""Constant speed offset: always the same error of speed.

v' = v + d, |d| 1..7 m/s of the full city, 0.07..0.5 m/s here; v' >= 0
"""

import random

from scm.traffic.misbehaviour.attack import Attack, Frame, Scene, Sent, Transform
from scm.traffic.misbehaviour.forge import driven
from scm.v2x.etsi.cam_spatem import SCALE
from scm.v2x.etsi.convert import read_cam

LEAST_MPS, MOST_MPS = 1.0 / SCALE, 7.0 / SCALE


def offset_mps(rng: random.Random) -> float:
    """Return an offset [m/s]."""
    return rng.choice((-1.0, 1.0)) * rng.uniform(LEAST_MPS, MOST_MPS)


def faster(frame: Frame, by_mps: float) -> Sent:
    """Return a frame with another speed; it lies unless that is the speed it had."""
    speed = read_cam(frame.body).speed_mps
    if speed is None:
        return Sent(frame, lies=False)
    reported = max(0.0, speed + by_mps)
    body = driven(frame.body, speed_mps=reported)
    return Sent(frame._replace(body=body), lies=abs(reported - speed) > LEAST_MPS / 2.0)


def _start(rng: random.Random, scene: Scene) -> Transform:
    del scene
    offset = offset_mps(rng)

    def send(frame: Frame) -> list[Sent]:
        return [faster(frame, offset)]

    return send


ATTACK = Attack("a speed with a constant error", _start)
