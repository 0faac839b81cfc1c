"""Two cities of real processes, joined through a bad cable: neither ever stops the other."""

import os
import signal
import subprocess
import sys
import time
from contextlib import ExitStack
from itertools import pairwise

import pytest
import zenoh

from scm.maps.load import MAPS_DIR
from scm.runtime.parent_watch import with_parent
from scm.v2x import zenoh_config
from scm.v2x.bus import Mailbox
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.crossing import HANDOVER
from scm.v2x.key import prefix
from scm.v2x.messages.neighbour_status import NeighbourStatus
from scm.v2x.messages.spat import Spat
from scm.v2x.router import free_endpoint
from tests.e2e.city_process import START_S, wait_for
from tests.e2e.faulty_proxy import FaultyProxy

pytestmark = pytest.mark.e2e

OTHER = {"a": "b", "b": "a"}
GAP_S = 1.0  # a car takes no green that is older


class JoinedCities:
    def __init__(self, folder, stack):
        self.folder, self.stack = folder, stack
        self.listen = {city: free_endpoint() for city in "ab"}
        gate = free_endpoint()
        self.proxy = stack.enter_context(FaultyProxy(gate))
        self.link = {"a": f"admit={gate}", "b": f"join={self.proxy.listen}"}
        self.processes, self.spats, self.statuses, self.state = {}, {}, {}, {}
        school = (MAPS_DIR / "driving_school.toml").read_text(encoding="utf-8")
        for city, other in OTHER.items():
            neighbour = f'\n[[neighbours]]\ncity = "{other}"\nmessages = ["states"]\n'
            (folder / f"{city}.toml").write_text(school + neighbour)
            self.start(city)
            bus = stack.enter_context(
                ZenohBus(city, "watcher", self.listen[city], connect_timeout_s=START_S)
            )
            self.spats[city], self.statuses[city] = Mailbox(10_000), Mailbox(1000)
            bus.subscribe(Spat, {}, self.spats[city])
            bus.subscribe(NeighbourStatus, {}, self.statuses[city])

    def start(self, city):
        words = (city, OTHER[city], self.folder / f"{city}.toml", self.listen[city])
        words += (self.link[city], self.folder / f"{city}.sock", "traffic")
        program = [sys.executable, "-m", "tests.e2e.toy_city", *map(str, words)]
        process = subprocess.Popen(
            with_parent(program), env=dict(os.environ), stdout=subprocess.DEVNULL
        )
        self.processes[city] = process
        self.stack.callback(process.wait, timeout=30.0)
        self.stack.callback(process.kill)

    def kill(self, city):
        self.processes[city].send_signal(signal.SIGKILL)
        self.processes[city].wait(timeout=30.0)

    def is_joined(self, city):
        for item in self.statuses[city].drain():
            self.state[city] = item.message
        return city in self.state and self.state[city].state == "joined"

    def gap_s(self, city):
        """Return the longest time without a signal state since the last call."""
        times = [item.t_ns for item in self.spats[city].drain()]
        assert len(times) > 5
        return max(b - a for a, b in pairwise(times)) / 1e9


@pytest.fixture(scope="module")
def joined(tmp_path_factory):
    with ExitStack() as stack:
        cities = JoinedCities(tmp_path_factory.mktemp("joined"), stack)
        wait_for(lambda: all(map(cities.is_joined, "ab")), START_S, "both cities are joined")
        for city in "ab":
            wait_for(lambda c=city: len(cities.spats[c].drain()) > 0, START_S, "signals are shown")
        yield cities


def test_neighbours_learn_what_the_other_shows(joined):
    assert joined.is_joined("a")
    assert (joined.state["a"].shows, joined.state["a"].sees) == (("states",), ("states",))


def test_signals_of_both_go_on_while_the_link_is_stalled_and_cut(joined):
    for box in joined.spats.values():
        box.drain()
    joined.proxy.stalled = True
    wait_for(lambda: not any(map(joined.is_joined, "ab")), 30.0, "both notice the loss")
    assert joined.state["b"].state == "lost"
    joined.proxy.stalled = False
    for _ in range(5):
        joined.proxy.cut(reset=True)
        time.sleep(0.2)
    wait_for(lambda: all(map(joined.is_joined, "ab")), 30.0, "both are joined again")
    assert max(joined.gap_s("a"), joined.gap_s("b")) < GAP_S


@pytest.mark.parametrize("city", ["a", "b"])
def test_city_that_is_killed_does_not_stop_the_other_and_joins_again(joined, city):
    other = OTHER[city]
    wait_for(lambda: all(map(joined.is_joined, "ab")), START_S, "both are joined")
    joined.spats[other].drain()
    joined.kill(city)
    wait_for(lambda: not joined.is_joined(other), 30.0, "the other notices")
    assert joined.gap_s(other) < GAP_S
    joined.start(city)
    wait_for(lambda: joined.is_joined(other), START_S, "it is joined again")
    assert joined.gap_s(other) < GAP_S


def test_requests_over_a_slow_link_hold_up_no_local_message(joined):
    wait_for(lambda: joined.is_joined("a"), START_S, "joined")
    text = zenoh_config.client(joined.listen["a"], 10.0)
    with (
        zenoh.open(zenoh.Config.from_json5(text)) as sender,
        zenoh.open(zenoh.Config.from_json5(text)) as receiver,
        zenoh.open(zenoh.Config.from_json5(zenoh_config.client(joined.listen["b"], 10.0))) as far,
    ):
        received = set()
        handler = zenoh.handlers.Callback(
            lambda sample: received.add(bytes(sample.payload)), indirect=False
        )
        probe = prefix("a") + "probe"
        local = receiver.declare_subscriber(probe, handler)
        answer = zenoh.handlers.Callback(lambda query: query.drop(), indirect=False)
        world = far.declare_queryable(prefix("b") + HANDOVER + "*", answer)
        wait_for(lambda: sender.put(probe, b"") or received, 10.0, "local messages arrive")
        joined.proxy.delay_s, sent = 0.5, set()
        quiet = zenoh.handlers.Callback(lambda reply: None, indirect=False)
        for turn in range(800):
            sent.add(b"%d" % turn)
            sender.put(probe, b"%d" % turn, congestion_control=zenoh.CongestionControl.BLOCK)
            if turn % 8 == 0:
                where = prefix("b") + HANDOVER + "a"
                sender.get(where, quiet, payload=bytes(300_000), timeout=2.0)
            time.sleep(0.005)
        joined.proxy.delay_s = 0.0
        time.sleep(0.5)
        assert sent <= received
        local.undeclare()
        world.undeclare()
