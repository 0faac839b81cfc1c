"""The contract of an attack: honest CAMs of one station go in, what it sends instead comes out.

Sizes are those of VeReMi NextGen, divided by the city's scale of 14 where they are lengths, speeds
or accelerations. An attack tells of each frame whether it lies: a car that reports zero speed at a
red light tells the truth. An attack is a pure function of what it is given and its own generator.
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
SLOW_MPS = 1.0 / SCALE
STEP_M = 1.0 / SCALE
MAX_FRAMES = 200


class Frame(NamedTuple):
    """A CAM as a station sends it."""

    station: str
    t_ns: int
    body: CamBody


class Sent(NamedTuple):
    """A CAM that goes out instead; `lies` tells whether an observer could be misled by it."""

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
        start: Returns the transformation of one attacker's frames; it may remember. A frame that it
            returns may be due later than the one it was given.
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
