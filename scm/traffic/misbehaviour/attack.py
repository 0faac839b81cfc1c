"""The contract of an attack: from honest CAMs of one station to those that it sends instead.

Sizes are those of VeReMi NextGen, divided by the city's scale of 14 where they are lengths, speeds
or accelerations. An attack marks each frame that is false: a car that reports zero speed at a red
light tells the truth. An attack is a pure function of its inputs and its own generator.
"""

import random
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

from scm import registry
from scm.errors import RunError
from scm.traffic.misbehaviour.ground import Ground
from scm.v2x.etsi.cam_spatem import SCALE, CamBody

ATTACKS = "scm.traffic.misbehaviour.attacks"
MIN_LIE_MPS = 1.0 / SCALE  # a smaller error of speed misleads nobody
NOISE_M = 1.0 / SCALE  # within it a car has not moved
MAX_FRAMES = 200  # of other cars that an attacker remembers


class Frame(NamedTuple):
    """A CAM as a station sends it."""

    station: str
    t_ns: int
    body: CamBody


class Sent(NamedTuple):
    """A CAM that goes out instead; `lies`: whether an observer could be misled by it."""

    frame: Frame
    lies: bool


@dataclass(frozen=True, slots=True)
class Scene:
    """What an attacker knows.

    Attributes:
        ground: The map.
        received: The last CAMs of others, oldest first; whoever runs the attack adds to it.
    """

    ground: Ground
    received: deque[Frame] = field(default_factory=lambda: deque(maxlen=MAX_FRAMES))


Transform = Callable[[Frame], list[Sent]]


@dataclass(frozen=True, slots=True)
class Attack:
    """One attack.

    Attributes:
        about: One line.
        start: Returns the transformation of one attacker's frames; it may have a memory. A frame
            that it returns may be due later than its input.
    """

    about: str
    start: Callable[[random.Random, Scene], Transform]


def attack_names() -> list[str]:
    """Return the names of all attacks."""
    return registry.names(ATTACKS)


def load_attack(name: str) -> Attack:
    """Return an attack.

    Raises:
        RunError: when there is none of that name.
    """
    return registry.load(ATTACKS, name, "ATTACK", Attack, RunError)
