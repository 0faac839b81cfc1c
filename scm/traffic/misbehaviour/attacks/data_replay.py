"""Data replay: another car's CAMs as one's own.

4..8 CAMs of one victim in a row, with one's own number and the present time, then another one
victims within 400 m of the full city, CAMs of the last 5 s
"""

import math
import random

from scm.clock import NS_PER_S
from scm.traffic.misbehaviour.attack import Attack, Frame, Scene, Sent, Transform
from scm.traffic.misbehaviour.forge import stamped
from scm.v2x.etsi.cam_spatem import SCALE
from scm.v2x.etsi.convert import read_cam

FEWEST, MOST = 4, 8
NEAR_M = 400.0 / SCALE
WITHIN_NS = 5 * NS_PER_S


def _start(rng: random.Random, scene: Scene) -> Transform:
    queue: list[Frame] = []

    def victims(frame: Frame) -> dict[str, list[Frame]]:
        here = read_cam(frame.body).place
        found: dict[str, list[Frame]] = {}
        for seen in scene.received:
            there = read_cam(seen.body).place
            near = here is not None and there is not None and math.dist(here, there) <= NEAR_M
            if near and frame.t_ns - seen.t_ns <= WITHIN_NS and seen.station != frame.station:
                found.setdefault(seen.station, []).append(seen)
        return found

    def send(frame: Frame) -> list[Sent]:
        if not queue:
            found = victims(frame)
            if found:
                queue.extend(found[rng.choice(sorted(found))][-rng.randint(FEWEST, MOST) :])
        if not queue:
            return [Sent(frame, lies=False)]
        body = stamped(queue.pop(0).body, frame.t_ns, frame.body.station_id)
        return [Sent(frame._replace(body=body), lies=True)]

    return send


ATTACK = Attack("another car's messages as its own", _start)
