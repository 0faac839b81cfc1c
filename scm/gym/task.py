"""What a task is: where its cars begin, what they see and do, what they gain, when it ends."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from scm.arrays import Bools, Floats

if TYPE_CHECKING:
    from scm.gym.worlds import Worlds

Reward = Callable[["Worlds"], Floats]
End = Callable[["Worlds"], Bools]


@dataclass(frozen=True, slots=True)
class Start:
    """Where an agent's car begins on lanes: anywhere along them, drawn for each episode.

    Attributes:
        beside_m: At most so far from the middle of its lane.
        turned_rad: At most so far from its lane's direction.
        speed_mps: The slowest and the fastest.
        is_abreast: Whether cars may begin beside each other: the lanes do not cross.
        gap_m: The cars of a world begin one behind the other, rear axles so far apart at least and
            at most, and branch alike; None: spread evenly.
        behind: How many of them begin behind the first agent's.
    """

    beside_m: float = 0.0
    turned_rad: float = 0.0
    speed_mps: tuple[float, float] = (0.0, 0.0)
    is_abreast: bool = False
    gap_m: tuple[float, float] | None = None
    behind: int = 0


@dataclass(frozen=True, slots=True)
class Traffic:
    """Cars of a world that are driven by rules; they are no agents.

    Attributes:
        cars: How many.
        speed_mps: The slowest and the fastest that one drives at on a free road, drawn for each.
    """

    cars: int
    speed_mps: tuple[float, float]


@dataclass(frozen=True, slots=True)
class PlaceStart:
    """Where an agent's car begins on a map without lanes: near a place of it, with a goal.

    Both are drawn for each episode.

    Attributes:
        places: By map, names of places to begin at; a map that is not there: its spawns.
        goals: By map, names of places to drive to; a map that is not there: its bays.
        is_paired: Whether who begins at a place drives to the goal of the same number.
        aside_m: At most so far from the place, along x and along y.
        turned_rad: At most so far from its direction.
        speed_mps: The slowest and the fastest.
    """

    places: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    goals: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    is_paired: bool = False
    aside_m: float = 0.0
    turned_rad: float = 0.0
    speed_mps: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Term:
    """One summand of the reward.

    Attributes:
        function: Returns it for each car, in its unit.
        weight: Per unit.
    """

    function: Reward
    weight: float


@dataclass(frozen=True, slots=True)
class Task:
    """A task.

    Attributes:
        name: Without map and version.
        about: One sentence.
        maps: It is offered on.
        observations: By name, see `observations`.
        rewards: Its summands.
        ends: When a car's episode ends; it also does after `lasts_s`.
        agents: Cars of a world; or its map's junctions, with `of_junctions`.
        of_junctions: Whether they are junctions: they choose what is green, and rules drive all
            cars.
        traffic: Further cars of a world; None: none.
        lanes: By map, lanes to begin on; a map that is not there: any.
        choices: Throttle and steering, -1 to 1, of each action; none: they are chosen freely.
        car: The car file.
        period_s: Between two actions.
    """

    name: str
    about: str
    maps: tuple[str, ...]
    observations: tuple[str, ...]
    rewards: tuple[Term, ...]
    ends: tuple[End, ...]
    start: Start | PlaceStart
    lasts_s: float
    agents: int = 1
    of_junctions: bool = False
    traffic: Traffic | None = None
    lanes: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    choices: tuple[tuple[float, float], ...] = ()
    car: str = "nigel"
    period_s: float = 0.05
    version: int = 1

    @property
    def most_steps(self) -> int:
        """Of an episode."""
        return round(self.lasts_s / self.period_s)
