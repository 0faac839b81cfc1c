"""Who may drive: epochs only grow, and only the holder renews or releases."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scm.clock import NS_PER_MS
from scm.errors import LeaseError
from scm.world import lease as rules


def test_a_free_car_is_leased_under_a_new_epoch():
    free = rules.grant("world")
    held = rules.acquire(free, "ann", 1000, now_ns=5)
    assert (held.owner, held.epoch, held.expires_ns) == ("ann", 2, 5 + 1000 * NS_PER_MS)


def test_a_leased_car_is_refused_to_another_with_the_holders_name():
    held = rules.acquire(rules.grant("world"), "ann", 1000, 0)
    with pytest.raises(LeaseError, match="'ann'"):
        rules.acquire(held, "bob", 1000, 1)


def test_acquiring_ones_own_lease_again_keeps_the_epoch_and_extends_it():
    held = rules.acquire(rules.grant("world"), "ann", 1000, 0)
    again = rules.acquire(held, "ann", 1000, 500)
    assert again.epoch == held.epoch
    assert again.expires_ns == held.expires_ns + 500


def test_a_lease_not_renewed_expires_at_its_time_and_not_before():
    held = rules.acquire(rules.grant("world"), "ann", 200, 0)
    assert not rules.is_expired(held, 200 * NS_PER_MS - 1)
    assert rules.is_expired(held, 200 * NS_PER_MS)


def test_the_home_owners_lease_never_expires():
    assert not rules.is_expired(rules.grant("world"), 10**18)


def test_renewing_under_an_older_epoch_is_refused():
    first = rules.acquire(rules.grant("world"), "ann", 1000, 0)
    second = rules.acquire(rules.release(first, "ann", first.epoch), "ann", 1000, 1)
    with pytest.raises(LeaseError, match=f"epoch {first.epoch}"):
        rules.renew(second, "ann", first.epoch, 1000, 2)


def test_only_the_holder_may_release():
    held = rules.acquire(rules.grant("world"), "ann", 1000, 0)
    with pytest.raises(LeaseError, match="'bob' does not hold"):
        rules.release(held, "bob", held.epoch)


def test_stealing_without_a_reason_is_refused():
    held = rules.acquire(rules.grant("world"), "ann", 1000, 0)
    with pytest.raises(LeaseError, match="reason"):
        rules.steal(held, "bob", 1000, "  ", 1)


def test_stealing_with_a_reason_changes_owner_and_epoch():
    held = rules.acquire(rules.grant("world"), "ann", 1000, 0)
    stolen = rules.steal(held, "bob", 1000, "ann sleeps", 1)
    assert (stolen.owner, stolen.epoch) == ("bob", held.epoch + 1)


def test_a_lease_asked_for_no_time_lives_the_shortest_allowed():
    held = rules.acquire(rules.grant("world"), "ann", 0, 0)
    assert held.ttl_ms == rules.MIN_TTL_MS


@given(st.lists(st.tuples(st.sampled_from("arsh"), st.sampled_from(["ann", "bob", "world"]))))
def test_the_epoch_never_falls_and_changes_with_every_change_of_owner(steps):
    lease = rules.grant("world")
    for now, (verb, who) in enumerate(steps):
        before = lease
        try:
            if verb == "a":
                lease = rules.acquire(lease, who, 1000, now)
            elif verb == "r":
                lease = rules.release(lease, who, lease.epoch)
            elif verb == "s":
                lease = rules.steal(lease, who, 1000, "because", now)
            else:
                lease = rules.returned(lease)
        except LeaseError:
            assert lease is before
        assert lease.epoch >= before.epoch
        if lease.owner != before.owner:
            assert lease.epoch > before.epoch
