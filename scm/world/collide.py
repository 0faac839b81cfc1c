"""The contact stage: hand every car's motion to the contact solver, and its answer back to the car.

Hosted cars get their change at once, and subscribers get a report at the end of the tick; changes
of a remote car wait for `RemoteCar.contact`. A car that touches nothing is not written to at all.
"""

from dataclasses import dataclass, field

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.clock import NS_PER_S
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.contact import Contact
from scm.vehicles.fleet import Fleet
from scm.world.alerts import city_event
from scm.world.cars import Cars
from scm.world.contact_groups import WALL as A_WALL
from scm.world.contacts import FIRST_BOX, Contacts, Touches
from scm.world.stuck import Stuck

WALL = "wall"
MIN_HIT_MPS = 0.01  # a smaller change of speed is no event
MIN_EVENT_GAP_NS = NS_PER_S  # between two events of one car


class ContactReports:
    """Adds up each car's changes of motion until they are published."""

    def __init__(self) -> None:
        self._felt: dict[str, tuple[Floats, set[str]]] = {}

    def add(self, vehicle: str, dv: Floats, against: set[str]) -> None:
        """Add a change of velocity x, y and yaw rate (3,), map frame, and what was touched."""
        before, touched = self._felt.get(vehicle, (np.zeros(3), set[str]()))
        self._felt[vehicle] = (before + dv, touched | against)

    def pop(self, now_ns: int) -> list[Contact]:
        """Return and forget the contacts since the last call, car by car."""
        reports = [
            Contact(
                vehicle=vehicle,
                t_ns=now_ns,
                dvx_mps=float(dv[0]),
                dvy_mps=float(dv[1]),
                dyaw_rate_radps=float(dv[2]),
                against=tuple(sorted(against)),
            )
            for vehicle, (dv, against) in self._felt.items()
        ]
        self._felt.clear()
        return reports


class ImpulseAccelerations:
    """Adds up the tick's contacts in the fleets' `contact_accel_x` and its siblings.

    A hit is an impulse of no duration; a device that reads once a tick measures it as that tick's
    mean acceleration.
    """

    def __init__(self) -> None:
        self._struck: list[tuple[Fleet, Ints]] = []
        self._share = 0.0

    def begin(self, duration: float) -> None:
        """Forget the last tick's; the new tick lasts `duration` [s]."""
        for fleet, rows in self._struck:
            for values in (fleet.contact_accel_x, fleet.contact_accel_y, fleet.contact_yaw_accel):
                values[rows] = 0.0
        self._struck.clear()
        self._share = 1.0 / duration if duration > 0.0 else 0.0

    def carry(self, fleet: Fleet, row: int) -> None:
        """Forget at the next tick what a car brought from another process."""
        self._struck.append((fleet, np.array([row])))

    def add(self, fleet: Fleet, rows: Ints, dv: Floats) -> None:
        """Add changes of velocity x, y and yaw rate (k, 3), map frame, of different rows."""
        yaw = fleet.yaw[rows]
        c, s = np.cos(yaw), np.sin(yaw)
        x, y, turn = self._share * dv.T
        fleet.contact_accel_x[rows] += c * x + s * y
        fleet.contact_accel_y[rows] += c * y - s * x
        fleet.contact_yaw_accel[rows] += turn
        self._struck.append((fleet, rows))


@dataclass(slots=True)
class ContactImpulses:
    """What contacts did in this tick, and when each car's last one was.

    Attributes:
        accelerations: What contacts add to the cars' accelerations.
        reports: What contacts did to hosted cars, for subscribers.
        event_ns: By car, when its last contact event was published.
        touched_ns: By car, when a contact last changed its motion.
        hits: By car, what it has hit since its last warning of it could be sent.
    """

    accelerations: ImpulseAccelerations = field(default_factory=ImpulseAccelerations)
    reports: ContactReports = field(default_factory=ContactReports)
    event_ns: dict[str, int] = field(default_factory=dict)
    touched_ns: dict[str, int] = field(default_factory=dict)
    hits: dict[str, tuple[str, ...]] = field(default_factory=dict)


def collide(
    cars: Cars, contacts: Contacts, impulses: ContactImpulses, stuck: Stuck, t_ns: int,
    *, is_subscribed: bool,
) -> list[CityEvent]:  # fmt: skip
    """Solve the contacts of the instant `t_ns`; return events of notable hits.

    Args:
        cars: All cars; their motion changes.
        contacts: The solver.
        impulses: Collects what contacts did.
        stuck: Is notified of who touched whom.
        t_ns: The instant.
        is_subscribed: Whether anybody subscribes to `Contact`.
    """
    indices, motion = everybody(cars, t_ns)
    touches = contacts.step(indices, motion)
    if not len(touches.pairs):
        return []
    stuck.feel(t_ns, indices, touches.pairs)
    against = _Against(cars, contacts, indices, touches.pairs)
    _apply(cars, impulses, touches, against, t_ns, is_subscribed=is_subscribed)
    notable = np.hypot(touches.dv[:, 0], touches.dv[:, 1]) >= MIN_HIT_MPS
    events = (
        _event_of(impulses, against, row, touches.dv[row], t_ns)
        for row in np.flatnonzero(notable).tolist()
    )
    return [event for event in events if event is not None]


def everybody(cars: Cars, t_ns: int) -> tuple[Ints, Floats]:
    """Return indices (n,) and motions (n, 6) of all centres of gravity: hosted, then remote."""
    garage, remote = cars.garage, list(cars.remote.values())
    indices = [garage.indices(name) for name in garage.fleets]
    motion = [garage.motion(name) for name in garage.fleets]
    if remote:
        indices.append(np.array([car.index for car in remote]))
        motion.append(np.array([car.motion(t_ns) for car in remote]))
    if not indices:
        return np.empty(0, np.int64), np.empty((0, 6))
    return np.concatenate(indices), np.concatenate(motion)


def touched_lately(
    cars: Cars, contacts: Contacts, stuck: Stuck, index: int, now_ns: int
) -> tuple[str, ...]:
    """Return what a car touched in the last moment: cars, `wall`, boxes."""
    found: set[str] = set()
    for indices, pairs in stuck.touches(now_ns):
        against = _Against(cars, contacts, indices, pairs)
        for row in np.flatnonzero(indices == index).tolist():
            found |= against.of(row)
    return tuple(sorted(found - {""}))  # a car that left since has no name


def _apply(
    cars: Cars, impulses: ContactImpulses, touches: Touches, against: "_Against", t_ns: int,
    *, is_subscribed: bool,
) -> None:  # fmt: skip
    """Apply the impulses, fleet by fleet, then to remote cars; rows are as in `everybody`."""
    changed: Bools = np.asarray(
        np.hstack((touches.dv, touches.shift, touches.turn[:, None])).any(axis=1)
    )
    begin = 0
    for name, fleet in cars.garage.fleets.items():
        rows = cars.garage.rows(name)
        struck = begin + np.flatnonzero(changed[begin : begin + len(rows)])
        if len(struck):
            dv, shift = touches.dv[struck], touches.shift[struck]
            fleet.push_rows(
                rows[struck - begin], np.hstack((dv, shift, touches.turn[struck, None]))
            )
            impulses.accelerations.add(fleet, rows[struck - begin], dv)
        begin += len(rows)
    for row in np.flatnonzero(changed).tolist():
        impulses.touched_ns[against.name(row)] = t_ns
    for row in np.flatnonzero(changed[:begin]).tolist() if is_subscribed else ():
        impulses.reports.add(against.name(row), touches.dv[row], against.of(row))
    for row, car in enumerate(cars.remote.values(), start=begin):
        if changed[row]:
            moved = np.array([*touches.shift[row], touches.turn[row]])
            car.hit(touches.dv[row], moved, against.of(row), t_ns)


class _Against:
    """Names what a car touches; only for the few that are reported."""

    def __init__(self, cars: Cars, contacts: Contacts, indices: Ints, pairs: Ints) -> None:
        self._names, self._indices, self._pairs = cars.arrays.names, indices, pairs
        self._boxes = contacts.boxes.names

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


def _event_of(
    impulses: ContactImpulses, against: _Against, row: int, dv: Floats, t_ns: int
) -> CityEvent | None:
    """Return the event of a notable hit, at most one a second for each car."""
    name = against.name(row)
    if t_ns - impulses.event_ns.get(name, -MIN_EVENT_GAP_NS) < MIN_EVENT_GAP_NS:
        return None
    impulses.event_ns[name] = t_ns
    touched = sorted(against.of(row))
    impulses.hits[name] = tuple(touched)
    text = f"{name} hit {', '.join(touched)}: its speed changed by {np.hypot(dv[0], dv[1]):.2f} m/s"
    return city_event("warning", "contact", text, t_ns, name)
