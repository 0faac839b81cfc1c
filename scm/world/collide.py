"""The contact stage: hand every car's motion to the contact solver, and its answer back to the car.

Hosted cars get their change at once, and subscribers get a report at the end of the tick; changes
of a remote car wait for `RemoteCar.contact`. A car that touches nothing is not written to at all.
"""

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.clock import NS_PER_S
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.contact import Contact
from scm.vehicles.fleet import Fleet
from scm.world.contacts import FIRST_BOX, Touches
from scm.world.contacts import WALL as A_WALL
from scm.world.world import World, city_event

WALL = "wall"
NOTABLE_MPS = 0.01
QUIET_NS = NS_PER_S


def collide(world: World, t_ns: int) -> list[CityEvent]:
    """Solve the contacts of the instant `t_ns`; return events of notable hits."""
    indices, motion = everybody(world, t_ns)
    if not len(indices):
        return []
    touches = world.contacts.step(indices, motion)
    if not len(touches.pairs):
        return []
    world.alerts.stuck.feel(t_ns, indices, touches.pairs)
    return _apply(world, indices, touches, t_ns)


def everybody(world: World, t_ns: int) -> tuple[Ints, Floats]:
    """Return slots (n,) and motions (n, 6) of all centres of gravity: hosted cars, then remote."""
    garage, remote = world.garage, list(world.remote.values())
    indices = [garage.indices(name) for name in garage.fleets]
    motion = [garage.motion(name) for name in garage.fleets]
    if remote:
        indices.append(np.array([car.index for car in remote]))
        motion.append(np.array([car.motion(t_ns) for car in remote]))
    if not indices:
        return np.empty(0, np.int64), np.empty((0, 6))
    return np.concatenate(indices), np.concatenate(motion)


def touched_lately(world: World, index: int, now_ns: int) -> tuple[str, ...]:
    """Return what a car touched in the last moment: cars, `wall`, boxes."""
    found: set[str] = set()
    for indices, pairs in world.alerts.stuck.touches(now_ns):
        against = _Against(world, indices, pairs)
        for row in np.flatnonzero(indices == index).tolist():
            found |= against.of(row)
    return tuple(sorted(found - {""}))  # a car that left since has no name


def _apply(world: World, indices: Ints, touches: Touches, t_ns: int) -> list[CityEvent]:
    """Apply the impulses, fleet by fleet, then to remote cars; rows are as in `everybody`."""
    changed: Bools = np.asarray(
        np.hstack((touches.dv, touches.shift, touches.turn[:, None])).any(axis=1)
    )
    begin = 0
    for name, fleet in world.garage.fleets.items():
        rows = world.garage.rows(name)
        struck = np.flatnonzero(changed[begin : begin + len(rows)])
        if len(struck):
            _push(world, fleet, rows[struck], touches, begin + struck)
        begin += len(rows)
    against = _Against(world, indices, touches.pairs)
    for row in np.flatnonzero(changed).tolist():
        world.impulses.touched_ns[against.name(row)] = t_ns
    for row in np.flatnonzero(changed[:begin]).tolist() if world.subscribers.any(Contact) else ():
        world.impulses.reports.add(against.name(row), touches.dv[row], against.of(row))
    for row, car in enumerate(world.remote.values(), start=begin):
        if changed[row]:
            moved = np.array([*touches.shift[row], touches.turn[row]])
            car.hit(touches.dv[row], moved, against.of(row), t_ns)
    notable = np.hypot(touches.dv[:, 0], touches.dv[:, 1]) >= NOTABLE_MPS
    events = (
        _event_of(world, against, row, touches.dv[row], t_ns)
        for row in np.flatnonzero(notable).tolist()
    )
    return [event for event in events if event is not None]


def _push(world: World, fleet: Fleet, rows: Ints, touches: Touches, struck: Ints) -> None:
    """Change the motion of some rows of a fleet: those that stand at `struck` in `touches`."""
    dv, shift, turn = touches.dv[struck], touches.shift[struck], touches.turn[struck, None]
    fleet.push_rows(rows, np.hstack((dv, shift, turn)))
    world.impulses.accelerations.add(fleet, rows, dv)


class _Against:
    """Names what a car touches; only for the few that are reported."""

    def __init__(self, world: World, indices: Ints, pairs: Ints) -> None:
        self._names, self._indices, self._pairs = world.vehicles.names, indices, pairs
        self._boxes = world.contacts.boxes.names

    def name(self, row: int) -> str:
        """Return what stands for a row: a car, `wall`, or a box."""
        if row >= 0:
            return self._names[int(self._indices[row])]
        return WALL if row == A_WALL else f"box {self._boxes[FIRST_BOX - row]}"

    def of(self, row: int) -> set[str]:
        """Return what a row touches."""
        a, b = self._pairs.T
        others = np.concatenate((b[a == row], a[b == row]))
        return {self.name(int(other)) for other in others}


def _event_of(world: World, against: _Against, row: int, dv: Floats, t_ns: int) -> CityEvent | None:
    """Return the event of a notable hit, at most once a second for each car."""
    name = against.name(row)
    if t_ns - world.impulses.event_ns.get(name, -QUIET_NS) < QUIET_NS:
        return None
    world.impulses.event_ns[name] = t_ns
    touched = sorted(against.of(row))
    others = ", ".join(touched)
    world.radio.warnings.hits[name] = tuple(touched)
    text = f"{name} hit {others}: its speed changed by {float(np.hypot(dv[0], dv[1])):.2f} m/s"
    return city_event("warning", "contact", text, t_ns, name)
