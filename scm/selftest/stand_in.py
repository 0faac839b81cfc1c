"""A controller in the real one's place, whose output can be corrupted as broken wires would.

It is the real traffic part: it accepts requests, follows the monitor and flashes. Only the output
of its plans is corrupted; flash is shown as it is, as the relays of a cabinet bypass broken parts.
"""

import threading
from collections.abc import Sequence

from scm.clock import WallClock
from scm.records.city_map import CityMap
from scm.runtime.live import run
from scm.runtime.part import BasePart, Subscription
from scm.selftest.signal_fault import OutputFault
from scm.traffic.signals.part import TrafficPart
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.credentials import Credentials
from scm.v2x.etsi.convert import roadside_station, spatem_of
from scm.v2x.exchange import Incoming, Outgoing
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.spatem import SpatemTx


class FaultyTraffic(BasePart):
    """A traffic part whose output is wrong at one junction; see `scm.runtime.part.Part`.

    Attributes:
        output_fault: Turns the intended phases into those shown; None: no fault.
        first_fault_ns: When a wrong output was shown first; None: not yet.
    """

    def __init__(self, city_map: CityMap, junction: str) -> None:
        self._part = TrafficPart(city_map)
        self.name, self.role = self._part.name, self._part.role
        self.period_ns = self._part.period_ns
        self.services = self._part.services
        self._junction = next(j for j in city_map.junctions if j.name == junction)
        self.output_fault: OutputFault | None = None
        self.first_fault_ns: int | None = None

    @property
    def subscriptions(self) -> Sequence[Subscription]:
        """What the real part hears."""
        return self._part.subscriptions

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Step the real part and corrupt its output."""
        outbox = self._part.step(now_ns, inbox)
        output_fault, own = self.output_fault, self._junction.name
        intended = next(s for s in outbox if isinstance(s, Spat) and s.junction == own)
        shown = (
            intended if output_fault is None or intended.mode == "flash" else output_fault(intended)
        )
        if shown == intended:
            return outbox
        if self.first_fault_ns is None:
            self.first_fault_ns = now_ns
        return self._with(outbox, shown)

    def _with(self, outbox: list[Outgoing], shown: Spat | None) -> list[Outgoing]:
        """Return the outbox with the shown phases in place of the intended."""
        station = roadside_station(self._junction.name)
        changed: list[Outgoing] = []
        for item in outbox:
            if isinstance(item, Spat) and item.junction == self._junction.name:
                changed += [] if shown is None else [shown]
            elif isinstance(item, SpatemTx) and item.station == station:
                if shown is not None:
                    body = spatem_of(shown, self._junction)
                    changed.append(SpatemTx(station=station, t_ns=item.t_ns, body=body))
            else:
                changed.append(item)
        return changed

    def finish(self, now_ns: int) -> list[Outgoing]:
        """Stop."""
        return self._part.finish(now_ns)


class StandIn:
    """Runs a faulty traffic part on the bus in a thread; a context manager."""

    def __init__(
        self,
        city_map: CityMap,
        junction: str,
        endpoint: str,
        city: str,
        credentials: Credentials | None = None,
    ) -> None:
        self.part = FaultyTraffic(city_map, junction)
        self._bus = ZenohBus(city, self.part.name, endpoint, credentials=credentials)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="stand-in")

    def _run(self) -> None:
        run(self.part, self._bus, WallClock(), self._stop)

    def __enter__(self) -> "StandIn":
        self._thread.start()
        return self

    def __exit__(self, *exc: object) -> None:
        self._stop.set()
        self._thread.join()
