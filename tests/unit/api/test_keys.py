import pytest

from scm.api.keys import KeyRing, public_part, whose
from scm.errors import AccessError, StoreError
from scm.store.memory import MemoryStore
from scm.store.sqlite import SqliteStore


@pytest.fixture
def store():
    return MemoryStore()


@pytest.fixture
def ring(store):
    return KeyRing(store)


def find(ring, key):
    record = ring.record(public_part(key))
    return None if record is None else whose(key, record)


def test_a_key_finds_its_owner_and_role(ring):
    found = find(ring, ring.add("anna", "engineer", 7))
    assert (found.owner, found.role, found.made_s) == ("anna", "engineer", 7)


def test_the_store_holds_no_secret(ring, store):
    secret = ring.add("anna", "viewer", 1).split("_", 2)[2]
    (kept,) = (body for _, body in store.items("credentials"))
    assert secret.encode() not in kept


def test_the_same_secret_under_another_id_is_nobody_s(ring):
    one, other = ring.add("anna", "viewer", 1), ring.add("ben", "admin", 1)
    mixed = f"scm_{other.split('_')[1]}_{one.split('_', 2)[2]}"
    assert find(ring, mixed) is None
    assert whose(one, ring.record(public_part(other))) is None


@pytest.mark.parametrize(
    "key", ["", "scm", "scm_12345678_", "scm_12345678_" + "a" * 43, "scm_../../x_" + "a" * 43]
)
def test_what_is_no_key_finds_nobody(ring, key):
    ring.add("anna", "admin", 1)
    assert find(ring, key) is None


def test_a_key_with_anything_after_it_is_none(ring):
    key = ring.add("anna", "admin", 1)
    assert find(ring, key) is not None
    assert find(ring, key + "\n") is None
    assert whose(key + "\n", ring.record(public_part(key))) is None


def test_a_revoked_key_is_nobody_s_in_any_process(tmp_path):
    here, there = (KeyRing(SqliteStore(tmp_path / "keys.db")) for _ in range(2))
    key = here.add("anna", "admin", 1)
    assert find(there, key) is not None
    there.revoke(key.split("_")[1])
    assert find(here, key) is None
    assert list(here.records()) == []


def test_a_lent_key_is_good_while_its_lender_s_is_and_until_it_is_taken_back(ring):
    key = ring.add("anna", "engineer", 1)
    lent = ring.lend(key, "watch_city")
    found = find(ring, lent)
    assert (found.owner, found.role) == ("anna: watch_city", "engineer")
    assert find(ring, lent[:-1] + ("a" if lent[-1] != "a" else "b")) is None
    ring.end_lent(lent)
    assert find(ring, lent) is None
    assert find(ring, key) is not None
    again = ring.lend(ring.lend(key, "outer"), "inner")
    assert find(ring, again).owner == "anna: outer: inner"
    ring.revoke(key.split("_")[1])
    assert find(ring, again) is None
    with pytest.raises(AccessError, match="later: the key of its requester has ended"):
        ring.lend(key, "later")


def test_a_lent_key_is_kept_nowhere(ring, store):
    key = ring.add("a" * 64, "viewer", 1)
    lent = ring.lend(key, "watch_city")
    assert len(find(ring, lent).owner) == 64
    assert [one.owner for one in ring.records()] == ["a" * 64]
    assert find(KeyRing(store), lent) is None


def test_a_role_that_does_not_exist_and_an_id_nobody_has_are_refused(ring):
    with pytest.raises(AccessError, match=r"role: got 'operater'.*did you mean 'operator'"):
        ring.add("anna", "operater", 1)
    with pytest.raises(AccessError, match="owner"):
        ring.add(" ", "viewer", 1)
    with pytest.raises(AccessError, match="key: got 'nobody'"):
        ring.revoke("nobody")


def test_a_broken_record_says_where_it_is(ring, store):
    store.put("credentials", "api/12345678", b"{}")
    with pytest.raises(StoreError, match="12345678"):
        list(ring.records())
