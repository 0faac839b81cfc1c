"""Constant position offset: always the same error of position.

p' = p + d, |dx| and |dy| each 20..70 m of the full city, 1.4..5 m here
"""

import random

from scm.traffic.misbehaviour.attack import Attack, Frame, Scene, Sent, Transform
from scm.traffic.misbehaviour.forge import moved
from scm.v2x.etsi.cam_spatem import SCALE
from scm.v2x.etsi.convert import read_cam

LEAST_M, MOST_M = 20.0 / SCALE, 70.0 / SCALE


def offset_m(rng: random.Random) -> float:
    """Return an offset along one axis [m]."""
    return rng.choice((-1.0, 1.0)) * rng.uniform(LEAST_M, MOST_M)


def _start(rng: random.Random, scene: Scene) -> Transform:
    del scene
    dx, dy = offset_m(rng), offset_m(rng)

    def send(frame: Frame) -> list[Sent]:
        place = read_cam(frame.body).place
        if place is None:
            return [Sent(frame, lies=False)]
        body = moved(frame.body, place[0] + dx, place[1] + dy)
        return [Sent(frame._replace(body=body), lies=True)]

    return send


ATTACK = Attack("a position with a constant error", _start)
