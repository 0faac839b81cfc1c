"""Random position offset: another error of position in each CAM.

p' = p + d, drawn anew for each CAM, sizes as in constant_position_offset
"""

import random

from scm.traffic.misbehaviour.attack import Attack, Frame, Scene, Sent, Transform
from scm.traffic.misbehaviour.attacks.constant_position_offset import offset_m
from scm.traffic.misbehaviour.forge import moved
from scm.v2x.etsi.convert import read_cam


def _start(rng: random.Random, scene: Scene) -> Transform:
    del scene

    def send(frame: Frame) -> list[Sent]:
        place = read_cam(frame.body).place
        if place is None:
            return [Sent(frame, lies=False)]
        body = moved(frame.body, place[0] + offset_m(rng), place[1] + offset_m(rng))
        return [Sent(frame._replace(body=body), lies=True)]

    return send


ATTACK = Attack("a position with another error each time", _start)
