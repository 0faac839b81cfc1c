"""Who watches a city does not change it, also where frames and messages get lost."""

import pytest
from msgspec.structs import replace

from scm.api.view import CityView
from scm.maps.load import load_map
from scm.records.city_map import RadioChannel
from scm.recorder.part import RecorderPart
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.traffic.signals.part import TrafficPart
from scm.v2x.faults import FaultRates, Faults
from scm.v2x.messages.cam import CamTx
from scm.world.part import WorldPart
from vehicle_agent.agent import AgentPart

RADIO = RadioChannel(loss=0.3, fading_db=3.0, delay_ms=20.0, jitter_ms=40.0)


def places(*observers, rates=None):
    """Return where all cars are after a while: two hosted ones, and an agent's."""
    city_map = replace(load_map("driving_school"), radio=RADIO)
    hosted = (("n1", "nigel"), ("n2", "nigel"))
    world, faults = WorldPart(city_map, 1, hosted), Faults(3, rates) if rates else None
    parts = [world, TrafficPart(city_map), AgentPart("n3"), *observers]
    with Lockstep(parts, faults=faults) as city:
        if observers:
            city.subscribe(Subscription(CamTx))  # frames that nobody else would have made
        city.run_for(12.0)
        cars = world.world.cars
        poses = {name: tuple(cars.garage.poses("nigel")[i]) for i, name in enumerate(cars.hosted)}
        return poses, {name: car.pose for name, car in cars.remote.items()}


@pytest.mark.parametrize("rates", [None, FaultRates(drop=0.01, late=0.1)])
def test_a_recorder_and_a_dashboard_change_nothing(tmp_path, rates):
    alone = places(rates=rates)
    assert alone[1], "the agent has joined"
    assert places(CityView(), RecorderPart(tmp_path / "city.mcap"), rates=rates) == alone
