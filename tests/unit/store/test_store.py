"""One contract for every store: in memory, in a file, on a server."""

import threading
from functools import partial

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from scm.errors import StoreError
from scm.store.open import open_store
from scm.store.repository import LOGS, TABLES

KINDS = ["memory", "sqlite", "postgres"]


@pytest.fixture(params=KINDS)
def url(request, tmp_path):
    if request.param == "memory":
        return "memory:"
    if request.param == "sqlite":
        return f"sqlite:{tmp_path / 'city.db'}"
    return request.getfixturevalue("database")


@pytest.fixture
def store(url):
    store = open_store(url)
    yield store
    store.close()


@pytest.fixture(params=KINDS[1:])
def lasting(request, tmp_path):
    if request.param == "sqlite":
        return f"sqlite:{tmp_path / 'city.db'}"
    return request.getfixturevalue("database")


def fails(store, work):
    """Do some work in a transaction that then fails."""

    def attempt():
        with store.transaction():
            work()
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        attempt()


def both(store, key, value):
    store.put("leases", key, value)
    store.append("audit", value)


def test_a_value_is_found_under_its_key_and_nowhere_else(store):
    store.put("leases", "n1", b"\x00\xff one")
    assert store.get("leases", "n1") == b"\x00\xff one"
    assert store.get("leases", "n2") is None
    assert store.get("plans", "n1") is None


@pytest.mark.parametrize("table", TABLES)
def test_every_table_takes_and_forgets_values(store, table):
    store.put(table, "k", b"1")
    store.put(table, "k", b"2")
    assert store.get(table, "k") == b"2"
    store.delete(table, "k")
    store.delete(table, "k")
    assert store.get(table, "k") is None


def test_items_come_sorted_by_key_byte_by_byte(store):
    for key in ("b", "B", "a-1", "a", "a/1", "é"):
        store.put("leases", key, key.encode())
    assert [key for key, _ in store.items("leases")] == ["B", "a", "a-1", "a/1", "b", "é"]
    assert all(value == key.encode() for key, value in store.items("leases"))


@pytest.mark.parametrize("log", LOGS)
def test_a_log_numbers_its_entries_from_one_and_gives_them_page_by_page(store, log):
    assert store.last(log) is None
    assert [store.append(log, b"%d" % n) for n in range(5)] == [1, 2, 3, 4, 5]
    assert store.entries(log, after=1, limit=2) == [(2, b"1"), (3, b"2")]
    assert store.entries(log, after=5) == []
    assert store.last(log) == (5, b"4")


def test_a_transaction_that_fails_leaves_nothing_and_uses_up_no_number(store):
    store.put("leases", "n1", b"old")

    def work():
        store.put("leases", "n1", b"new")
        store.delete("leases", "n1")
        store.append("audit", b"x")

    fails(store, work)
    assert store.get("leases", "n1") == b"old"
    assert store.append("audit", b"y") == 1


def test_what_is_inside_a_transaction_reads_its_own_writes(store):
    with store.transaction():
        store.put("leases", "n1", b"new")
        assert store.get("leases", "n1") == b"new"
        assert store.append("audit", b"x") == 1
        assert store.last("audit") == (1, b"x")


def test_a_transaction_inside_another_one_stands_or_falls_with_it(store):
    def work():
        with store.transaction():
            store.put("leases", "n1", b"inner")

    fails(store, work)
    assert store.get("leases", "n1") is None


def test_after_it_is_closed_a_store_says_so(store):
    store.close()
    store.close()
    with pytest.raises(StoreError, match="closed"):
        store.get("leases", "n1")


def test_several_threads_share_one_connection(store):
    def work(name):
        for n in range(20):
            with store.transaction():
                before = int(store.get("marks", "count") or b"0")
                store.put("marks", "count", b"%d" % (before + 1))
                store.append("audit", f"{name}{n}".encode())

    threads = [threading.Thread(target=work, args=(name,)) for name in "abc"]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert store.get("marks", "count") == b"60"
    assert [entry.number for entry in store.entries("audit")] == list(range(1, 61))


def test_what_was_written_is_there_when_it_is_opened_again(lasting):
    first = open_store(lasting)
    first.put("plans", "x1", b"busy")
    first.append("audit", b"x")
    first.close()
    again = open_store(lasting)
    assert again.get("plans", "x1") == b"busy"
    assert again.entries("audit") == [(1, b"x")]
    again.close()


def test_two_who_use_one_store_take_turns(lasting):
    stores = [open_store(lasting) for _ in range(2)]

    def work(store):
        for _ in range(25):
            with store.transaction():
                before = int(store.get("marks", "count") or b"0")
                store.put("marks", "count", b"%d" % (before + 1))
                store.append("audit", b"x")

    threads = [threading.Thread(target=work, args=(store,)) for store in stores]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert stores[0].get("marks", "count") == b"50"
    assert stores[1].last("audit").number == 50
    for store in stores:
        store.close()


KEYS = st.sampled_from(["a", "b", "c"])
STEPS = st.lists(
    st.one_of(
        st.tuples(st.just("put"), KEYS, st.binary(max_size=4)),
        st.tuples(st.just("delete"), KEYS),
        st.tuples(st.just("append"), st.binary(max_size=4)),
        st.tuples(st.just("fail"), KEYS, st.binary(max_size=4)),
    ),
    max_size=20,
)


@settings(
    max_examples=30,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
@given(steps=STEPS)
def test_any_history_leaves_what_a_dictionary_and_a_list_would_hold(store, steps):
    for key in "abc":
        store.delete("leases", key)
    begin = store.last("audit")
    after = begin.number if begin else 0
    values, entries = {}, []
    for step in steps:
        match step:
            case "put", key, value:
                store.put("leases", key, value)
                values[key] = value
            case "delete", key:
                store.delete("leases", key)
                values.pop(key, None)
            case "append", body:
                store.append("audit", body)
                entries.append(body)
            case "fail", key, value:
                fails(store, partial(both, store, key, value))
    assert dict(store.items("leases")) == values
    assert [entry.body for entry in store.entries("audit", after)] == entries


@pytest.mark.parametrize("url", ["", "city.db", "mysql://x", "sqlite:"])
def test_a_url_that_means_no_store_is_refused_with_what_was_expected(url):
    with pytest.raises(StoreError, match="expected sqlite:PATH, postgresql://"):
        open_store(url)
