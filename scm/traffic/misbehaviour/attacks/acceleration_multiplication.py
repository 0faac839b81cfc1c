"""Acceleration multiplication: reports harder acceleration and braking than are true.

a' = k a, k of 2..4        a lie where |a| > 0.5 m/s^2 of the full city
"""

import random

from scm.traffic.misbehaviour.attack import Attack, Frame, Scene, Sent, Transform
from scm.traffic.misbehaviour.claim import accel_of as claimed_accel
from scm.traffic.misbehaviour.forge import driven
from scm.v2x.etsi.cam_spatem import SCALE

HARD_MPS2 = 0.5 / SCALE
LEAST, MOST = 2.0, 4.0


def accel_of(frame: Frame) -> float | None:
    """Return the acceleration of a frame [m/s^2]; None: none, or beyond the field."""
    return claimed_accel(frame.body)[0]


def _start(rng: random.Random, scene: Scene) -> Transform:
    del scene
    factor = rng.uniform(LEAST, MOST)

    def send(frame: Frame) -> list[Sent]:
        accel = accel_of(frame)
        if accel is None:
            return [Sent(frame, lies=False)]
        body = driven(frame.body, accel_mps2=factor * accel)
        return [Sent(frame._replace(body=body), lies=abs(accel) > HARD_MPS2)]

    return send


ATTACK = Attack("an acceleration that is a few times too large", _start)
