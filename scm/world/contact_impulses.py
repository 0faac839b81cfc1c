"""What contact impulses of a tick do to hosted cars: accelerometer readings and contact reports.

A hit is an impulse of no duration; a device that reads once a tick measures it as that tick's mean
acceleration.
"""

from dataclasses import dataclass, field

import numpy as np

from scm.arrays import Floats, Ints
from scm.v2x.messages.contact import Contact
from scm.vehicles.fleet import Fleet


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
    """Adds up the tick's contacts in the fleets' `contact_accel_x` and its siblings."""

    def __init__(self) -> None:
        self._struck: list[tuple[Fleet, Ints]] = []
        self._share = 0.0

    def begin(self, duration: float) -> None:
        """Forget the last tick's; the new tick lasts `duration` [s]."""
        for fleet, rows in self._struck:
            fleet.contact_accel_x[rows] = fleet.contact_accel_y[rows] = fleet.contact_yaw_accel[
                rows
            ] = 0.0
        self._struck.clear()
        self._share = 1.0 / duration if duration > 0.0 else 0.0

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
    """

    accelerations: ImpulseAccelerations = field(default_factory=ImpulseAccelerations)
    reports: ContactReports = field(default_factory=ContactReports)
    event_ns: dict[str, int] = field(default_factory=dict)
    touched_ns: dict[str, int] = field(default_factory=dict)
