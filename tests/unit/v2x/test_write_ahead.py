"""Keepers: all of a step or nothing, in order, once, and never in the way of the next step."""

import threading

import pytest

from scm.errors import StoreError
from scm.store.audit import AuditLog, Deed
from scm.store.memory import MemoryStore
from scm.v2x import write_ahead
from scm.v2x.write_ahead import BackgroundWriter, Batch, DirectWriter

PATIENCE_S = 20.0


class Sick(MemoryStore):
    """A store that fails when told to: before it commits, or just after, when nobody knows."""

    def __init__(self):
        super().__init__()
        self.sickness = ""

    def transaction(self):
        return _Sick(self, super().transaction())


class _Sick:
    def __init__(self, store, healthy):
        self.store, self.healthy = store, healthy

    def __enter__(self):
        self.outermost = self.store._depth == 0
        if self.outermost and self.store.sickness == "before":
            msg = "the disk is full"
            raise StoreError(msg)
        return self.healthy.__enter__()

    def __exit__(self, *exc):
        result = self.healthy.__exit__(*exc)
        if exc[0] is None and self.outermost and self.store.sickness == "after":
            msg = "the line broke"
            raise StoreError(msg)
        return result


def batch(n):
    return Batch([("leases", f"k{n}", b"v")], [Deed(t_ns=n, station="w", kind="K")], [])


@pytest.fixture(params=[DirectWriter, BackgroundWriter])
def kind(request):
    return request.param


@pytest.fixture
def store():
    return Sick()


def looks():
    """Yield while there is patience, with a pause after each look."""
    for _ in range(round(PATIENCE_S / 0.01)):
        yield
        threading.Event().wait(0.01)


def safe(keeper, count):
    """Return what is safe, as soon as that are `count` batches."""
    found = []
    for _ in looks():
        found += keeper.written()
        if len(found) >= count:
            return found
    raise AssertionError(f"only {len(found)} of {count} are safe")


def test_batches_are_safe_in_their_order_with_all_they_hold(kind, store):
    keeper = kind(store, "world", "s1")
    batches = [batch(n) for n in range(20)]
    for one in batches:
        keeper.write(one)
    assert safe(keeper, 20) == batches
    assert [key for key, _ in store.items("leases")] == sorted(f"world/k{n}" for n in range(20))
    assert [deed.t_ns for _, deed in AuditLog(store).deeds()] == list(range(20))
    keeper.close()


def test_while_the_store_fails_nothing_is_stored_and_the_reason_is_given(kind, store):
    keeper = kind(store, "world", "s1")
    store.sickness = "before"
    keeper.write(batch(1))
    for _ in looks():
        assert keeper.written() == []
        if keeper.stuck:
            break
    assert keeper.stuck == "world cannot store its state now: the disk is full"
    store.sickness = ""
    assert len(safe(keeper, 1)) == 1
    assert keeper.stuck == ""
    keeper.close()


def test_a_commit_with_an_unknown_outcome_is_not_repeated(kind, store):
    keeper = kind(store, "world", "s1")
    store.sickness = "after"
    keeper.write(batch(1))
    for _ in looks():
        keeper.written()
        if keeper.stuck:
            break
    store.sickness = ""
    keeper.write(batch(2))
    safe(keeper, 2)
    assert [deed.t_ns for _, deed in AuditLog(store).deeds()] == [1, 2]
    keeper.close()


def test_what_waits_is_stored_before_the_end(kind, store, monkeypatch):
    monkeypatch.setattr(write_ahead, "CLOSE_S", PATIENCE_S)
    keeper = kind(store, "world", "s1")
    keeper.write(batch(1))
    keeper.close()
    assert len(keeper.written()) == 1


def test_an_end_is_not_kept_waiting_by_a_store_that_fails(store):
    keeper = BackgroundWriter(store, "world", "s1")
    store.sickness = "before"
    keeper.write(batch(1))
    keeper.close()
    keeper._thread.join(PATIENCE_S)
    assert not keeper._thread.is_alive()
    assert keeper.written() == []


def test_a_mistake_of_ours_on_the_thread_reaches_the_part(store):
    keeper = BackgroundWriter(store, "world", "s1")
    keeper.write(Batch([("no such table", "k", b"v")], [], []))
    keeper._thread.join(PATIENCE_S)
    with pytest.raises(KeyError):
        keeper.written()
