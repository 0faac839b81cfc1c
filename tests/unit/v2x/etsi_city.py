"""Everything that a small city on a stepped clock sends over the radio, for the tests of codecs.

Cars and lights are the city's own; what no part sends by itself here (map, requests for priority,
their answers, perception) is made of the city's own states by the functions that parts use.
"""

from datetime import UTC, datetime
from functools import cache
from typing import NamedTuple

import numpy as np

from scm.clock import NS_PER_MS, NS_PER_S
from scm.eye.track.perception import collective_perception
from scm.eye.track.sighting import Track
from scm.maps.load import load_map
from scm.maps.route import Roads
from scm.recorder.mcap_file import RunFile
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.traffic.signals.part import TrafficPart
from scm.v2x.etsi.convert import roadside_station, station_id
from scm.v2x.etsi.events import DenmSender, accident, city_stop
from scm.v2x.etsi.json_form import Body
from scm.v2x.etsi.priority import STATUSES
from scm.v2x.etsi.priority_requests import PriorityAnswer, PriorityRequest, srem_of, ssem_of
from scm.v2x.etsi.topology import mapem_at, mapem_of, topology_of
from scm.v2x.exchange import RawSample
from scm.v2x.key import key_of
from scm.v2x.message import encode
from scm.v2x.messages.cam import CamTx
from scm.v2x.messages.contact import Contact
from scm.v2x.messages.cpm import CpmTx
from scm.v2x.messages.denm import DenmTx
from scm.v2x.messages.mapem import MapemTx
from scm.v2x.messages.plan_request import PlanRequest
from scm.v2x.messages.route_request import RouteRequest
from scm.v2x.messages.spatem import SpatemTx
from scm.v2x.messages.spawn_request import SpawnRequest
from scm.v2x.messages.srem import SremTx
from scm.v2x.messages.ssem import SsemTx
from scm.v2x.messages.vehicle_state import VehicleState
from scm.world.part import WorldPart

START_NS = int(datetime(2026, 11, 21, 14, 3, 5, tzinfo=UTC).timestamp()) * NS_PER_S
TX = {
    "cam": CamTx,
    "cpm": CpmTx,
    "denm": DenmTx,
    "mapem": MapemTx,
    "spatem": SpatemTx,
    "srem": SremTx,
    "ssem": SsemTx,
}


class SentMessage(NamedTuple):
    """One message: who sent it, when [ns], and what."""

    station: str
    t_ns: int
    body: Body


@cache
def city_messages() -> dict[str, tuple[SentMessage, ...]]:
    """Return what is sent in twelve seconds of the driving school, by message_type."""
    city_map = load_map("driving_school")
    with Lockstep([WorldPart(city_map, 0), TrafficPart(city_map)], start_ns=START_NS) as city:
        cams, spatems = city.subscribe(Subscription(CamTx)), city.subscribe(Subscription(SpatemTx))
        states = city.subscribe(Subscription(VehicleState))
        for name in ("n1", "n2"):
            city.call(SpawnRequest(vehicle=name))
            city.call(RouteRequest(request_id=name, vehicle=name))
        city.run_for(8.0)
        city.call(PlanRequest(junction="crossing", plan="flash", by="test"))
        city.run_for(4.0)
        sent = {
            kind: tuple(
                SentMessage(m.station, m.t_ns, m.body) for m in (i.message for i in box.drain())
            )
            for kind, box in (("cam", cams), ("spatem", spatems))
        }
        received = [item.message for item in states.drain()]
    state = received[-1]
    return sent | _made(city_map, state)


def _made(city_map, state):
    roads, junction = Roads(city_map), city_map.junctions[0]
    rsu, t_ns = roadside_station(junction.name), state.t_ns
    mapem = mapem_at(mapem_of(roads, junction), t_ns)
    lane = topology_of(roads, junction).lane_in(junction.groups[1].name)
    requests = [
        PriorityRequest(
            station_id=station_id(state.vehicle),
            number=number,
            junction=junction.number,
            lane_in=lane,
            verb=verb,
            role=role,
            lane_out=4 if number else 0,
            arrives_ns=t_ns + 4 * NS_PER_S + 250 * NS_PER_MS if number else None,
            lasts_s=3.5 if number else None,
            sequence=7 + number,
        )
        for number, (verb, role) in enumerate(
            [("request", "emergency"), ("update", "publicTransport"), ("cancel", "basicVehicle")]
        )
    ]
    answers = [PriorityAnswer(request, status) for request in requests for status in STATUSES]
    return {
        "mapem": (SentMessage(rsu, t_ns, mapem),),
        "srem": tuple(
            SentMessage(state.vehicle, t_ns, srem_of(request, state)) for request in requests
        ),
        "ssem": (SentMessage(rsu, t_ns, ssem_of(junction, answers, 3, t_ns)),),
        "denm": tuple(_warnings(state, t_ns)),
        "cpm": tuple(
            SentMessage(rsu, t_ns, collective_perception(tracks, rsu, t_ns).body)
            for tracks in ((), (a_track(t_ns),))
        ),
    }


def _warnings(state, t_ns):
    """Yield a DENM of every form: new, update, cancelled, denied by another station."""
    hit = Contact(
        vehicle=state.vehicle,
        t_ns=t_ns,
        dvx_mps=0.1,
        dvy_mps=0.0,
        dyaw_rate_radps=0.0,
        against=("n2",),
    )
    sender, other = DenmSender(state.vehicle, first=41), DenmSender("rsu-crossing", 15)
    first = sender.trigger(accident(hit, state), t_ns)
    (new,) = sender.due(t_ns)
    yield SentMessage(state.vehicle, t_ns, new)
    sender.update(first, accident(hit, state), t_ns + NS_PER_S)
    yield SentMessage(state.vehicle, t_ns + NS_PER_S, sender.due(t_ns + NS_PER_S)[0])
    other.negate(new, t_ns + 2 * NS_PER_S)
    other.trigger(city_stop(1.4, 0.7), t_ns + 2 * NS_PER_S)
    for body in other.due(t_ns + 2 * NS_PER_S):
        yield SentMessage("rsu-crossing", t_ns + 2 * NS_PER_S, body)
    sender.cancel(first, t_ns + 3 * NS_PER_S)
    yield SentMessage(state.vehicle, t_ns + 3 * NS_PER_S, sender.due(t_ns + 3 * NS_PER_S)[0])


def a_track(t_ns):
    """Return what the Eye knows of one car."""
    fields = {
        "vehicle": "n1", "tag_id": 3, "t_ns": t_ns, "x_m": 1.0, "y_m": 0.5, "yaw_rad": 0.3,
        "speed_mps": 0.2, "lateral_speed_mps": 0.0, "yaw_rate_rad_s": 0.1, "age_s": 0.02,
        "covariance": np.eye(6) * 1e-6, "cameras": ("a",), "flags": (), "stale": False,
    }  # fmt: skip
    return Track(**{n: v for n, v in fields.items() if n in Track.__annotations__})


def record_city(path, late_ns=0):
    """Write all of it as a run received a little later than it was sent; return the path."""
    with RunFile(path, "city") as run:
        for kind, sent in sorted(everything(), key=lambda one: one[1].t_ns):
            message = TX[kind](station=sent.station, t_ns=sent.t_ns, body=sent.body)
            key, (body, _) = key_of("city", message), encode(message)
            run.write(RawSample(key, body, None, sent.t_ns + late_ns))
    return path


def everything():
    """Return all of it as (kind, sent)."""
    return [(kind, one) for kind, all_sent in city_messages().items() for one in all_sent]
