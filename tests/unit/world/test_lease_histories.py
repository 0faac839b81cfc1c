"""Leases over a bad network and across restarts: one holder at a time, epochs that only grow."""

from collections import Counter

import hypothesis.strategies as st
from hypothesis import settings
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from scm.clock import NS_PER_MS
from scm.maps.load import load_map
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import BasePart
from scm.store.audit import AuditLog
from scm.store.memory import MemoryStore
from scm.v2x.faults import FaultRates, Faults
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.lease_request import LeaseReply, LeaseRequest
from scm.v2x.request_retry import RetriedRequest
from scm.vehicles.guard import Guard
from scm.world import driving
from scm.world.part import WorldPart
from scm.world.restore import read_restored

MAP = load_map("driving_school")
OWNERS = {"ann": 0.1, "bob": 0.2, "eve": 0.3}
CAR = "n1"


class Owner(BasePart):
    """Asks for the lease, and commands the car under every epoch it was ever given."""

    role, period_ns, subscriptions, services = "client", 20 * NS_PER_MS, (), ()

    def __init__(self, name):
        self.name = name
        self.askings = []
        self.epochs = []
        self.seq = 0
        self.reckless = False

    def step(self, now_ns, inbox):
        for item in inbox:
            asking = next(a for a in self.askings if a.request is item.call.request)
            asking.receive(item)
            reply = asking.reply
            if isinstance(reply, LeaseReply) and reply.owner == self.name:
                self.epochs.append(reply.epoch)
        calls = [asking.due(now_ns) for asking in self.askings]
        return [call for call in calls if call is not None] + self.commands(now_ns)

    def commands(self, now_ns):
        epochs = self.epochs if self.reckless else self.epochs[-1:]
        self.seq += 1
        return [
            DriveCommand(
                vehicle=CAR, t_ns=now_ns, epoch=epoch, seq=self.seq, throttle=0.0,
                steering=OWNERS[self.name],
            )
            for epoch in epochs
        ]  # fmt: skip

    def finish(self, now_ns):
        return []


class Leases(RuleBasedStateMachine):
    """Owners fight for one car."""

    @initialize(seed=st.integers(0, 1000))
    def begin(self, seed):
        self.faults, self.store = Faults(seed), MemoryStore()
        self.owners = {name: Owner(name) for name in OWNERS}
        self.city = Lockstep(self.owners.values(), faults=self.faults)
        self.obeyed = []
        self.highest = 0
        self.asked = 0
        machine = self

        class Watched(Guard):
            def accept(self, command, now_ns):
                taken = super().accept(command, now_ns)
                if taken:
                    machine.obeyed.append((command.epoch, command.steering))
                return taken

        self.guard, driving.Guard = driving.Guard, Watched
        self.start()

    def start(self):
        kept = read_restored(self.store)
        self.part = WorldPart(MAP, hosted=((CAR, "nigel"),), room=2, restored=kept)
        self.city.add(self.part, self.store)
        self.city.run_for(0.02)

    def ask(self, owner, verb, **more):
        self.asked += 1
        request = LeaseRequest(
            request_id=f"r{self.asked}", vehicle=CAR, owner=owner, verb=verb, **more
        )
        self.owners[owner].askings.append(
            RetriedRequest(request, self.city.now_ns, 60.0, try_s=0.5)
        )

    @rule(owner=st.sampled_from(sorted(OWNERS)), ttl_ms=st.sampled_from([100, 1000, 60_000]))
    def acquire(self, owner, ttl_ms):
        self.ask(owner, "acquire", ttl_ms=ttl_ms)

    @rule(owner=st.sampled_from(sorted(OWNERS)))
    def steal(self, owner):
        self.ask(owner, "steal", reason="wants it", ttl_ms=60_000)

    @rule(owner=st.sampled_from(sorted(OWNERS)), verb=st.sampled_from(["release", "renew"]))
    def end_or_renew(self, owner, verb):
        epochs = self.owners[owner].epochs
        if epochs:
            self.ask(owner, verb, epoch=epochs[-1])

    @rule(owner=st.sampled_from(sorted(OWNERS)), reckless=st.booleans())
    def change_manners(self, owner, reckless):
        self.owners[owner].reckless = reckless

    @rule(
        drop=st.sampled_from([0.0, 0.5]),
        double=st.sampled_from([0.0, 0.5]),
        late=st.sampled_from([0.0, 0.7]),
        late_s=st.sampled_from([0.1, 2.0]),
    )
    def turn_weather(self, drop, double, late, late_s):
        self.faults.rates = FaultRates(drop=drop, duplicate=double, late=late, late_s=late_s)

    @rule(away=st.sets(st.sampled_from([*OWNERS, "world"])))
    def cut_off(self, away):
        self.faults.partition(away)

    @rule(span_s=st.sampled_from([0.02, 0.1, 0.5, 1.5]))
    def wait(self, span_s):
        self.city.run_for(span_s)

    @rule()
    def kill(self):
        self.city.kill(self.part)
        self.start()

    @invariant()
    def epochs_only_grow_and_each_has_one_owner(self):
        if not hasattr(self, "part"):
            return
        epoch = self.part.world.cars.hosted[CAR].lease.epoch
        assert epoch >= self.highest
        self.highest = epoch
        owners = {}
        for name, owner in self.owners.items():
            for granted in owner.epochs:
                assert owners.setdefault(granted, name) == name
                assert granted <= epoch

    @invariant()
    def nobody_is_obeyed_under_an_older_epoch_or_anothers(self):
        if not hasattr(self, "part"):
            return
        epochs = [epoch for epoch, _ in self.obeyed]
        assert epochs == sorted(epochs)
        for epoch in set(epochs):
            assert len({steering for e, steering in self.obeyed if e == epoch}) == 1

    def teardown(self):
        if hasattr(self, "part"):
            driving.Guard = self.guard
            self.city.close()
            deeds = Counter(deed.request_id for _, deed in AuditLog(self.store).deeds())
            assert max(deeds.values(), default=1) == 1, deeds


TestLeases = Leases.TestCase
TestLeases.settings = settings(max_examples=25, stateful_step_count=30)
