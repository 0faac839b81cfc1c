"""Position mirroring: on the other side of the road.

p' = p mirrored at the left edge of the lane; heading and speed stay
"""

import math
import random

from scm.v2x.etsi_convert import read_cam
from scm.v2x.misbehaviour.attack import Attack, Frame, Scene, Sent, Transform
from scm.v2x.misbehaviour.forge import moved


def _start(rng: random.Random, scene: Scene) -> Transform:
    del rng

    def send(frame: Frame) -> list[Sent]:
        told = read_cam(frame.body)
        road = scene.ground.road_near(told.x_m, told.y_m)
        if road is None:
            return [Sent(frame, lies=False)]
        x, y, yaw, half = road
        left = -math.sin(yaw), math.cos(yaw)
        lateral = (told.x_m - x) * left[0] + (told.y_m - y) * left[1]
        way = 2.0 * (half - lateral)
        body = moved(frame.body, told.x_m + way * left[0], told.y_m + way * left[1])
        return [Sent(frame._replace(body=body), lies=True)]

    return send


ATTACK = Attack("a position on the other side of the road", _start)
