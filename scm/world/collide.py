"""The contact stage: hand every car's motion to the contact solver, and its answer back to the car.

Hosted cars get their change at once; what was done to a remote car waits for `RemoteCar.contact`.
A car that touches nothing is not written to at all.
"""

import numpy as np

from scm.arrays import Floats, Ints
from scm.clock import NS_PER_S
from scm.world.contacts import WALL as A_WALL
from scm.world.contacts import Touches
from scm.world.world import World

WALL = "wall"


def collide(world: World, t_ns: int) -> None:
    """Solve the contacts of the instant `t_ns`."""
    slots, motion = everybody(world, t_ns)
    if not len(slots):
        return
    touches = world.contacts.step(slots, motion)
    if len(touches.pairs):
        _tell(world, slots, touches, t_ns)


def everybody(world: World, t_ns: int) -> tuple[Ints, Floats]:
    """Return slots (n,) and motions (n, 6) of all centres of gravity: hosted cars, then remote."""
    garage, remote = world.garage, list(world.remote.values())
    slots = [garage.slots(name) for name in garage.fleets]
    motion = [garage.motion(name) for name in garage.fleets]
    if remote:
        slots.append(np.array([car.slot for car in remote]))
        motion.append(np.array([car.motion(t_ns) for car in remote]))
    if not slots:
        return np.empty(0, np.int64), np.empty((0, 6))
    return np.concatenate(slots), np.concatenate(motion)


def _tell(world: World, slots: Ints, touches: Touches, t_ns: int) -> None:
    rows = np.flatnonzero(touches.touched)
    names = dict(zip(rows.tolist(), names_of(world, slots[rows]), strict=True))
    against = _against(world, touches.pairs, names)
    for row in rows.tolist():
        dv, shift, name = touches.dv[row], touches.shift[row], names[row]
        if not (dv.any() or shift.any()):
            continue
        if name in world.hosted:
            car = world.hosted[name]
            car.fleet.push(car.row, *dv.tolist(), *shift.tolist())
            world.impacts.add(car.fleet, car.row, dv)
        else:
            world.remote[name].hit(dv, shift, against[name], t_ns)
        _report(world, name, against[name], float(np.hypot(dv[0], dv[1])), t_ns)


def names_of(world: World, slots: Ints) -> list[str]:
    """Return the names of the cars of some slots."""
    wanted = set(slots.tolist())
    names = {car.slot: car.name for car in world.cars() if car.slot in wanted}
    return [names[slot] for slot in slots.tolist()]


def _against(world: World, pairs: Ints, names: dict[int, str]) -> dict[str, set[str]]:
    """Return whom or what each car touches, by name."""
    boxes = world.contacts.boxes.names
    found: dict[str, set[str]] = {name: set() for name in names.values()}
    for a, b in pairs.tolist():
        for one, other in ((a, b), (b, a)):
            if one < 0:
                continue
            if other >= 0:
                thing = names[other]
            else:
                thing = WALL if other == A_WALL else f"box {boxes[-2 - other]}"
            found[names[one]].add(thing)
    return found


NOTABLE_MPS = 0.01
QUIET_NS = NS_PER_S


def _report(world: World, name: str, against: set[str], change: float, t_ns: int) -> None:
    """Tell a person of a hit worth telling, once a second and car at most."""
    if change < NOTABLE_MPS or t_ns - world.last_hit_ns.get(name, -QUIET_NS) < QUIET_NS:
        return
    world.last_hit_ns[name] = t_ns
    others = ", ".join(sorted(against))
    text = f"{name} hit {others}: its speed changed by {change:.2f} m/s"
    world.say("warning", "contact", text, t_ns, name)
