"""Junctions as they are shown: every group's colour, when it may change, and what the monitor says.

Times are seconds from now: both clocks, the controller's and ours, cancel out.
"""

from collections.abc import Mapping, Sequence

import msgspec

from scm.api.picture import Held, Picture
from scm.clock import seconds
from scm.maps.model import Junction
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.spat import SignalGroup, Spat

FRESH_S = 1.0


class GroupRow(msgspec.Struct, kw_only=True, frozen=True):
    """One signal group.

    Attributes:
        colour: None while nothing fresh is known.
        min_s: It will not change before; None: not known.
        max_s: It will have changed by then; None: not known.
        likely_s: A forecast between the two, no promise; None: nobody knows.
        likely_confidence: Share of such forecasts that come true within a second, 0 to 1.
    """

    group: str
    colour: str | None
    next_colour: str | None = None
    min_s: float | None = None
    max_s: float | None = None
    likely_s: float | None = None
    likely_confidence: float | None = None


class MonitorRow(msgspec.Struct, kw_only=True, frozen=True):
    """The second channel; `fault` is None while all is well, `age_s` since it was last heard."""

    fault: str | None
    detail: str
    age_s: float


class JunctionRow(msgspec.Struct, kw_only=True, frozen=True):
    """One junction; `fresh` tells whether its controller was heard within the last second."""

    junction: str
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
    )


def _monitor(held: Held[MonitorStatus] | None, now_ns: int) -> MonitorRow | None:
    if held is None:
        return None
    status = held.message
    age_s = round(held.age_s(now_ns), 1)
    return MonitorRow(fault=status.fault, detail=status.detail, age_s=age_s)
