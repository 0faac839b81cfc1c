"""Denial of service: each CAM several times.

2..4 copies, 500 ms / copies apart
"""

import random

from scm.clock import NS_PER_S
from scm.traffic.misbehaviour.attack import Attack, Frame, Scene, Sent, Transform

FEWEST, MOST = 2, 4
WITHIN_NS = NS_PER_S // 2


def _start(rng: random.Random, scene: Scene) -> Transform:
    del scene
    copies = rng.randint(FEWEST, MOST)

    def send(frame: Frame) -> list[Sent]:
        times = (frame.t_ns + k * WITHIN_NS // copies for k in range(copies + 1))
        return [Sent(frame._replace(t_ns=t_ns), lies=True) for t_ns in times]

    return send


ATTACK = Attack("each message several times", _start)
