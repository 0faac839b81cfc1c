"""Overrides of operators and scripts: accepted or refused with a reason, in force, expiring.

A call is done when its group turns green, a force-off when its group's green has ended; every
override ends when it is cleared or expires.
"""

from collections.abc import Collection, Sequence
from itertools import combinations
from typing import NamedTuple

from scm.clock import NS_PER_S
from scm.errors import PlanError, nearest
from scm.records.signals import LONGEST_S, Verb
from scm.traffic.signals.kernel import Program
from scm.v2x.messages.signal_request import SignalRequest

NEED_RINGS = ("hold", "force_off", "omit", "preempt")


class Override(NamedTuple):
    """One override in force, until `until_ns` at the latest."""

    verb: Verb
    groups: tuple[str, ...]
    by: str
    reason: str
    until_ns: int
    policy: str = ""


def apply(
    active: Sequence[Override],
    request: SignalRequest,
    program: Program,
    policies: Collection[str],
    now_ns: int,
) -> tuple[Override, ...]:
    """Return the overrides in force after a request; a newer one replaces its like.

    Raises:
        PlanError: saying why the request is refused.
    """
    _check(request, program, policies)
    if request.verb == "clear":
        return tuple(one for one in active if not _is_cleared(one, request))
    new = Override(
        request.verb,
        tuple(dict.fromkeys(request.groups)),
        request.by,
        request.reason,
        now_ns + round(request.expires_s * NS_PER_S),
        request.policy,
    )
    is_single = new.verb in ("policy", "preempt")
    like = [
        one
        for one in active
        if one.verb == new.verb and (is_single or set(one.groups) == set(new.groups))
    ]
    all_active = (*(one for one in active if one not in like), new)
    _check_together(all_active, program)
    return all_active


def expire(
    active: Sequence[Override], now_ns: int, began: Collection[str], ended: Collection[str]
) -> tuple[Override, ...]:
    """Return the overrides that are left, given whose green began and whose ended just now."""
    left = []
    for one in active:
        done = began if one.verb == "call" else ended if one.verb == "force_off" else ()
        groups = tuple(group for group in one.groups if group not in done)
        if now_ns < one.until_ns and (groups or not one.groups):
            left.append(one._replace(groups=groups))
    return tuple(left)


def _is_cleared(one: Override, request: SignalRequest) -> bool:
    wanted = set(request.groups)
    return request.clears in ("", one.verb) and (not wanted or bool(wanted & set(one.groups)))


def groups_of(active: Sequence[Override], verb: Verb) -> frozenset[str]:
    """Return all groups that overrides of a verb name."""
    return frozenset(group for one in active if one.verb == verb for group in one.groups)


def applied(
    active: Sequence[Override], requested: frozenset[str], green: frozenset[str], *, holds: bool
) -> frozenset[str]:
    """Return a policy's requests with the overrides, which it may have ignored, applied.

    Args:
        active: The overrides.
        requested: By the policy.
        green: Groups that are green.
        holds: Whether a hold counts: pre-emption goes before it.
    """
    held = groups_of(active, "hold") & green
    omitted = groups_of(active, "omit") - green
    return requested - omitted | (held if holds else frozenset())


def _check(request: SignalRequest, program: Program, policies: Collection[str]) -> None:
    where = f"junction {request.junction}: {request.verb}"
    for group in request.groups:
        if group not in program.groups:
            hint = nearest(group, list(program.groups))
            msg = f"{where}: no group {group!r}{hint}, only {list(program.groups)}"
            raise PlanError(msg)
    if not request.by.strip():
        raise PlanError(f"{where}: by: got nothing, expected who wishes it")
    if not 0.0 < request.expires_s <= LONGEST_S:
        got = request.expires_s
        raise PlanError(f"{where}: expires_s: got {got}, expected above 0, {LONGEST_S:g} at most")
    if request.verb == "policy":
        if request.policy not in policies:
            hint = nearest(request.policy, list(policies))
            msg = f"{where}: no policy {request.policy!r}{hint}, only {sorted(policies)}"
            raise PlanError(msg)
    elif request.verb == "preempt" and len(request.groups) != 1:
        raise PlanError(f"{where}: groups: got {len(request.groups)}, expected one")
    elif request.verb != "clear" and not request.groups:
        raise PlanError(f"{where}: groups: got none, expected some of {list(program.groups)}")


def _check_together(active: Sequence[Override], program: Program) -> None:
    omitted = groups_of(active, "omit")
    if omitted >= set(program.groups):
        raise PlanError("omit: all groups would be left out, expected one to be served at least")
    for one, other in combinations(sorted(groups_of(active, "hold")), 2):
        if frozenset((one, other)) in program.conflicts:
            msg = f"hold: {one!r} and {other!r} conflict: they can never be held together"
            raise PlanError(msg)
    both = omitted & (groups_of(active, "hold") | groups_of(active, "preempt"))
    if both:
        msg = f"{', '.join(sorted(both))}: wished green and left out at once; clear one of the two"
        raise PlanError(msg)
