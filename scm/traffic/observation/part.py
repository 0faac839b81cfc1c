"""The observer part: counts traffic and finds violations, from cameras, cars' reports and signals.

World truth is not an input: the Eye's tracks come first, a car's own report where no camera sees
it. Counts are published every five seconds, each violation once and also as a city event.
"""

from collections.abc import Sequence

from scm.clock import NS_PER_MS, NS_PER_S
from scm.maps.route import roads_of
from scm.records.city_map import CityMap
from scm.runtime.part import BasePart, Subscription
from scm.traffic.observation.car_estimates import CarEstimates
from scm.traffic.observation.counters import Counters
from scm.traffic.observation.lane_tracking import Follower, rules_of
from scm.traffic.observation.violations import Judge
from scm.v2x.exchange import Incoming, Outgoing
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.contact import Contact
from scm.v2x.messages.eye_track import EyeTrack
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.violation import Violation

PERIOD_NS = 100 * NS_PER_MS
COUNTS_EVERY_NS = 5 * NS_PER_S


class ObserverPart(BasePart):
    """Observes the traffic of a map; see `scm.runtime.part.Part`."""

    def __init__(self, city_map: CityMap) -> None:
        self.name = "observer"
        self.role = "part"
        self.period_ns = PERIOD_NS
        self.subscriptions = (
            Subscription(EyeTrack),
            Subscription(VehicleState),
            Subscription(Spat),
            Subscription(Contact),
        )
        roads = roads_of(city_map)
        lines = rules_of(roads)
        self._estimates = CarEstimates()
        self._follower = Follower(roads)
        self._spats: dict[str, Spat] = {}
        self._seen: set[str] = set()
        self._judge = Judge(roads, lines)
        self._next_ns = 0
        self.counters = Counters(roads, lines)

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Process arrivals, check every car, return what is due."""
        violations = []
        for item in inbox:
            message = item.message
            if isinstance(message, EyeTrack | VehicleState):
                self._estimates.add(message, item.t_ns)
            elif isinstance(message, Spat):
                self._spats[message.junction] = message
                self._judge.signals.receive(message)
            elif isinstance(message, Contact):
                violations += self._judge.hit(message)
        violations += self._look(now_ns)
        self.counters.sample(now_ns, self._spats)
        outbox: list[Outgoing] = []
        for violation in violations:
            outbox += [violation, _event(violation)]
        if now_ns >= self._next_ns:
            self._next_ns = now_ns + COUNTS_EVERY_NS
            outbox.append(self.counters.counts(now_ns))
        return outbox

    def finish(self, now_ns: int) -> list[Outgoing]:
        """Publish the last counts."""
        return [self.counters.counts(now_ns)]

    def _look(self, now_ns: int) -> list[Violation]:
        found, seen = [], set()
        for estimate in self._estimates.now(now_ns):
            seen.add(estimate.vehicle)
            followed = self._follower.see(estimate)
            self.counters.see(estimate, followed)
            found += self._judge.see(estimate, followed)
        for vehicle in self._seen - seen:
            for table in (self._follower, self.counters, self._judge):
                table.forget(vehicle)
        self._seen = seen
        return found


def _event(violation: Violation) -> CityEvent:
    return CityEvent(
        severity="warning",
        source="observer",
        t_ns=violation.t_ns,
        name=f"violation_{violation.kind}",
        text=violation.text,
        vehicle=violation.vehicle,
    )
