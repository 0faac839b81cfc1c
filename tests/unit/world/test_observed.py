"""Who watches a city does not change it, also where frames and messages get lost."""

import pytest
from msgspec.structs import replace

from scm.api.view import CityView
from scm.maps.load import load_map
from scm.recorder.part import RecorderPart
from scm.records.city_map import RadioChannel
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.traffic.signals.part import TrafficPart
from scm.v2x.faults import FaultRates, Faults
from scm.v2x.messages.cam import CamRx, CamTx
from scm.v2x.messages.presence import Presence
from scm.v2x.messages.radio_status import RadioStatus
from scm.world.part import WorldPart
from vehicle_agent.agent import AgentPart

OTHER = (
    Presence,  # counts sessions
    RadioStatus,  # counts frames whose fate somebody wanted to know
)
RADIO = RadioChannel(loss=0.3, fading_db=3.0, delay_ms=20.0, jitter_ms=40.0)


class Logged(AgentPart):
    """An agent that logs what reaches it."""

    def __init__(self, name):
        super().__init__(name)
        self.log = []

    def step(self, now_ns, inbox):
        self.log += [
            (item.t_ns, item.message) for item in inbox if not isinstance(item.message, OTHER)
        ]
        return super().step(now_ns, inbox)


def run(*observers, rates=None):
    """Return all that reaches an agent beside two hosted cars, and where it is in the end."""
    city_map = replace(load_map("driving_school"), radio=RADIO)
    hosted = (("n1", "nigel"), ("n2", "nigel"))
    world, faults = WorldPart(city_map, 1, hosted), Faults(3, rates) if rates else None
    agent = Logged("n3")
    parts = [world, TrafficPart(city_map), agent, *observers]
    with Lockstep(parts, faults=faults) as city:
        if observers:
            city.subscribe(Subscription(CamTx))  # frames that nobody else would have made
        city.run_for(12.0)
        frames = [message for _, message in agent.log if isinstance(message, CamRx)]
        assert len(frames) > 50
        return agent.log, world.world.cars.remote["n3"].pose


@pytest.mark.parametrize("rates", [None, FaultRates(drop=0.01, late=0.1)])
def test_a_recorder_and_a_dashboard_change_nothing(tmp_path, rates):
    observers = CityView(), RecorderPart(tmp_path / "city.mcap")
    assert run(*observers, rates=rates) == run(rates=rates)
