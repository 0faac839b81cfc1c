"""What is concealed in cars of the independent reality that drive in studies; needs a clone."""

import numpy as np

from scm.clock import NS_PER_S
from tests.reality.motion import COMMAND_S
from tests.reality.numbers import nominal, scattered
from vehicle_agent.bodies.reality import RealityBody, engine_of

CONCEALED = {
    "nothing": {},
    "drive_delay": {"drive_delay": 0.25},
    "drive_deadband": {"drive_deadband": 0.15},
    "drive_gain": {"drive_gain": 0.7},
    "steer_trim": {"trim": 0.05},
    "steer_gain": {"steer_gain": 0.8},
    "servo_rate": {"rate": 0.21},
}
CONCEALED["all"] = {name: value for one in CONCEALED.values() for name, value in one.items()}
CONCEALED |= {
    "late_throttle_weak_steering": {"drive_delay": 0.2, "steer_gain": 0.85},
    "late_weak_steering": {"steer_delay": 0.2, "steer_gain": 0.85},
}
"""Effects by the names of `parking.py`, and what `cloning.py` tries, as that reality's numbers."""


def concealing(engine: str, concealed: str, rng: np.random.Generator) -> RealityBody:
    """Return a Nigel that holds commands of 20 Hz.

    Args:
        engine: That moves it, a key of `tests.reality.engine.ENGINES`.
        concealed: A key of `CONCEALED`.
        rng: How it differs from its kind, and its sensors' noise.
    """
    numbers = scattered(nominal("nigel"), rng) | CONCEALED[concealed]
    every_ns = round(COMMAND_S * NS_PER_S)
    return RealityBody("nigel", engine_of(engine), lambda *_: numbers, rng, command_ns=every_ns)
