"""Zero speed: reports to stand, wherever it is.

v' = 0        a lie while it drives: above 1 m/s of the full city, and moved
"""

import math
import random

from scm.traffic.misbehaviour.attack import (
    MIN_LIE_MPS,
    NOISE_M,
    Attack,
    Frame,
    Scene,
    Sent,
    Transform,
)
from scm.traffic.misbehaviour.forge import driven
from scm.v2x.etsi.convert import CamView, read_cam


def drives(reported: CamView, before: CamView | None) -> bool:
    """Return whether a car truly moves, by its speed and its way since the CAM before."""
    was = None if before is None else before.place
    if was is None or reported.place is None or abs(reported.speed_mps or 0.0) <= MIN_LIE_MPS:
        return False
    return math.dist(reported.place, was) > NOISE_M / 5.0


def _start(rng: random.Random, scene: Scene) -> Transform:
    del rng, scene
    before: CamView | None = None

    def send(frame: Frame) -> list[Sent]:
        nonlocal before
        reported, last = read_cam(frame.body), before
        before = reported
        body = driven(frame.body, speed_mps=0.0)
        return [Sent(frame._replace(body=body), lies=drives(reported, last))]

    return send


ATTACK = Attack("a speed of zero while driving", _start)
