"""Junctions as they are shown: every group's colour, when it may change, and what the monitor says.

Times are seconds from now: both clocks, the controller's and ours, cancel out.
"""

from collections.abc import Mapping, Sequence

import msgspec

from scm.api.picture import Held, Picture
from scm.clock import seconds
from scm.records.city_map import Junction
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.plan_request import SignalStage
from scm.v2x.messages.signal_request import SignalWish
from scm.v2x.messages.signal_status import SignalDetector, SignalStatus, SignalTurn
from scm.v2x.messages.spat import SignalGroup, Spat

FRESH_S = 1.0


class GroupRow(msgspec.Struct, kw_only=True, frozen=True):
    """One signal group.

    Attributes:
        colour: None while nothing fresh is known.
        min_s: It will not change before; None: not known.
        max_s: It will have changed by then; None: not known.
        likely_s: It will likely change then: a forecast, no promise; None: nobody knows.
        likely_confidence: Share of such forecasts that come true within a second, 0 to 1.
        since_ns: When this colour began, on the controller's clock.
    """

    group: str
    colour: str | None
    next_colour: str | None = None
    min_s: float | None = None
    max_s: float | None = None
    likely_s: float | None = None
    likely_confidence: float | None = None
    since_ns: int | None = None


class MonitorRow(msgspec.Struct, kw_only=True, frozen=True):
    """The second channel; `fault` is None while all is well, `age_s` since it was last heard."""

    fault: str | None
    detail: str
    age_s: float


class JunctionRow(msgspec.Struct, kw_only=True, frozen=True):
    """One junction; `fresh` tells whether its controller was heard within the last second.

    Attributes:
        t_ns: The controller's clock now; None: it was never heard.
    """

    junction: str
    t_ns: int | None
    fresh: bool
    mode: str | None
    plan: str | None
    plans: tuple[str, ...]
    groups: tuple[GroupRow, ...]
    monitor: MonitorRow | None


def junction_rows(
    picture: Picture, junctions: Sequence[Junction], plans: Mapping[str, Sequence[str]]
) -> tuple[JunctionRow, ...]:
    """Return all junctions of the map, in its order; `plans` are the names each one offers."""
    return tuple(
        _row(
            junction,
            picture.spats.get(junction.name),
            picture.monitors.get(junction.name),
            plans.get(junction.name, ()),
            picture.now_ns,
        )
        for junction in junctions
    )


class StatusRow(msgspec.Struct, kw_only=True, frozen=True):
    """What runs at a junction and who wants what, on its controller's clock.

    Attributes:
        pending: Plan or policy to come at the next safe moment; empty: none.
        detectors: Of its groups; none: nobody listens for cars now.
        turns: Greens on and to come; none: nobody knows.
        failure: Why a policy was given up for fixed time; empty: none was.
        stages, offset_s: Of the plan in force, where somebody made it: as it runs, whatever it was
            edited to since. No stages: it is one of the junction's own.
    """

    junction: str
    policy: str
    plan: str
    pending: str
    wishes: tuple[SignalWish, ...]
    detectors: tuple[SignalDetector, ...]
    turns: tuple[SignalTurn, ...]
    failure: str
    stages: tuple[SignalStage, ...]
    offset_s: float | None


def status_rows(picture: Picture) -> tuple[StatusRow, ...]:
    """Return what runs at every junction that was heard."""
    return tuple(status_row(held.message) for held in picture.signal_statuses.values())


def status_row(status: SignalStatus) -> StatusRow:
    """Return what runs at one junction."""
    return StatusRow(
        junction=status.junction,
        policy=status.policy,
        plan=status.plan,
        pending=status.pending,
        wishes=status.wishes,
        detectors=status.detectors,
        turns=status.turns,
        failure=status.failure,
        stages=status.stages,
        offset_s=status.offset_s,
    )


def _row(
    junction: Junction,
    spat: Held[Spat] | None,
    monitor: Held[MonitorStatus] | None,
    plans: Sequence[str],
    now_ns: int,
) -> JunctionRow:
    fresh = spat is not None and spat.age_s(now_ns) <= FRESH_S
    shown = {group.group: group for group in spat.message.groups} if spat is not None else {}
    names = {junction.plan, *plans, *([spat.message.plan] if spat is not None else [])} - {"flash"}
    return JunctionRow(
        junction=junction.name,
        t_ns=spat.message.t_ns + now_ns - spat.arrived_ns if spat is not None else None,
        fresh=fresh,
        mode=spat.message.mode if spat is not None else None,
        plan=spat.message.plan if spat is not None else None,
        plans=(*sorted(names - {""}), "flash"),
        groups=tuple(
            _group(group.name, shown.get(group.name) if fresh else None, spat, now_ns)
            for group in junction.groups
        ),
        monitor=_monitor(monitor, now_ns),
    )


def _group(name: str, group: SignalGroup | None, spat: Held[Spat] | None, now_ns: int) -> GroupRow:
    if group is None or spat is None:
        return GroupRow(group=name, colour=None)
    past_s = spat.age_s(now_ns)
    flashing = group.colour in ("flashing_red", "dark")

    def left_s(end_ns: int | None) -> float | None:
        if end_ns is None or flashing:
            return None
        return round(max(0.0, seconds(end_ns - spat.message.t_ns) - past_s), 2)

    return GroupRow(
        group=name,
        colour=group.colour,
        next_colour=group.next_colour,
        min_s=left_s(group.min_end_ns),
        max_s=left_s(group.max_end_ns),
        likely_s=left_s(group.likely_end_ns),
        likely_confidence=None if flashing else group.likely_confidence,
        since_ns=group.since_ns,
    )


def _monitor(held: Held[MonitorStatus] | None, now_ns: int) -> MonitorRow | None:
    if held is None:
        return None
    status = held.message
    age_s = round(held.age_s(now_ns), 1)
    return MonitorRow(fault=status.fault, detail=status.detail, age_s=age_s)
