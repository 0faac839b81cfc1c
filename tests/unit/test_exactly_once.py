"""Exactly once in effect: whatever the network, the store and the server go through."""

from collections import Counter
from itertools import pairwise

import hypothesis.strategies as st
import pytest
from hypothesis import settings
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from scm.clock import NS_PER_MS, seconds
from scm.errors import StoreError
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import BasePart, Service
from scm.store.audit import AuditLog
from scm.store.memory import MemoryStore
from scm.store.records import PlanRecord, records
from scm.v2x.bus_memory import MemoryNetwork
from scm.v2x.exchange import Answer, Incoming, PersistedState
from scm.v2x.faults import FaultRates, Faults
from scm.v2x.message import Refused
from scm.v2x.messages.plan_request import PlanReply, PlanRequest
from scm.v2x.request_retry import RetriedRequest, with_id

PATIENT_S = 300.0
CLIENTS = ("ann", "bob", "api")


class Fragile(MemoryStore):
    """A store that fails while `sick`; every second time it had done it when it failed."""

    sick = False
    failures = 0

    def transaction(self):
        inner = super().transaction()
        if not self.sick or self._depth:
            return inner
        self.failures += 1
        return _Failing(inner, after=self.failures % 2 == 0)


class _Failing:
    def __init__(self, inner, *, after):
        self.inner, self.after = inner, after

    def __enter__(self):
        if not self.after:
            msg = "the disk is full"
            raise StoreError(msg)
        return self.inner.__enter__()

    def __exit__(self, *exc):
        self.inner.__exit__(*exc)
        if exc[0] is None:
            msg = "the line broke while it committed"
            raise StoreError(msg)
        return False


class Shop(BasePart):
    """Counts what it was asked to do, by request id; the counts outlive it."""

    name, role, period_ns = "traffic", "part", 20 * NS_PER_MS
    subscriptions = ()
    services = (Service(PlanRequest),)

    def __init__(self, store):
        stored = records(store, "plans", self.name, PlanRecord)
        self.done = Counter({key: int(record.plan) for key, record in stored.items()})

    def step(self, now_ns, inbox):
        out = []
        for item in inbox:
            request = item.message
            self.done[request.request_id] += 1
            count = PlanRecord(plan=str(self.done[request.request_id]))
            reply = PlanReply(junction=request.junction, plan=request.plan)
            out += [Answer(item, reply), PersistedState("plans", request.request_id, count)]
        return out

    def finish(self, now_ns):
        return []


class Client(BasePart):
    """Asks until it is answered."""

    role, period_ns, subscriptions, services = "client", 20 * NS_PER_MS, (), ()

    def __init__(self, name):
        self.name = name
        self.askings = {}

    def step(self, now_ns, inbox):
        for item in inbox:
            self.askings[item.call.request].receive(item)
        calls = (asking.due(now_ns) for asking in self.askings.values())
        return [call for call in calls if call is not None]

    def finish(self, now_ns):
        return []


class ExactlyOnce(RuleBasedStateMachine):
    """Clients ask over a bad network; the server dies and is started again from its store."""

    @initialize(seed=st.integers(0, 1000))
    def begin(self, seed):
        self.faults, self.store = Faults(seed), Fragile()
        self.clients = {name: Client(name) for name in CLIENTS}
        self.city = Lockstep(self.clients.values(), faults=self.faults)
        self.asked = 0
        self.shop = None
        self.start()

    def start(self):
        self.shop = Shop(self.store)
        self.city.add(self.shop, self.store)

    def put(self, client, request):
        if request not in self.clients[client].askings:
            asking = RetriedRequest(request, self.city.now_ns, PATIENT_S)
            self.clients[client].askings[request] = asking

    @rule(client=st.sampled_from(CLIENTS))
    def ask(self, client):
        self.asked += 1
        self.put(client, self.request(self.asked, client))

    @rule(client=st.sampled_from(CLIENTS), number=st.integers(1, 100))
    def ask_with_an_id_that_was_used(self, client, number):
        if self.asked:
            self.put(client, self.request(1 + number % self.asked, client))

    @staticmethod
    def request(number, client):
        question = f"{client}-{number}"
        return PlanRequest(request_id=f"r{number}", junction="x1", plan=question, by=client)

    @rule(
        drop=st.sampled_from([0.0, 0.3, 0.9]),
        double=st.sampled_from([0.0, 0.5]),
        late=st.sampled_from([0.0, 0.5]),
        late_s=st.sampled_from([0.1, 1.5, 20.0]),
    )
    def turn_weather(self, drop, double, late, late_s):
        self.faults.rates = FaultRates(drop=drop, duplicate=double, late=late, late_s=late_s)

    @rule(away=st.sets(st.sampled_from([*CLIENTS, "traffic"])))
    def cut_off(self, away):
        self.faults.partition(away)

    @rule(sick=st.booleans())
    def sicken(self, sick):
        self.store.sick = sick

    @rule(span_s=st.sampled_from([0.02, 0.1, 0.5, 3.0]))
    def wait(self, span_s):
        self.city.run_for(span_s)

    @rule()
    def kill(self):
        self.store.sick = False
        self.city.kill(self.shop)
        self.start()

    def answered(self):
        for client in self.clients.values():
            for request, asking in client.askings.items():
                if asking.reply is not None:
                    yield request, asking.reply

    @invariant()
    def nothing_is_done_twice(self):
        if hasattr(self, "shop"):
            assert max(self.shop.done.values(), default=0) <= 1

    @invariant()
    def what_was_acknowledged_was_done_and_every_answer_is_its_questions(self):
        if not hasattr(self, "shop"):
            return
        for request, reply in self.answered():
            if isinstance(reply, PlanReply):
                assert reply.plan == request.plan
                assert self.shop.done[request.request_id] == 1

    def teardown(self):
        if not hasattr(self, "shop"):
            return
        self.faults.rates, self.store.sick = FaultRates(), False
        self.faults.partition(())
        self.city.run_for(60.0)
        self.what_was_acknowledged_was_done_and_every_answer_is_its_questions()
        for client in self.clients.values():
            for request, asking in client.askings.items():
                assert asking.reply is not None, request
                is_done = isinstance(asking.reply, PlanReply)
                assert is_done or asking.reply.code == "invalid", asking.reply
        assert len(self.shop.done) == self.asked
        log = AuditLog(self.store)
        log.verify()
        noted = Counter(deed.request_id for _, deed in log.deeds())
        assert noted == self.shop.done
        self.city.close()


TestExactlyOnce = ExactlyOnce.TestCase
TestExactlyOnce.settings = settings(max_examples=60, stateful_step_count=30)


def request(request_id="r1"):
    return PlanRequest(request_id=request_id, junction="x1", plan="calm", by="t")


def refused(asking, code, t_ns):
    asking.receive(Incoming(Refused(code=code, detail="no"), t_ns, None))


def test_asking_ends_with_the_first_answer():
    asking = RetriedRequest(request(), 0, 10.0)
    assert asking.due(0).request.request_id == "r1"
    assert asking.due(NS_PER_MS) is None
    asking.receive(Incoming(PlanReply(junction="x1", plan="calm"), 1, None))
    assert isinstance(asking.reply, PlanReply)
    assert asking.due(10**12) is None


def test_a_refusal_is_an_answer():
    asking = RetriedRequest(request(), 0, 10.0)
    asking.due(0)
    refused(asking, "owned", 1)
    assert asking.reply.code == "owned"


@pytest.mark.parametrize("code", ["timeout", "offline"])
def test_silence_is_asked_into_again_ever_more_slowly_until_the_deadline(code):
    asking, now_ns, times = RetriedRequest(request(), 0, 5.0), 0, []
    while asking.reply is None:
        call = asking.due(now_ns)
        if call is not None:
            times.append(now_ns)
            refused(asking, code, now_ns)
        now_ns += 10 * NS_PER_MS
    pauses = [seconds(b - a) for a, b in pairwise(times)]
    assert pauses[:5] == pytest.approx([0.1, 0.2, 0.4, 0.8, 1.0])
    assert times[-1] < 5 * 10**9
    assert f"tried {len(times)} times in 5 s" in asking.reply.detail
    assert "may have been done" in asking.reply.detail
    assert "'r1'" in asking.reply.asked


def test_an_id_is_given_to_what_has_none_and_to_nothing_else():
    first, second = with_id(request("")), with_id(request(""))
    assert len({first.request_id, second.request_id, ""}) == 3
    assert with_id(request()) == request()


def test_the_network_without_faults_is_the_one_it_was():
    assert MemoryNetwork(Lockstep([]).clock).faults is None


def test_no_answer_leaves_before_it_is_stored_and_nothing_new_begins_meanwhile():
    store = Fragile()
    city, shop = Lockstep([]), Shop(store)
    city.add(shop, store)
    store.sick = True
    assert city.call(request(), timeout_s=0.5).code == "timeout"
    refused_one = city.call(request("r2"), timeout_s=0.5)
    assert refused_one.code == "offline"
    assert "cannot store its state" in refused_one.detail
    store.sick = False
    assert city.call(request()).plan == "calm"
    assert city.call(request("r2")).plan == "calm"
    assert shop.done == {"r1": 1, "r2": 1}
    city.close()
