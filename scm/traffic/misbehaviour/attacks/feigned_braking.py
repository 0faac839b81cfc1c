"""Feigned braking: reports hard braking while it speeds up.

a' = -k a, k of 2..4        a lie where a > 0.25 m/s^2 of the full city
"""

import random

from scm.traffic.misbehaviour.attack import Attack, Frame, Scene, Sent, Transform
from scm.traffic.misbehaviour.attacks.acceleration_multiplication import LEAST, MOST, accel_of
from scm.traffic.misbehaviour.forge import driven
from scm.v2x.etsi.cam_spatem import SCALE

SPEEDS_UP_MPS2 = 0.25 / SCALE


def _start(rng: random.Random, scene: Scene) -> Transform:
    del scene
    factor = rng.uniform(LEAST, MOST)

    def send(frame: Frame) -> list[Sent]:
        accel = accel_of(frame)
        if accel is None or accel <= SPEEDS_UP_MPS2:
            return [Sent(frame, lies=False)]
        body = driven(frame.body, accel_mps2=-factor * accel)
        return [Sent(frame._replace(body=body), lies=True)]

    return send


ATTACK = Attack("hard braking while it speeds up", _start)
