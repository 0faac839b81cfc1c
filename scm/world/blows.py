"""What contacts did to hosted cars in a tick: for those who watch, the cars themselves felt it."""

import numpy as np

from scm.arrays import Floats
from scm.v2x.messages.contact import Contact


class Blows:
    """Adds up each car's changes of motion until they are told."""

    def __init__(self) -> None:
        self._felt: dict[str, tuple[Floats, set[str]]] = {}

    def add(self, vehicle: str, dv: Floats, against: set[str]) -> None:
        """Note a change of velocity x, y and yaw rate (3,), map frame, and what was touched."""
        before, touched = self._felt.get(vehicle, (np.zeros(3), set[str]()))
        self._felt[vehicle] = (before + dv, touched | against)

    def take(self, now_ns: int) -> list[Contact]:
        """Return what was done since this was last asked, car by car."""
        told = [
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
        return told
