"""What happens to the cars of one city while they drive: drawn, sealed, and as numbers at a time.

Things change one after another: a car, its tag, the floor at a place, a camera, or everything; at
once, evenly, or for a while. Times are seconds since the city's begin.
"""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tests.reality.cases import (
    STEADY,
    apply,
    described,
    draw_effects,
    ordinary_of,
    possible,
    write_label,
)
from tests.reality.changing import share_of
from tests.reality.concealed import LISTED, Drawn
from tests.reality.motion import Moving
from tests.reality.numbers import nominal, scattered
from tests.reality.sensing import FAULTS

OWN, ALL = ("car", "tag"), ""
EFFECTS_OF = {
    "tag": ("pose_point",),
    "place": ("surface_patch",),
    "camera": ("pose_scale",),
    "everywhere": ("rolling_resistance", "grade"),
}
"""Of each kind the effects that may set in; those of one car: `of_cars`."""
OF_CARS = {"drive", "steering", "tyre", "body"}
SENSED = ("gyro_bias", "gyro_scale", "encoder_loss", "wheel_radius")
NOT_OF_A_CAR = {"grade", "wind", "surface_patch"}
SHARES = {"car": 0.45, "tag": 0.1, "place": 0.15, "camera": 0.15, "everywhere": 0.15}
TWO, STEP = 0.25, 0.6  # shares of two at once; of changes that come at once and stay
FIRST_S, NEXT_S, BEFORE_END_S = (400.0, 700.0), (600.0, 1200.0), 300.0
RAMP_S, STAYS_S = (60.0, 240.0), (200.0, 400.0)
RADIUS_M = (0.2, 0.4)


@dataclass(frozen=True)
class Event:
    """One thing that changes.

    Attributes:
        of: The car or camera; empty: all cars.
        effects: Name, strength, and what it does.
        until: When it is all there [s]; at `back` it is as before.
    """

    kind: str
    of: str
    course: str
    effects: tuple[tuple[str, float, Drawn], ...]
    since: float
    until: float
    back: float = math.inf

    def share(self, t):
        """Return how far it is at a time, 0 to 1."""
        return float(share_of(t, self.since, self.until, self.back))


def of_cars(car: str, moving: type = Moving) -> tuple[str, ...]:
    """Return the names of effects that may set in in one car of a city."""
    names = {one.name for one in LISTED if one.equation in OF_CARS} | set(SENSED)
    can = possible(LISTED, car, moving)
    return tuple(name for name in can if name in names - STEADY - NOT_OF_A_CAR)


class Scene:
    """Cars of one city, and what happens to them.

    Args:
        usual: Ordinary numbers of each car, by name.
        events: In any order.
    """

    def __init__(self, usual: dict[str, dict[str, float]], events=()):
        self.usual, self.events = usual, tuple(events)
        self._found = {}

    def numbers(self, car, t, x=0.0, y=0.0):
        """Return a car's numbers at a time and place; the same object while they are the same."""
        spilled = [pair for pair in self._of(car, t, ("place",)) if pair[1] > 0.0]
        nearest = sorted(spilled, key=lambda pair: _beyond(pair[0], x, y))[:1]
        changes = [*self._of(car, t, ("car", "everywhere")), *nearest]
        return self._blended(("moves", car), self.usual[car], changes)

    def faults(self, car, t):
        """Return what is wrong with a car's sensors and its tag."""
        return self._blended(("senses", car), FAULTS, self._of(car, t, OWN))

    def camera_faults(self, camera, t):
        """Return what is wrong with a camera."""
        return self._blended(("sees", camera), FAULTS, self._of(camera, t, ("camera",)))

    def _of(self, name, t, kinds):
        return [(one, one.share(t)) for one in self.events
                if one.kind in kinds and one.of in (ALL, name)]  # fmt: skip

    def _blended(self, place, values, changes):
        """Return values as changes have made them; each acts on what those before it have made."""
        key = tuple((id(one), share) for one, share in changes if share > 0.0)
        before, found = self._found.get(place, (None, None))
        if key != before:
            found = values
            for one, share in changes:
                if share > 0.0:
                    then = apply(found, one.effects)
                    found = {n: v + share * (then[n] - v) for n, v in found.items()}
            self._found[place] = key, found
        return found


def _beyond(event: Event, x: float, y: float) -> float:
    """Return how far a point is from the edge of what was spilled."""
    patch = event.effects[0][2].parameters
    return math.hypot(x - patch["x_m"], y - patch["y_m"]) - patch["radius_m"]


def draw_scene(
    cars: tuple[str, ...], seconds: float, rng: np.random.Generator, *, car: str,
    cameras: tuple[str, ...], places: list[tuple[float, float]],
    strengths: tuple[float, float] = (2.0, 3.0), moving: type = Moving, healthy: bool = False,
) -> Scene:  # fmt: skip
    """Draw ordinary cars, and what happens to them.

    Args:
        cars: Their names.
        car: Their file.
        cameras: Names of those that see them.
        places: Where something may be spilled [m].
        strengths: In multiples of the smallest size that 90 s of driving can show.
        healthy: Nothing happens.
    """
    usual = {name: scattered(nominal(car), rng) for name in cars}
    events, since = [], float(rng.uniform(*FIRST_S))
    while since < seconds - BEFORE_END_S and not healthy:
        kinds = draw_kinds(rng)
        course, until, back = _draw_course(since, rng, at_once="place" in kinds)
        for kind in kinds:
            effects = draw_of(kind, car, strengths, rng, moving, places)
            names = cars if kind in OWN else cameras if kind == "camera" else (ALL,)
            events.append(Event(kind, str(rng.choice(names)), course, effects, since, until, back))
        since = (until if back == math.inf else back) + float(rng.uniform(*NEXT_S))
    return Scene(usual, events)


def draw_kinds(rng: np.random.Generator) -> list[str]:
    """Draw what changes: one thing, or two different ones at once."""
    count = 2 if rng.random() < TWO else 1
    kinds = rng.choice(list(SHARES), count, replace=False, p=list(SHARES.values()))
    return [str(kind) for kind in kinds]


def _draw_course(since: float, rng: np.random.Generator, *, at_once: bool):
    """Draw how a change goes on; return this, when it is all there, and when it is over."""
    course = "step" if rng.random() < STEP else str(rng.choice(("ramp", "intermittent")))
    if course == "ramp" and not at_once:
        return course, since + float(rng.uniform(*RAMP_S)), math.inf
    if course == "intermittent":
        return course, since, since + float(rng.uniform(*STAYS_S))
    return "step", since, math.inf


def draw_of(kind, car, strengths, rng, moving=Moving, places=()):
    """Draw what a change of a kind does."""
    names = of_cars(car, moving) if kind == "car" else EFFECTS_OF[kind]
    drawn = draw_effects((str(rng.choice(names)),), car, strengths, rng)
    if kind == "place":
        return tuple((name, size, _spilled(one, places, rng)) for name, size, one in drawn)
    return tuple(drawn)


def _spilled(drawn: Drawn, places, rng) -> Drawn:
    """Return a patch where cars drive."""
    x, y = map(float, places[rng.integers(len(places))])
    radius = float(rng.uniform(*RADIUS_M))
    adds = drawn.adds | {"patch_x": x, "patch_y": y, "patch_radius": radius - 0.01}
    known = drawn.parameters | {"x_m": x, "y_m": y, "radius_m": radius}
    return replace(drawn, parameters=known, adds=adds)


def label_of(scene: Scene, car: str) -> dict:
    """Return what a sealed label says of a scene."""
    return {
        "ordinary": {one: ordinary_of(n, nominal(car)) for one, n in scene.usual.items()},
        "changes": [
            described(list(one.effects), car) | {
                "whose": one.kind, "of": one.of, "course": one.course, "begins_s": one.since,
                "complete_s": one.until, "ends_s": None if one.back == math.inf else one.back,
            }
            for one in scene.events
        ],
    }  # fmt: skip


def seal_scene(out: Path, name: str, scene: Scene, car: str, rng: np.random.Generator) -> None:
    """Write a scene's label, and its hash to those of the others."""
    out.mkdir(parents=True, exist_ok=True)
    line = f"{write_label(out, name, label_of(scene, car), rng)}  {name}\n"
    with (out / "sealed.txt").open("a", encoding="utf-8") as file:
        file.write(line)
