"""Position mirroring: a position on the other side of the road.

p' = p mirrored at the left edge of the lane; heading and speed stay
"""

import math
import random

from scm.traffic.misbehaviour.attack import Attack, Frame, Scene, Sent, Transform
from scm.traffic.misbehaviour.forge import moved
from scm.v2x.etsi.convert import read_cam


def _start(rng: random.Random, scene: Scene) -> Transform:
    del rng

    def send(frame: Frame) -> list[Sent]:
        place = read_cam(frame.body).place
        road = None if place is None else scene.ground.road_near(*place)
        if place is None or road is None:
            return [Sent(frame, lies=False)]
        x, y, yaw, half = road
        left = -math.sin(yaw), math.cos(yaw)
        lateral = (place[0] - x) * left[0] + (place[1] - y) * left[1]
        way = 2.0 * (half - lateral)
        body = moved(frame.body, place[0] + way * left[0], place[1] + way * left[1])
        return [Sent(frame._replace(body=body), lies=True)]

    return send


ATTACK = Attack("a position on the other side of the road", _start)
