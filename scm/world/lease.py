"""Leases: who may drive a car. Pure rules over frozen records; the caller brings the time.

A car has one owner. The epoch grows with every change of owner and never falls, so a command that
carries an older epoch can be told from a fresh one (a fencing token). A lease ends by release, by
theft (with a reason), or when it was not renewed in time on the receiver's own clock.
"""

from dataclasses import dataclass, replace

from scm.clock import NS_PER_MS
from scm.errors import LeaseError

MIN_TTL_MS = 100  # a shorter one would expire between two renewals
MAX_TTL_MS = 60_000  # a lost owner must not hold a car for longer


@dataclass(frozen=True, slots=True)
class Lease:
    """One car's lease.

    Attributes:
        home: Who owns the car when nobody else does: `world`, or the car's own agent.
        owner: Who owns it now.
        epoch: Of this ownership; only ever grows.
        ttl_ms: How long it lives without renewal.
        expires_ns: When it ends; None: it never does (the home owner's).
    """

    home: str
    owner: str
    epoch: int = 1
    ttl_ms: int = 1000
    expires_ns: int | None = None

    @property
    def is_leased(self) -> bool:
        """Whether somebody other than the home owner holds it."""
        return self.owner != self.home


def grant(home: str, epoch: int = 1) -> Lease:
    """Return the lease of a car that its home owner holds."""
    return Lease(home, home, epoch)


def acquire(lease: Lease, owner: str, ttl_ms: int, now_ns: int) -> Lease:
    """Lease a car that is at home; requesting one's own lease again only renews it.

    A home owner that acquires it gets a newer epoch: its older commands are void.

    Raises:
        LeaseError: when somebody else holds it.
    """
    if owner == lease.owner and lease.is_leased:
        return _extended(lease, ttl_ms, now_ns)
    if lease.is_leased:
        msg = f"the car is leased to {lease.owner!r} (epoch {lease.epoch}); wait, or steal it"
        raise LeaseError(msg)
    return _handed_over(lease, owner, ttl_ms, now_ns)


def renew(lease: Lease, owner: str, epoch: int, ttl_ms: int, now_ns: int) -> Lease:
    """Extend one's own lease.

    Raises:
        LeaseError: when `owner` does not hold it under this epoch.
    """
    _check_holder(lease, owner, epoch)
    return _extended(lease, ttl_ms, now_ns)


def release(lease: Lease, owner: str, epoch: int) -> Lease:
    """Give one's lease back: the car goes home under a new epoch.

    Raises:
        LeaseError: when `owner` does not hold it under this epoch.
    """
    _check_holder(lease, owner, epoch)
    return returned(lease)


def steal(lease: Lease, owner: str, ttl_ms: int, reason: str, now_ns: int) -> Lease:
    """Lease a car although somebody else holds it.

    Raises:
        LeaseError: when no reason is given.
    """
    if not reason.strip():
        msg = f"stealing from {lease.owner!r} needs a reason: it is put into the event log"
        raise LeaseError(msg)
    return _handed_over(lease, owner, ttl_ms, now_ns)


def is_expired(lease: Lease, now_ns: int) -> bool:
    """Return whether it was not renewed in time."""
    return lease.expires_ns is not None and now_ns >= lease.expires_ns


def left_ms(lease: Lease, now_ns: int) -> float | None:
    """Return how long it lives on unless it is renewed; None: it is at home."""
    return None if lease.expires_ns is None else max(0.0, (lease.expires_ns - now_ns) / NS_PER_MS)


def returned(lease: Lease) -> Lease:
    """Return the home owner's lease that follows this one."""
    return grant(lease.home, lease.epoch + 1)


def _check_holder(lease: Lease, owner: str, epoch: int) -> None:
    if (owner, epoch) != (lease.owner, lease.epoch):
        msg = (
            f"{owner!r} does not hold the lease under epoch {epoch}: "
            f"{lease.owner!r} holds it under epoch {lease.epoch}"
        )
        raise LeaseError(msg)


def _extended(lease: Lease, ttl_ms: int, now_ns: int) -> Lease:
    if not lease.is_leased:
        return lease
    ttl_ms = _bounded(ttl_ms)
    return replace(lease, ttl_ms=ttl_ms, expires_ns=now_ns + ttl_ms * NS_PER_MS)


def _handed_over(lease: Lease, owner: str, ttl_ms: int, now_ns: int) -> Lease:
    if owner == lease.home:
        return returned(lease)
    return _extended(replace(lease, owner=owner, epoch=lease.epoch + 1), ttl_ms, now_ns)


def _bounded(ttl_ms: int) -> int:
    return max(MIN_TTL_MS, min(ttl_ms, MAX_TTL_MS))
