"""Exactly once over real processes: a bad line, and a world that is killed in the middle."""

import os
import signal
import subprocess
import sys
import threading
from collections import Counter

import pytest

from scm.runtime.parent_watch import with_parent
from scm.store.audit import AuditLog
from scm.store.open import open_store
from scm.v2x.bus import Mailbox
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.messages.lease_request import LeaseReply, LeaseRequest
from scm.v2x.messages.remove_request import RemoveReply, RemoveRequest
from scm.v2x.messages.spawn_request import SpawnReply, SpawnRequest
from scm.v2x.messages.stop_request import StopRequest
from scm.v2x.messages.world_snapshot import WorldSnapshot
from scm.v2x.request_retry import send_request, with_id
from scm.v2x.router import Router, free_endpoint
from tests.e2e.city_process import wait_for
from tests.e2e.faulty_proxy import FaultyProxy, trouble

PATIENT_S = 120.0
ROUNDS = 26  # 52 requests


class World:
    """`scm world` with a store, to be killed and started again."""

    def __init__(self, endpoint, state):
        self.command = [sys.executable, "-m", "scm", "world", "driving_school"]
        self.command += ["--connect", endpoint, "--state", state]
        self.start()

    def start(self):
        self.process = subprocess.Popen(with_parent(self.command), stderr=subprocess.DEVNULL)

    def kill(self):
        os.kill(self.process.pid, signal.SIGKILL)
        self.process.wait()

    def stop(self):
        if self.process.poll() is None:
            self.process.terminate()
        return self.process.wait(timeout=10.0)


pytestmark = pytest.mark.slow


@pytest.fixture
def state(tmp_path):
    return f"sqlite:{tmp_path / 'city.db'}"


@pytest.fixture
def router():
    with Router(free_endpoint()) as router:
        yield router


@pytest.fixture
def world(router, state):
    world = World(router.listen, state)
    yield world
    world.stop()


def cars_now(bus):
    """Return the names of the cars in the newest snapshot."""
    snapshots = Mailbox(1)
    bus.subscribe(WorldSnapshot, {}, snapshots)
    (item,) = wait_for(snapshots.drain, 90.0, "a snapshot of the world")
    bus.unsubscribe(snapshots)
    return {car.vehicle for car in item.message.vehicles}


def ready(bus):
    request = StopRequest(engaged=False, by="test")
    assert send_request(bus, request, PATIENT_S).engaged is False


def test_each_request_over_a_bad_line_to_a_world_that_is_killed_has_its_effect_once(
    router, world, state
):
    sent, answers = [], []
    with FaultyProxy(router.listen) as proxy, ZenohBus("city", "script", proxy.listen) as bus:
        ready(bus)

        def send(request, kind):
            request = with_id(request)
            sent.append(request)
            reply = send_request(bus, request, PATIENT_S)
            assert isinstance(reply, kind), reply
            answers.append(reply)
            return reply

        with trouble(proxy, seed=7):
            for n in range(ROUNDS):
                if n == ROUNDS // 3:
                    killer = threading.Timer(0.05, kill_and_start, [world])
                    killer.start()
                spawned = send(SpawnRequest(), SpawnReply)
                send(RemoveRequest(vehicle=spawned.vehicle), RemoveReply)
            killer.join()
        assert proxy.connections > 5
        assert cars_now(bus) == set()
    assert world.stop() == 0
    store = open_store(state)
    log = AuditLog(store)
    log.verify()
    noted = Counter(deed.request_id for _, deed in log.deeds())
    store.close()
    assert len(sent) == 2 * ROUNDS
    assert [noted[request.request_id] for request in sent] == [1] * len(sent)


def kill_and_start(world):
    world.kill()
    world.start()


def test_a_lease_and_an_answer_outlive_a_world_that_is_killed(router, world):
    with ZenohBus("city", "script", router.listen) as bus:
        ready(bus)
        send_request(bus, SpawnRequest(vehicle="n1"), PATIENT_S)
        steal = with_id(
            LeaseRequest(vehicle="n1", owner="ann", verb="steal", reason="test", ttl_ms=60_000)
        )
        held = send_request(bus, steal, PATIENT_S)
        assert isinstance(held, LeaseReply)
        kill_and_start(world)
        assert send_request(bus, steal, PATIENT_S) == held
        assert cars_now(bus) == {"n1"}
        again = send_request(
            bus, LeaseRequest(vehicle="n1", owner="bob", verb="steal", reason="test"), PATIENT_S
        )
        assert again.epoch > held.epoch
        late = LeaseRequest(vehicle="n1", owner="ann", verb="renew", epoch=held.epoch)
        assert send_request(bus, late, PATIENT_S).code == "owned"


def test_a_state_that_cannot_be_opened_ends_the_world_at_once_with_a_reason(router, tmp_path):
    path = tmp_path / "diary.txt"
    path.write_text("no database " * 100)
    command = [sys.executable, "-m", "scm", "world", "--connect", router.listen]
    done = subprocess.run(
        [*command, "--state", f"sqlite:{path}"],
        capture_output=True, text=True, check=False, timeout=60,
    )  # fmt: skip
    assert done.returncode == 2
    assert "this is no SQLite file" in done.stderr
