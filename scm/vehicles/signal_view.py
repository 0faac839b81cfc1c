"""What a car believes of the signals: green only on fresh, undisputed and matching evidence."""

import math

from scm.records.city_map import CityMap
from scm.v2x.etsi.cam_spatem import SpatemBody
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.spat import Colour
from scm.vehicles.drivers.signal_table import COLOURS, SignalTable, believed
from scm.vehicles.jit import plain

_believed = plain(believed)


class SignalView:
    """The signals as one car knows them, by the names its map uses.

    Attributes:
        table: What drivers look at.
    """

    def __init__(self, city_map: CityMap) -> None:
        self.table = SignalTable(city_map)
        self._junctions = {junction.name: n for n, junction in enumerate(city_map.junctions)}
        names = ((j.name, group.name) for j in city_map.junctions for group in j.groups)
        self._groups = {name: number for number, name in enumerate(names)}

    @property
    def ignored(self) -> int:
        """How many frames were of another map, or of another revision of it."""
        return self.table.ignored

    def hear_spatem(self, body: SpatemBody, arrived_ns: int) -> None:
        """Take a SPATEM that arrived at `arrived_ns`; one of another map is ignored and counted."""
        self.table.hear_spatem(body, arrived_ns)

    def hear_monitor(self, status: MonitorStatus) -> None:
        """Take the monitor's verdict on a junction; a fault stands until the monitor lifts it."""
        self.table.hear_monitor(status)

    def colour(self, junction: str, group: str, now_ns: int) -> Colour | None:
        """Return the colour to act on, or None when nothing is to be believed.

        A green whose promised earliest end has passed counts as yellow until the next SPATEM says
        that it goes on: a car that can stop then does.
        """
        number = self._groups.get((junction, group))
        if number is None:
            return None
        at, told = self._junctions[junction], self.table.told
        place = int(told.newest[at]) if told.number[told.newest[at], at] >= 0 else -1
        colour: Colour | None = COLOURS[_believed(told, number, at, place, now_ns)]
        return colour

    def may_go(self, junction: str, group: str, now_ns: int) -> bool:
        """Return whether a car may pass the group's stop line now."""
        return self.colour(junction, group, now_ns) == "green"

    def time_to_change(self, junction: str, group: str, now_ns: int) -> float | None:
        """Return for how long the colour will last at least [s]; None when that is not known."""
        if self.colour(junction, group, now_ns) in (None, "flashing_red"):
            return None
        at, told = self._junctions[junction], self.table.told
        place = told.newest[at]
        min_end = float(told.min_end[place, self._groups[junction, group]])
        if math.isnan(min_end):
            return None
        return max(0.0, min_end - 1e-9 * int(now_ns - told.arrived_ns[place, at]))
