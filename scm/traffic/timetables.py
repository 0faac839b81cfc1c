"""The timetables of one junction, cycle after cycle, in step with its neighbours."""

from collections.abc import Mapping

from scm.traffic.plan import Timetable
from scm.traffic.promise import Cycle
from scm.traffic.wave import Wave, dwell_ns, dwelling

Tables = Mapping[str, tuple[Timetable, Wave | None]]


class Timetables:
    """What runs now and what may run next; it knows no clock.

    Attributes:
        plan: In force.
        pending: To come with the next cycle; empty: none.
        cycle: That runs.
    """

    def __init__(self, tables: Tables, plan: str) -> None:
        self._tables = tables
        self.plan = plan
        self.pending = ""
        self.clear(0, 0)

    def clear(self, now_ns: int, until_ns: int) -> None:
        """Wish nothing until a time, then begin the first cycle."""
        self._set(Cycle(None, now_ns, until_ns))

    def put_off(self, by_ns: int) -> None:
        """Let the cycle be later, as if time had stood still."""
        cycle = self.cycle
        self._set(Cycle(cycle.timetable, cycle.began_ns + by_ns, cycle.ends_ns + by_ns))

    def next_cycle(self) -> None:
        """Begin the cycle after this one, of the plan that was asked for."""
        self.plan, self.pending = self.pending or self.plan, ""
        began_ns = self.cycle.ends_ns
        table = self._beginning(self.plan, began_ns)
        self._set(Cycle(table, began_ns, began_ns + table.length_ns))

    def wishes(self, now_ns: int) -> frozenset[str]:
        """Return what the timetable wishes."""
        table = self.cycle.timetable
        return table.wishes(now_ns - self.cycle.began_ns) if table else frozenset()

    def next_start_ns(self, group: str) -> int:
        """Return when a group's green begins in the next cycle, of the plan that is to come."""
        coming = dict(zip(self._tables, self.coming, strict=True))[self.pending or self.plan]
        return self.cycle.ends_ns + coming.first_start_ns(group)

    def _beginning(self, plan: str, began_ns: int) -> Timetable:
        """Return a plan's timetable for a cycle that begins at a time."""
        table, wave = self._tables[plan]
        return dwelling(table, dwell_ns(wave, began_ns))

    def _set(self, cycle: Cycle) -> None:
        self.cycle = cycle
        self.coming = [self._beginning(plan, cycle.ends_ns) for plan in self._tables]
