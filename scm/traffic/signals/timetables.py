"""The timetables of one junction, cycle after cycle, in step with its neighbours."""

from collections.abc import Mapping

from scm.traffic.signals.forecast import Coming
from scm.traffic.signals.green_wave import Wave, dwell_ns, dwelling
from scm.traffic.signals.guaranteed_time import Cycle, GuaranteedTime, green_end
from scm.traffic.signals.plan import Timetable

Tables = Mapping[str, tuple[Timetable, Wave | None]]


class Timetables:
    """What runs now and what may run next; it knows no clock.

    A custom plan may run from the cycle after the next on: times guaranteed before it came do not
    allow for it. It leaves when it neither runs nor is pending.

    When a cycle's last stage begins it is decided who stays green into the next one. If anybody
    does, its plan is decided too: another one that is requested then comes after it.

    Attributes:
        plan: In force.
        pending: To come with the next cycle; empty: none.
        cycle: That runs.
        staying_green: Who stays green into the next cycle; None: not decided yet.
    """

    def __init__(self, tables: Tables, plan: str) -> None:
        self._own_tables = dict(tables)
        self._tables = dict(tables)
        self._entering_plans: dict[str, tuple[Timetable, Wave | None]] = {}
        self.plan = plan
        self.pending = ""
        self.staying_green: frozenset[str] | None = None
        self._committed_plan = ""
        self.clear(0, 0)

    @property
    def names(self) -> list[str]:
        """The names of all plans that may be requested, custom ones included."""
        return list({**self._tables, **self._entering_plans})

    @property
    def custom_plan(self) -> tuple[Timetable, Wave | None] | None:
        """The plan in force if it is a custom one; None: it is one of the junction's own."""
        return None if self.plan in self._own_tables else self._tables[self.plan]

    @property
    def custom_plans(self) -> Tables:
        """The custom plans that run, are pending or come."""
        known = {**self._tables, **self._entering_plans}
        return {name: pair for name, pair in known.items() if name not in self._own_tables}

    def retime(self, tables: Tables, custom_plans: Tables) -> None:
        """Use other timetables of the same plans; `clear` must follow, with all groups red.

        Args:
            tables: Of the junction's own plans.
            custom_plans: Of those in `custom_plans`.
        """
        self._own_tables = dict(tables)
        self._tables, self._entering_plans = {**tables, **custom_plans}, {}

    def request(self, plan: str) -> None:
        """Make a plan pending for the next cycle, or let it stay."""
        self.pending = "" if plan == self.plan and self._committed_plan in ("", plan) else plan
        if plan == self.plan:
            self._entering_plans.pop(plan, None)

    def offer_custom_plan(self, custom_plan: Timetable, wave: Wave | None) -> None:
        """Add a custom plan and make it pending; it replaces one of the same name."""
        self._entering_plans = {custom_plan.plan: (custom_plan, wave)}
        self.pending = custom_plan.plan

    def clear(self, now_ns: int, until_ns: int) -> None:
        """Request nothing until a time, then begin the first cycle."""
        self._change_custom_plans()
        self._begin(Cycle(None, now_ns, until_ns))

    def put_off(self, by_ns: int) -> None:
        """Delay the cycle, as if time had stood still."""
        cycle = self.cycle
        self._set(Cycle(cycle.timetable, cycle.began_ns + by_ns, cycle.ends_ns + by_ns))

    def next_cycle(self) -> None:
        """Begin the cycle after this one, of the plan that was requested."""
        self.plan = self._next_plan()
        began_ns = self.cycle.ends_ns
        table = self._beginning(self.plan, began_ns)
        self._change_custom_plans()
        self._begin(Cycle(table, began_ns, began_ns + table.length_ns))

    def commit_next(self, now_ns: int, *, goes_on: bool) -> None:
        """Once the last stage has begun, decide who stays green into the next cycle."""
        cycle = self.cycle
        if self.staying_green is not None or cycle.timetable is None:
            return
        if now_ns >= cycle.began_ns + cycle.timetable.timed_stages[-1].start_ns:
            self.staying_green = cycle.timetable.into(self._next()) if goes_on else frozenset()
            self._committed_plan = self._next_plan() if self.staying_green else ""

    def requested(self, now_ns: int) -> frozenset[str]:
        """Return what the timetable requests."""
        table, position_ns = self.cycle.timetable, now_ns - self.cycle.began_ns
        staying = self.staying_green or frozenset()
        return table.requested(position_ns, staying) if table else frozenset()

    def green_end(self, group: str, now_ns: int, least_ns: int) -> GuaranteedTime:
        """Return when a green that is on will end, `least_ns` at the earliest."""
        onward: list[Timetable | None] = [*self.coming, None]
        if self.staying_green is not None:
            onward = [self._next() if group in self.staying_green else None]
        return green_end(group, self.cycle, now_ns, least_ns, onward)

    def likely_end_ns(self, group: str, now_ns: int, *, red: bool) -> int | None:
        """Return when a colour ends under the plan that is to come; None: not in its cycle.

        Args:
            group: Whose.
            now_ns: The present time.
            red: It is red, and there is no green of the group in this cycle any more; or green.
        """
        if red:
            return self.cycle.ends_ns + self._next().first_start_ns(group)
        end = green_end(group, self.cycle, now_ns, now_ns, [self._next()])
        return end.min_end_ns if end.is_exact else None

    def outlook(self, now_ns: int) -> tuple[Coming, ...]:
        """Return the greens that are on or still to come in this cycle, and those of the next."""
        cycle, following = self.cycle, self._next()
        this = cycle.timetable.timed_stages if cycle.timetable is not None else ()
        greens = [
            *((timed, cycle.began_ns) for timed in this if cycle.began_ns + timed.end_ns > now_ns),
            *((timed, cycle.ends_ns) for timed in following.timed_stages),
        ]
        return tuple(
            Coming(timed.groups, began_ns + timed.start_ns, began_ns + timed.end_ns)
            for timed, began_ns in greens
        )

    def _next(self) -> Timetable:
        """Return the next cycle: of the plan to come, or, while that may not yet, of this one."""
        return dict(zip(self._tables, self.coming, strict=True))[self._next_plan()]

    def _next_plan(self) -> str:
        is_ready = self.pending and self.pending not in self._entering_plans
        return self._committed_plan or (self.pending if is_ready else self.plan)

    def _change_custom_plans(self) -> None:
        """Add entering custom plans and drop unused ones; only where no time is guaranteed."""
        if self.pending == self.plan and self.pending not in self._entering_plans:
            self.pending = ""
        entering, self._entering_plans = self._entering_plans, {}
        stay = {
            name: pair
            for name, pair in self._tables.items()
            if name in self._own_tables or name in (self.plan, self.pending)
        }
        self._tables = {**stay, **entering}

    def _beginning(self, plan: str, began_ns: int) -> Timetable:
        """Return a plan's timetable for a cycle that begins at a time."""
        table, wave = self._tables[plan]
        return dwelling(table, dwell_ns(wave, began_ns))

    def _begin(self, cycle: Cycle) -> None:
        self.staying_green, self._committed_plan = None, ""
        self._set(cycle)

    def _set(self, cycle: Cycle) -> None:
        self.cycle = cycle
        self.coming = [self._beginning(plan, cycle.ends_ns) for plan in self._tables]
