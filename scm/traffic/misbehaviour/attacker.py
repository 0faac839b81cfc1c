"""A part whose cars send false CAMs; everything else that it sends is unchanged.

    Attacker(AgentPart("n3"), {"n3": "zero_speed"})     a station of its own, live or in lockstep
    Attacker(WorldPart(...), {"n3": "zero_speed"})      a hosted car, in lockstep

Around a world, roadside units and agents receive the false CAMs; the drivers of other hosted cars
receive the true ones, inside the world.
"""

import heapq
import itertools
import random
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from msgspec.structs import replace

from scm.clock import seconds
from scm.records.city_map import CityMap
from scm.runtime.part import IsWanted, Part, Service, Subscription
from scm.traffic.misbehaviour.attack import Frame, Scene, Transform, load_attack
from scm.traffic.misbehaviour.ground import Ground
from scm.v2x.exchange import Incoming, Outgoing
from scm.v2x.messages.cam import CamRx, CamTx
from scm.v2x.messages.misbehaviour_report import MisbehaviourReport

Cam = CamTx | CamRx
MAX_CHECKS = 3


@dataclass(slots=True)
class _Record:
    """What one attacker has sent so far, and since when it is suspected."""

    about: str
    cams: int = 0
    lies: int = 0
    first_ns: int = 0
    since_ns: int | None = None


class Attacker:
    """A part of which some stations send false messages; see `scm.runtime.part.Part`.

    Args:
        part: Whose outbox is changed; everything else is its own.
        attacks: By station the name of its attack.
        city_map: What attackers know of the city.
        seed: Of all attacks.
        own_names: Ghosts go under names of their own, as if they had certificates; else under the
            attacker's, as a city that guards its keys allows nothing else.
        print_line: Receives lines for a person: the first false message, each suspicion, the sum
            at the end. None: nothing is printed. A guarded city reports suspicions to no car.

    Raises:
        RunError: when there is no such attack.
    """

    def __init__(
        self,
        part: Part,
        attacks: Mapping[str, str],
        city_map: CityMap,
        seed: int = 0,
        *,
        own_names: bool = False,
        print_line: Callable[[str], None] | None = None,
    ) -> None:
        self._part = part
        self.name, self.role, self.period_ns = part.name, part.role, part.period_ns
        self._scene = Scene(Ground(city_map))
        self._send: dict[str, Transform] = {
            station: load_attack(name).start(random.Random(f"{seed} {station}"), self._scene)
            for station, name in attacks.items()
        }
        self._own_names = own_names
        self._print = print_line or _nobody
        self._prints = print_line is not None
        self._records = {name: _Record(load_attack(a).about) for name, a in attacks.items()}
        self._later: list[tuple[int, int, list[Cam]]] = []
        self._count = itertools.count()

    @property
    def subscriptions(self) -> Sequence[Subscription]:
        """Those of the part, and of reports on its attackers if lines are printed."""
        reports = (Subscription(MisbehaviourReport, {"suspect": name}) for name in self._send)
        return (*self._part.subscriptions, *reports) if self._prints else self._part.subscriptions

    @property
    def services(self) -> Sequence[Service]:
        """Those of the part."""
        return self._part.services

    def attach(self, is_wanted: IsWanted) -> None:
        """Let the part check for subscribers."""
        self._part.attach(is_wanted)

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Step the part, and change what its attackers send."""
        # A world subscribes to some frames undecoded; none of these is meant here.
        for message in (item.message for item in inbox if isinstance(item, Incoming)):
            if isinstance(message, CamRx):
                self._overhear(message)
            elif isinstance(message, MisbehaviourReport):
                self._is_reported(message)
        outbox: list[Outgoing] = []
        copies_of: dict[tuple[str, int], list[Cam]] = {}
        for sent in self._part.step(now_ns, inbox):
            if isinstance(sent, CamTx | CamRx) and sent.station in self._send:
                copies_of.setdefault((sent.station, sent.t_ns), []).append(sent)
                continue
            if isinstance(sent, CamTx):
                self._overhear(sent)
            outbox.append(sent)
        for copies in copies_of.values():
            self._lie(copies)
        while self._later and self._later[0][0] <= now_ns:
            outbox += heapq.heappop(self._later)[2]
        return outbox

    def finish(self, now_ns: int) -> list[Outgoing]:
        """Finish the part."""
        for name, record in self._records.items():
            found = "never reported" if record.since_ns is None else "reported"
            sums = f"{record.cams} CAMs, {record.lies} of them false, {found}"
            self._print(f"{name} leaves: {sums if record.cams else 'it was never in the city'}")
        return self._part.finish(now_ns)

    def _overhear(self, cam: Cam) -> None:
        self._scene.received.append(Frame(cam.station, cam.t_ns, cam.body))

    def _lie(self, copies: list[Cam]) -> None:
        """Replace one frame, as sent and as each receiver got it."""
        first = copies[0]
        record = self._records[first.station]
        for sent in self._send[first.station](Frame(first.station, first.t_ns, first.body)):
            frame = sent.frame
            record.cams += 1
            record.lies += sent.lies
            if sent.lies and record.lies == 1:
                record.first_ns = frame.t_ns
                self._print(f"{first.station} sends its first false CAM: {record.about}")
            name = frame.station if self._own_names else first.station
            changed = [_as(copy, name, frame) for copy in copies]
            heapq.heappush(self._later, (frame.t_ns, next(self._count), changed))

    def _is_reported(self, report: MisbehaviourReport) -> None:
        """Print each suspicion once, not with every repeated report."""
        record = self._records[report.suspect]
        if record.since_ns == report.since_ns:
            return
        record.since_ns = report.since_ns
        after_s = seconds(report.t_ns - record.first_ns)
        checks = ", ".join(
            f"{one.check} ({one.claims} implausible CAMs)"
            for one in report.observations[:MAX_CHECKS]
        )
        self._print(
            f"{report.suspect} is reported {after_s:.1f} s after its first false CAM, "
            f"score {report.score:.1f}: {checks}"
        )


def _as(copy: Cam, name: str, frame: Frame) -> Cam:
    if isinstance(copy, CamTx):
        return CamTx(station=name, t_ns=frame.t_ns, body=frame.body)
    car = copy.car if name == copy.station else ""  # a ghost is no car of the city
    return replace(copy, station=name, t_ns=frame.t_ns, body=frame.body, signed="", car=car)


def _nobody(line: str) -> None:
    del line
