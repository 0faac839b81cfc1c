"""What `scm up` hands to the next run of a part."""

import pytest

from scm.latched import Latched
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.monitor_status import MonitorStatus


@pytest.fixture
def latched():
    return Latched()


def status(fault):
    return MonitorStatus(junction="crossing", t_ns=1, fault=fault, since_ns=1)


def test_nothing_is_latched_at_first(latched):
    assert latched.world_arguments() == latched.monitor_arguments() == []


def test_the_stop_is_handed_on_until_it_is_released(latched):
    latched.heard(CityStop(t_ns=1, engaged=True, by="-ann b"))
    assert latched.world_arguments() == ["--stopped-by=-ann b"]
    latched.heard(CityStop(t_ns=2, engaged=False))
    assert latched.world_arguments() == []


def test_a_fault_is_handed_on_until_it_is_reset(latched):
    latched.heard(status("stale"))
    assert latched.monitor_arguments() == ["--fault=crossing=stale"]
    latched.heard(status(None))
    assert latched.monitor_arguments() == []
