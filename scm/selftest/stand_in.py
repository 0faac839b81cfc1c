"""A controller in the real one's place, whose output can be bent as broken wires would bend it.

It is the real traffic part: it takes wishes, hears the monitor and flashes. Only what it shows in
its plans is bent; flash is shown as it is, as the relays of a cabinet pass the broken parts by.
"""

import threading
from collections.abc import Sequence

from scm.clock import WallClock
from scm.records.city_map import CityMap
from scm.runtime.live import run
from scm.runtime.part import Hears
from scm.selftest.signal_fault import Bend
from scm.traffic.part import TrafficPart
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.credentials import Credentials
from scm.v2x.etsi.convert import roadside_station, spatem_of
from scm.v2x.exchange import Incoming, Outgoing
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.spatem_tx import SpatemTx


class BentTraffic:
    """A traffic part whose output is bent at one junction; see `scm.runtime.part.Part`.

    Attributes:
        bend: What turns the meant into the shown; None: nothing is bent.
        bent_ns: When something wrong was shown first; None: not yet.
    """

    def __init__(self, city_map: CityMap, junction: str) -> None:
        self._part = TrafficPart(city_map)
        self.name, self.role = self._part.name, self._part.role
        self.period_ns = self._part.period_ns
        self.serves = self._part.serves
        self._junction = next(j for j in city_map.junctions if j.name == junction)
        self.bend: Bend | None = None
        self.bent_ns: int | None = None

    @property
    def hears(self) -> Sequence[Hears]:
        """What the real part hears."""
        return self._part.hears

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Do what the real part does, and show it bent."""
        outbox = self._part.step(now_ns, inbox)
        bend, own = self.bend, self._junction.name
        meant = next(s for s in outbox if isinstance(s, Spat) and s.junction == own)
        shown = meant if bend is None or meant.mode == "flash" else bend(meant)
        if shown == meant:
            return outbox
        if self.bent_ns is None:
            self.bent_ns = now_ns
        return self._with(outbox, shown)

    def _with(self, outbox: list[Outgoing], shown: Spat | None) -> list[Outgoing]:
        """Return what goes out when something else is shown than was meant."""
        station = roadside_station(self._junction.name)
        bent: list[Outgoing] = []
        for item in outbox:
            if isinstance(item, Spat) and item.junction == self._junction.name:
                bent += [] if shown is None else [shown]
            elif isinstance(item, SpatemTx) and item.station == station:
                if shown is not None:
                    body = spatem_of(shown, self._junction)
                    bent.append(SpatemTx(station=station, t_ns=item.t_ns, body=body))
            else:
                bent.append(item)
        return bent

    def finish(self, now_ns: int) -> list[Outgoing]:
        """Fall silent."""
        return self._part.finish(now_ns)


class StandIn:
    """Runs a bent traffic part on the bus, in a thread, from `with` on until its end."""

    def __init__(
        self,
        city_map: CityMap,
        junction: str,
        endpoint: str,
        city: str,
        credentials: Credentials | None = None,
    ) -> None:
        self.part = BentTraffic(city_map, junction)
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
