"""A part whose cars lie on the air: what it sends is as before, but for some stations' CAMs.

    Attacker(AgentPart("n3"), {"n3": "zero_speed"})     a station of its own, live or in lockstep
    Attacker(WorldPart(...), {"n3": "zero_speed"})      a hosted car, in lockstep

Around a world, what roadside units and agents hear is changed alike; the drivers of other hosted
cars hear the truth, for they hear it inside the world.
"""

import heapq
import itertools
import random
from collections.abc import Mapping, Sequence

from scm.maps.model import CityMap
from scm.part import Hears, IsWanted, Part, Serves
from scm.v2x.exchange import Incoming, Outgoing
from scm.v2x.messages.cam_rx import CamRx
from scm.v2x.messages.cam_tx import CamTx
from scm.v2x.misbehaviour.attack import Frame, Scene, Transform, load_attack
from scm.v2x.misbehaviour.ground import Ground

Cam = CamTx | CamRx


class Attacker:
    """A part, and what some of its stations say instead of the truth; see `scm.part.Part`.

    Args:
        part: Whose outbox is changed; everything else is its own.
        attacks: By station the name of its attack.
        city_map: What attackers know of the city.
        seed: Of all attacks.
        own_names: Ghosts go under names of their own, as if they had certificates; else under the
            attacker's, as a city that guards its keys allows nothing else.

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
    ) -> None:
        self._part = part
        self.name, self.role, self.period_ns = part.name, part.role, part.period_ns
        self._scene = Scene(Ground(city_map))
        self._send: dict[str, Transform] = {
            station: load_attack(name).start(random.Random(f"{seed} {station}"), self._scene)
            for station, name in attacks.items()
        }
        self._own_names = own_names
        self._later: list[tuple[int, int, list[Cam]]] = []
        self._count = itertools.count()

    @property
    def hears(self) -> Sequence[Hears]:
        """What the part hears."""
        return self._part.hears

    @property
    def serves(self) -> Sequence[Serves]:
        """What the part serves."""
        return self._part.serves

    def learn_wishes(self, is_wanted: IsWanted) -> None:
        """Let the part ask what is wanted, if it cares."""
        learn = getattr(self._part, "learn_wishes", None)
        if learn is not None:
            learn(is_wanted)

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Let the part act, and change what its liars say."""
        for item in inbox:
            if isinstance(item.message, CamRx):
                self._overhear(item.message)
        outbox: list[Outgoing] = []
        heard: dict[tuple[str, int], list[Cam]] = {}
        for said in self._part.step(now_ns, inbox):
            if isinstance(said, CamTx | CamRx) and said.station in self._send:
                heard.setdefault((said.station, said.t_ns), []).append(said)
                continue
            if isinstance(said, CamTx):
                self._overhear(said)
            outbox.append(said)
        for copies in heard.values():
            self._lie(copies)
        while self._later and self._later[0][0] <= now_ns:
            outbox += heapq.heappop(self._later)[2]
        return outbox

    def finish(self, now_ns: int) -> list[Outgoing]:
        """Let the part leave."""
        return self._part.finish(now_ns)

    def _overhear(self, cam: Cam) -> None:
        self._scene.heard.append(Frame(cam.station, cam.t_ns, cam.body))

    def _lie(self, copies: list[Cam]) -> None:
        """Replace one frame, as sent and as each receiver heard it."""
        first = copies[0]
        for sent in self._send[first.station](Frame(first.station, first.t_ns, first.body)):
            frame = sent.frame
            name = frame.station if self._own_names else first.station
            told = [_as(copy, name, frame) for copy in copies]
            heapq.heappush(self._later, (frame.t_ns, next(self._count), told))


def _as(copy: Cam, name: str, frame: Frame) -> Cam:
    if isinstance(copy, CamTx):
        return CamTx(station=name, t_ns=frame.t_ns, body=frame.body)
    return CamRx(receiver=copy.receiver, station=name, t_ns=frame.t_ns, body=frame.body)
