"""Random position offset: somewhere else, by another way each time.

p' = p + d, drawn anew for each CAM, sizes as in constant_position_offset
"""

import random

from scm.v2x.etsi_convert import read_cam
from scm.v2x.misbehaviour.attack import Attack, Frame, Scene, Sent, Transform
from scm.v2x.misbehaviour.attacks.constant_position_offset import offset_m
from scm.v2x.misbehaviour.forge import moved


def _start(rng: random.Random, scene: Scene) -> Transform:
    del scene

    def send(frame: Frame) -> list[Sent]:
        told = read_cam(frame.body)
        body = moved(frame.body, told.x_m + offset_m(rng), told.y_m + offset_m(rng))
        return [Sent(frame._replace(body=body), lies=True)]

    return send


ATTACK = Attack("a position that is off by another way each time", _start)
