"""Reversed heading: a heading the other way.

yaw' = yaw + pi        a lie while it drives
"""

import math
import random

from scm.geometry import wrap_angle
from scm.traffic.misbehaviour.attack import Attack, Frame, Scene, Sent, Transform
from scm.traffic.misbehaviour.attacks.zero_speed import drives
from scm.traffic.misbehaviour.forge import driven
from scm.v2x.etsi.convert import CamView, read_cam


def _start(rng: random.Random, scene: Scene) -> Transform:
    del rng, scene
    before: CamView | None = None

    def send(frame: Frame) -> list[Sent]:
        nonlocal before
        reported, last = read_cam(frame.body), before
        before = reported
        if reported.yaw_rad is None:
            return [Sent(frame, lies=False)]
        body = driven(frame.body, yaw_rad=wrap_angle(reported.yaw_rad + math.pi))
        return [Sent(frame._replace(body=body), lies=drives(reported, last))]

    return send


ATTACK = Attack("a heading the other way", _start)
