"""The audit log: whatever is changed, dropped or put between is found, and named."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scm.errors import StoreError
from scm.store.audit import FIRST, UNREADABLE, AuditLog, Deed, Head
from scm.store.memory import MemoryStore

COUNT = 12


def deed(n):
    return Deed(t_ns=n, station="world", kind="SpawnRequest", by=f"ann{n}", request_id=f"r{n}")


def filled(count=COUNT):
    store = MemoryStore()
    log = AuditLog(store)
    for n in range(count):
        log.note(deed(n))
    return store, log


def test_an_untouched_log_is_verified_and_read_back():
    _, log = filled()
    assert log.verify() == log.head()
    assert log.head().number == COUNT
    assert list(log.deeds(after=10)) == [(11, deed(10)), (12, deed(11))]


def test_an_empty_log_has_an_empty_head():
    assert AuditLog(MemoryStore()).verify() == Head(0, FIRST)


@given(number=st.integers(1, COUNT - 1), at=st.integers(0, 10_000), bit=st.integers(0, 7))
def test_a_changed_bit_is_found_and_the_entry_named(number, at, bit):
    store, log = filled()
    bodies = store._logs["audit"]
    body = bytearray(bodies[number - 1])
    body[at % len(body)] ^= 1 << bit
    bodies[number - 1] = bytes(body)
    broken = number if at % len(body) < 64 else number + 1
    with pytest.raises(StoreError, match=f"entry {broken} does not follow entry {broken - 1} "):
        log.verify()


@given(number=st.integers(1, COUNT - 1))
def test_a_dropped_entry_breaks_the_next_one(number):
    store, log = filled()
    del store._logs["audit"][number - 1]
    with pytest.raises(StoreError, match=f"entry {number} does not follow"):
        log.verify()


def test_a_gap_in_the_numbers_is_named():
    class Gappy(MemoryStore):
        def entries(self, log, after=0, limit=500):
            return [entry for entry in super().entries(log, after, limit) if entry.number != 5]

    store = Gappy()
    log = AuditLog(store)
    for n in range(COUNT):
        log.note(deed(n))
    with pytest.raises(StoreError, match="entry 5 is missing, the next one is 6"):
        log.verify()


def test_a_shortened_log_is_found_by_a_head_that_was_noted_before():
    store, log = filled()
    head = log.head()
    del store._logs["audit"][-3:]
    log.verify()
    with pytest.raises(StoreError, match="entry 10 is missing: 12 were noted"):
        log.verify(head)


def test_a_log_written_anew_is_found_by_a_head_that_was_noted_before():
    _, log = filled()
    head = log.head()
    _, other = filled(0)
    for n in range(COUNT + 3):
        other.note(deed(n + 1))
    other.verify()
    with pytest.raises(StoreError, match="entry 12 is another one"):
        other.verify(head)


@pytest.mark.parametrize(
    "body", [b"rubbish", b"0" * 64 + b'{"t_ns":1', b"0" * 64 + b'{"by":"\xff"}']
)
def test_an_entry_that_cannot_be_read_is_named_and_hides_no_other(body):
    store, log = filled(2)
    store.append("audit", body)
    log.note(deed(3))
    found = [(number, deed.kind) for number, deed in log.deeds()]
    assert [number for number, kind in found if kind == UNREADABLE] == [3]
    assert [number for number, _ in found] == [1, 2, 3, 4]
