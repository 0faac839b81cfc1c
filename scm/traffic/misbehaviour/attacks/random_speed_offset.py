"""Random speed offset: another error of speed in each CAM.

v' = v + d, drawn anew for each CAM, sizes as in constant_speed_offset
"""

import random

from scm.traffic.misbehaviour.attack import Attack, Frame, Scene, Sent, Transform
from scm.traffic.misbehaviour.attacks.constant_speed_offset import faster, offset_mps


def _start(rng: random.Random, scene: Scene) -> Transform:
    del scene

    def send(frame: Frame) -> list[Sent]:
        return [faster(frame, offset_mps(rng))]

    return send


ATTACK = Attack("a speed with another error each time", _start)
