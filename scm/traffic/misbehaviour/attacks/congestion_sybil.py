"""Congestion Sybil: a jam of false cars around a real one.

    4..6 ghosts at (+-5..6 m, +-2..3 m) in the car's frame, full city, speeds within 5 % of its own

Each ghost keeps its place, so its claims are consistent. The car's own CAMs are true.
"""

import math
import random

from scm.clock import NS_PER_MS
from scm.traffic.misbehaviour.attack import Attack, Frame, Scene, Sent, Transform
from scm.traffic.misbehaviour.forge import driven, moved, stamped
from scm.v2x.etsi.cam_spatem import SCALE
from scm.v2x.etsi.convert import read_cam, station_id

FEWEST, MOST = 4, 6
NOISE_M = 2.0 / SCALE


def ghost_name(station: str, number: int) -> str:
    """Return the name of a ghost of a station."""
    return f"{station}-ghost{number}"


def _start(rng: random.Random, scene: Scene) -> Transform:
    del scene
    ghosts = [
        (
            rng.choice((-1.0, 1.0)) * rng.uniform(5.0, 6.0) / SCALE
            + rng.uniform(-NOISE_M, NOISE_M),
            rng.choice((-1.0, 1.0)) * rng.uniform(2.0, 3.0) / SCALE,
            rng.uniform(0.95, 1.05),
        )
        for _ in range(rng.randint(FEWEST, MOST))
    ]

    def send(frame: Frame) -> list[Sent]:
        reported = read_cam(frame.body)
        sent = [Sent(frame, lies=False)]
        if reported.place is None or reported.yaw_rad is None or reported.speed_mps is None:
            return sent
        x, y = reported.place
        c, s = math.cos(reported.yaw_rad), math.sin(reported.yaw_rad)
        for number, (ahead, left, factor) in enumerate(ghosts, 1):
            name = ghost_name(frame.station, number)
            t_ns = frame.t_ns + number * NS_PER_MS
            body = moved(frame.body, x + c * ahead - s * left, y + s * ahead + c * left)
            body = driven(body, speed_mps=factor * reported.speed_mps)
            body = stamped(body, t_ns, station_id(name))
            sent.append(Sent(Frame(name, t_ns, body), lies=True))
        return sent

    return send


ATTACK = Attack("several cars around it that do not exist", _start)
