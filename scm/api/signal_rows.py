"""Junctions as they are shown: every group's colour, when it may change, and the monitor's report.

Times are seconds from now: both clocks, the controller's and ours, cancel out.
"""

from collections.abc import Mapping, Sequence

from scm.api.picture import Held, Picture
from scm.clock import seconds
from scm.records.city_map import Junction
from scm.records.signals import (
    GroupRow,
    JunctionRow,
    MonitorRow,
    SignalGroup,
    StatusRow,
)
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.signal_status import SignalStatus
from scm.v2x.messages.spat import Spat

FRESH_S = 1.0


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


def status_rows(picture: Picture) -> tuple[StatusRow, ...]:
    """Return what runs at every junction that has reported."""
    return tuple(status_row(held.message) for held in picture.signal_statuses.values())


def status_row(status: SignalStatus) -> StatusRow:
    """Return what runs at one junction."""
    return StatusRow(**{name: getattr(status, name) for name in StatusRow.__struct_fields__})


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
