"""What a car believes of the signals: green only on fresh, undisputed and matching evidence."""

from dataclasses import dataclass

from scm.clock import NS_PER_S, seconds
from scm.maps.model import CityMap
from scm.v2x.etsi import SpatemBody
from scm.v2x.etsi_convert import REVISIONS, Told, colours_of
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.spat import Colour

FRESH_NS = NS_PER_S
RESOLUTION_S = 0.1


@dataclass(frozen=True, slots=True)
class _Heard:
    """The newest SPATEM of one junction; times in seconds after its arrival."""

    arrived_ns: int
    flashing: bool
    colours: dict[int, Told]


class SignalView:
    """The signals as one car knows them, by the names its map uses."""

    def __init__(self, city_map: CityMap) -> None:
        self._revision = city_map.revision % REVISIONS
        self._names = {junction.number: junction.name for junction in city_map.junctions}
        self._numbers = {
            (junction.name, group.name): group.number
            for junction in city_map.junctions
            for group in junction.groups
        }
        self._heard: dict[str, _Heard] = {}
        self._faults: dict[str, str] = {}
        self.ignored = 0

    def hear_spatem(self, body: SpatemBody, arrived_ns: int) -> None:
        """Take a SPATEM that arrived at `arrived_ns`; one of another map is ignored and counted."""
        name = self._names.get(body.intersection)
        if name is None or body.revision != self._revision:
            self.ignored += 1
            return
        self._heard[name] = _Heard(arrived_ns, "failureFlash" in body.status, colours_of(body))

    def hear_monitor(self, status: MonitorStatus) -> None:
        """Take the monitor's verdict on a junction; a fault stands until the monitor lifts it."""
        if status.fault is None:
            self._faults.pop(status.junction, None)
        else:
            self._faults[status.junction] = status.fault

    def colour(self, junction: str, group: str, now_ns: int) -> Colour | None:
        """Return the colour to act on, or None when nothing is to be believed.

        A green whose promised earliest end has passed counts as yellow until the next SPATEM says
        that it goes on: a car that can stop then does.
        """
        heard = self._heard.get(junction)
        if heard is None or abs(now_ns - heard.arrived_ns) > FRESH_NS:
            return None
        if heard.flashing or junction in self._faults:
            return "flashing_red"
        number = self._numbers.get((junction, group))
        if number is None or number not in heard.colours:
            return None
        told = heard.colours[number]
        age_s = seconds(now_ns - heard.arrived_ns)
        lapsed = told.min_end_s is not None and age_s > told.min_end_s + RESOLUTION_S
        return "yellow" if told.colour == "green" and lapsed else told.colour

    def may_go(self, junction: str, group: str, now_ns: int) -> bool:
        """Return whether a car may pass the group's stop line now."""
        return self.colour(junction, group, now_ns) == "green"

    def time_to_change(self, junction: str, group: str, now_ns: int) -> float | None:
        """Return for how long the colour will last at least [s]; None when that is not known."""
        if self.colour(junction, group, now_ns) in (None, "flashing_red"):
            return None
        heard = self._heard[junction]
        min_end_s = heard.colours[self._numbers[junction, group]].min_end_s
        if min_end_s is None:
            return None
        return max(0.0, min_end_s - seconds(now_ns - heard.arrived_ns))
