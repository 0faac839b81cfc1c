"""Time delay: reports of seconds ago with the present time.

CAM'(t) = CAM(t - d) with the time t, d of 2..4 s
"""

import random

from scm.clock import nanoseconds
from scm.traffic.misbehaviour.attack import Attack, Frame, Scene, Sent, Transform
from scm.traffic.misbehaviour.forge import stamped

LEAST_S, MOST_S = 2.0, 4.0


def _start(rng: random.Random, scene: Scene) -> Transform:
    del scene
    late_ns = nanoseconds(rng.uniform(LEAST_S, MOST_S))

    def send(frame: Frame) -> list[Sent]:
        t_ns = frame.t_ns + late_ns
        body = stamped(frame.body, t_ns)
        return [Sent(Frame(frame.station, t_ns, body), lies=True)]

    return send


ATTACK = Attack("old positions with the present time", _start)
