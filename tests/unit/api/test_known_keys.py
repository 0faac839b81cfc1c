"""Keys that a slow store knows: the event loop never waits for it, nor does the red stop."""

import asyncio
import threading

import httpx
import pytest

from scm.api.app import create_app
from scm.api.keys import KeyRing, public_part
from scm.api.known_keys import FRESH_NS, REMEMBERED_NS, THREADS, KnownKeys
from scm.clock import StepClock
from scm.errors import StoreError
from scm.store.memory import MemoryStore
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.stop_request import StopRequest

PATIENCE_S = 20.0


class FarStore(MemoryStore):
    """A store across a network that can be cut, for all keys or some; counts what it is asked."""

    def __init__(self):
        super().__init__()
        self.asked, self.was_asked = [], threading.Event()
        self.cut = set()
        self.is_gone = False
        self.back = threading.Event()

    def get(self, table, key):
        self.asked.append(key)
        self.was_asked.set()
        if self.is_gone:
            msg = "state postgresql://db.lab/city: no route to host"
            raise StoreError(msg)
        if "all" in self.cut or key.removeprefix("api/") in self.cut:
            assert self.back.wait(2 * PATIENCE_S)
        return super().get(table, key)


@pytest.fixture
def store():
    store = FarStore()
    yield store
    store.back.set()


@pytest.fixture
def ring(store):
    return KeyRing(store)


@pytest.fixture
def clock():
    return StepClock()


@pytest.fixture
def keys(ring, clock):
    return KnownKeys(ring, clock)


@pytest.fixture
def anna(ring):
    return ring.add("anna", "operator", 1)


def find(keys, key):
    return asyncio.run(asyncio.wait_for(keys.find(key), PATIENCE_S))


def find_for_stop(keys, key):
    return asyncio.run(asyncio.wait_for(keys.find_for_stop(key), PATIENCE_S))


def test_the_store_is_asked_once_a_moment(keys, anna, store, clock):
    assert [find(keys, anna).owner for _ in range(5)] == ["anna"] * 5
    assert len(store.asked) == 1
    clock.set_ns(FRESH_NS)
    assert find(keys, anna).owner == "anna"
    assert len(store.asked) == 2


def test_of_a_key_that_is_known_a_wrong_secret_is_nobody_s(keys, anna, store):
    assert find(keys, anna) is not None
    assert find(keys, anna[:-4] + "AAAA") is None
    assert find_for_stop(keys, anna[:-4] + "AAAA").record is None
    assert len(store.asked) == 1


def test_what_is_no_key_is_never_asked_for(keys, store):
    assert find(keys, "wrong") is None
    assert find_for_stop(keys, "").record is None
    assert store.asked == []


def test_a_key_that_is_ended_here_is_nobody_s_at_once(keys, ring, anna):
    assert find(keys, anna) is not None
    ring.revoke(public_part(anna))
    assert find(keys, anna) is None
    assert find_for_stop(keys, anna).record is None


@pytest.mark.parametrize("end", ["lent", "lender's"])
def test_a_lent_key_ends_at_once_with_its_lender_s(keys, ring, anna, end):
    outer = ring.lend(anna, "outer")
    inner = ring.lend(outer, "inner")
    assert find(keys, inner).owner == "anna: outer: inner"
    ring.end_lent(outer) if end == "lent" else ring.revoke(public_part(anna))
    assert find(keys, inner) is None
    assert find_for_stop(keys, inner).record is None


def test_a_key_that_another_process_ends_is_nobody_s_a_moment_later(keys, store, anna, clock):
    assert find(keys, anna) is not None
    KeyRing(store).revoke(public_part(anna))
    clock.set_ns(FRESH_NS)
    assert find(keys, anna) is None
    assert find_for_stop(keys, anna).record is None


def test_who_asks_at_the_same_time_shares_the_answer(keys, ring, anna, store):
    others = [ring.add(f"other {number}", "viewer", 1) for number in range(THREADS)]

    async def ask_together():
        store.cut = {"all"}
        asking = [asyncio.create_task(keys.find(key)) for key in (*others, *[anna] * 10)]
        await asyncio.sleep(0)
        asking[THREADS].cancel()  # its page was closed before its turn: the others wait on
        await asyncio.sleep(0)
        store.back.set()
        found = await asyncio.wait_for(asyncio.gather(*asking[THREADS + 1 :]), PATIENCE_S)
        await asyncio.gather(*asking[:THREADS])
        return found

    assert [found.owner for found in asyncio.run(ask_together())] == ["anna"] * 9
    assert len(store.asked) == THREADS + 1


def test_the_stop_does_not_wait_for_a_store_that_is_silent(keys, anna, store, clock):
    assert find_for_stop(keys, anna).is_sure
    store.cut = {"all"}
    clock.set_ns(FRESH_NS)
    known = find_for_stop(keys, anna)
    assert (known.record.owner, known.is_sure) == ("anna", False)
    store.cut, store.is_gone = set(), True
    store.back.set()
    assert find_for_stop(keys, anna).record.owner == "anna"
    clock.set_ns(FRESH_NS + REMEMBERED_NS)
    with pytest.raises(StoreError):
        find_for_stop(keys, anna)


def test_the_stop_does_not_wait_behind_the_keys_of_others(keys, ring, anna, store):
    others = [ring.add(f"other {number}", "viewer", 1) for number in range(THREADS + 3)]
    store.cut = {public_part(key) for key in others}

    async def press():
        waiting = [asyncio.create_task(keys.find(key)) for key in others]
        try:
            return await asyncio.wait_for(keys.find_for_stop(anna), PATIENCE_S)
        finally:
            store.back.set()
            await asyncio.gather(*waiting)

    known = asyncio.run(press())
    assert (known.record.owner, known.is_sure) == ("anna", True)


class TestServer:
    @pytest.fixture
    def app(self, view, fake_city, city_map, ring):
        fake_city.answers[StopRequest] = CityStop(t_ns=1, engaged=True)
        return create_app(view, fake_city.ask, city_map, keys=ring)

    def test_others_are_served_while_the_store_is_silent(self, app, anna, store):
        store.cut = {"all"}
        answered = []

        async def ask():
            transport = httpx.ASGITransport(app)
            async with httpx.AsyncClient(transport=transport, base_url="http://x") as client:
                bearer = {"Authorization": f"Bearer {anna}"}
                waiting = asyncio.create_task(client.get("/api/v1/vehicles", headers=bearer))
                await asyncio.to_thread(store.was_asked.wait, PATIENCE_S)
                answered.append((await client.get("/healthz")).status_code)
                assert not waiting.done()
                store.back.set()
                answered.append((await waiting).status_code)

        asyncio.run(asyncio.wait_for(ask(), PATIENCE_S))
        assert answered == [200, 200]

    def test_the_stop_is_pressed_without_the_store_and_released_only_with_it(
        self, app, anna, store, client_of, fake_city, monkeypatch
    ):
        monkeypatch.setattr("scm.api.known_keys.FRESH_NS", 0)
        monkeypatch.setattr("scm.api.known_keys.PATIENCE_S", PATIENCE_S)  # this store is quick
        call, bearer = client_of(app), {"Authorization": f"Bearer {anna}"}

        def put(engaged):
            return call("PUT", "/api/v1/stop", json={"engaged": engaged}, headers=bearer)

        assert [put(True).status_code, put(False).status_code] == [200, 200]
        store.is_gone = True
        assert put(True).status_code == 200
        refused = put(False)
        assert (refused.status_code, refused.json()["code"]) == (503, "offline")
        assert [request.engaged for request in fake_city.asked] == [True, False, True]

    def test_a_store_that_fails_is_told_without_its_address(
        self, app, anna, store, client_of, caplog
    ):
        store.is_gone = True
        bearer = {"Authorization": f"Bearer {anna}"}
        answer = client_of(app)("GET", "/api/v1/vehicles", headers=bearer)
        assert (answer.status_code, answer.json()["code"]) == (503, "offline")
        assert "db.lab" not in answer.text
        assert any(line.startswith("keys_not_read") for line in caplog.messages)
