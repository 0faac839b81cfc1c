"""Random speed offset: faster or slower, by another amount each time.

v' = v + d, drawn anew for each CAM, sizes as in constant_speed_offset
"""

import random

from scm.v2x.etsi_convert import read_cam
from scm.v2x.misbehaviour.attack import Attack, Frame, Scene, Sent, Transform
from scm.v2x.misbehaviour.attacks.constant_speed_offset import offset_mps, with_speed


def _start(rng: random.Random, scene: Scene) -> Transform:
    del scene

    def send(frame: Frame) -> list[Sent]:
        return [with_speed(frame, (read_cam(frame.body).speed_mps or 0.0) + offset_mps(rng))]

    return send


ATTACK = Attack("a speed that is off by another amount each time", _start)
