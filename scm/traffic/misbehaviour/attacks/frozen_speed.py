"""Frozen speed: from some moment on, the speed of that moment.

v' = v(t*), t* with 5 % for each CAM        a lie where |v' - v| > 1 m/s of the full city
"""

import random

from scm.traffic.misbehaviour.attack import MIN_LIE_MPS, Attack, Frame, Scene, Sent, Transform
from scm.traffic.misbehaviour.forge import driven
from scm.v2x.etsi.convert import read_cam

CHANCE = 0.05


def _start(rng: random.Random, scene: Scene) -> Transform:
    del scene
    frozen: float | None = None

    def send(frame: Frame) -> list[Sent]:
        nonlocal frozen
        speed = read_cam(frame.body).speed_mps
        if frozen is None and rng.random() < CHANCE:
            frozen = speed
        if frozen is None or speed is None:
            return [Sent(frame, lies=False)]
        body = driven(frame.body, speed_mps=frozen)
        return [Sent(frame._replace(body=body), lies=abs(frozen - speed) > MIN_LIE_MPS)]

    return send


ATTACK = Attack("a speed that never changes", _start)
