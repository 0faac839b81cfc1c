"""The table of stations: who is there, who was lost lately, and the status that each reports."""

from collections import deque

import msgspec

from scm.clock import NS_PER_S, seconds
from scm.records.stations import StationRow
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.presence import Presence

LOST_SHOWN_NS = 60 * NS_PER_S
LATELY_NS = 60 * NS_PER_S
_Key = tuple[str, str, str]


class StationTable:
    """Stations by role, name and session; a lost one stays listed for 60 s."""

    def __init__(self) -> None:
        self._rows: dict[_Key, StationRow] = {}
        self._status: dict[str, deque[tuple[PartStatus, int]]] = {}

    def presence(self, seen: Presence, now_ns: int) -> None:
        """Note that a station came, or went."""
        key = (seen.role, seen.station, seen.session)
        known = self._rows.get(key)
        if seen.alive:
            since_ns = known.since_ns if known is not None and known.alive else now_ns
            self._rows[key] = StationRow(
                role=seen.role,
                name=seen.station,
                session=seen.session,
                alive=True,
                since_ns=since_ns,
            )
        elif known is not None and known.alive:
            self._rows[key] = msgspec.structs.replace(known, alive=False, lost_ns=now_ns)

    def status(self, status: PartStatus, now_ns: int) -> None:
        """Note a station's own report."""
        reports = self._status.setdefault(status.station, deque())
        if reports and (status.steps, status.dropped) < (
            reports[-1][0].steps,
            reports[-1][0].dropped,
        ):
            reports.clear()  # it was started again, and counts from nought
        reports.append((status, now_ns))
        while len(reports) > 2 and reports[1][1] <= now_ns - LATELY_NS:
            reports.popleft()

    def forget(self, now_ns: int) -> None:
        """Drop those lost for more than 60 s, and what was last received from them."""
        for key, row in list(self._rows.items()):
            if row.lost_ns is not None and now_ns - row.lost_ns > LOST_SHOWN_NS:
                del self._rows[key]
        names = {row.name for row in self._rows.values()}
        for name, reports in list(self._status.items()):
            if name not in names and now_ns - reports[-1][1] > LOST_SHOWN_NS:
                del self._status[name]

    def rows(self, now_ns: int) -> tuple[StationRow, ...]:
        """Return the table: parts first, then vehicles, then clients, by name."""
        order = {"part": 0, "v": 1}
        rows = [self._with_status(row, now_ns) for row in self._rows.values()]
        rows.sort(key=lambda row: (order.get(row.role, 2), row.name, row.since_ns, row.session))
        return tuple(rows)

    def _with_status(self, row: StationRow, now_ns: int) -> StationRow:
        if row.name not in self._status:
            return row
        (first, _), (status, arrived_ns) = self._status[row.name][0], self._status[row.name][-1]
        return msgspec.structs.replace(
            row,
            age_s=round(seconds(now_ns - arrived_ns), 1),
            detail=status.detail,
            step_ms=round(status.step_ms, 2),
            late_steps=status.late_steps,
            late_share=_late_share(first, status),
            dropped=status.dropped,
            dropped_lately=status.dropped - first.dropped,
        )


def _late_share(first: PartStatus, last: PartStatus) -> float | None:
    """Return the share of the steps due between two reports that was left out."""
    made, late = last.steps - first.steps, last.late_steps - first.late_steps
    return round(late / (made + late), 3) if made > 0 and late >= 0 else None
