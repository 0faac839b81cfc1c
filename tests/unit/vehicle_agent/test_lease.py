"""The lease of one car and its commands, in virtual time."""

import pytest

from scm.clock import NS_PER_MS, NS_PER_S
from scm.v2x.message import Refused
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.lease_request import LeaseReply, LeaseRequest
from vehicle_agent.devkit.commands import CarCommand
from vehicle_agent.lease import RENEW_NS, CarLease

WISH = CarCommand(0.5, -0.25, headlights="low", indicators="hazard")


def lease(epoch=4, owner="me"):
    return LeaseReply(vehicle="n1", owner=owner, epoch=epoch, ttl_ms=1000)


@pytest.fixture
def wheel():
    made = CarLease("n1", "me")
    (call,) = made.step(0, WISH, 0)
    assert (call.request.verb, call.request.owner) == ("acquire", "me")
    made.replied(call.request, lease())
    return made


def told(wheel, now_ns, said_ns):
    return [one for one in wheel.step(now_ns, WISH, said_ns) if isinstance(one, DriveCommand)]


def test_a_command_carries_all_that_is_wished(wheel):
    (command,) = told(wheel, 1, 1)
    assert (command.vehicle, command.epoch, command.seq) == ("n1", 4, 1)
    assert (command.throttle, command.steering) == (0.5, -0.25)
    assert (command.headlights, command.indicators) == ("low", "hazard")


def test_an_old_wish_is_repeated_each_50_ms_and_loses_its_throttle_after_a_second(wheel):
    assert told(wheel, 1, 1)
    assert not told(wheel, 50 * NS_PER_MS, 1)
    assert told(wheel, 50 * NS_PER_MS + 1, 1)[0].throttle == 0.5
    wheel.step(NS_PER_S, WISH, 1)
    (late,) = told(wheel, NS_PER_S + 1, 1)
    assert (late.throttle, late.steering) == (0.0, -0.25)


def test_the_lease_is_renewed_five_times_in_its_life(wheel):
    times = range(0, 2000, 10)
    asked = [one for t in times for one in wheel.step(t * NS_PER_MS, WISH, t)]
    renewals = [one.request for one in asked if not isinstance(one, DriveCommand)]
    assert {(request.verb, request.epoch) for request in renewals} == {("renew", 4)}
    assert len(renewals) == 2 * NS_PER_S // RENEW_NS - 1 == 9


def test_a_refusal_is_said_once_and_another_one_anew(caplog):
    wheel = CarLease("n1", "me")
    (call,) = wheel.step(0, WISH, 0)
    for why in ("ada drives", "ada drives", "no such car"):
        wheel.replied(call.request, Refused(code="owned", detail=why))
    assert (caplog.text.count("ada drives"), caplog.text.count("no such car")) == (1, 1)
    assert wheel.detail == "n1 is requested"
    assert told(wheel, 1, 1) == []


def test_anothers_lease_is_none():
    wheel = CarLease("n1", "me")
    (call,) = wheel.step(0, WISH, 0)
    wheel.replied(call.request, lease(owner="ada"))
    assert told(wheel, 1, 1) == []
    assert wheel.release() == []


def test_a_refusal_of_an_older_epoch_takes_nothing_away(wheel):
    old = LeaseRequest(vehicle="n1", owner="me", verb="renew", epoch=3)
    wheel.replied(old, Refused(code="stale", detail="epoch 3 is over"))
    assert told(wheel, 1, 1)
    (release,) = wheel.release()
    assert (release.request.verb, release.request.epoch) == ("release", 4)
    assert told(wheel, 2, 2) == []
