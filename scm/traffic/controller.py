"""One junction's controller: the kernel, the plan that wishes, and what is told of both.

It starts all red, runs cycles of a plan, and takes another plan when a cycle ends. As long as
anybody has a reason for flash it flashes red; then it starts again through all red.
"""

from dataclasses import dataclass

from scm.errors import PlanError, nearest
from scm.traffic import kernel
from scm.traffic.kernel import Phase, Program
from scm.traffic.plan import FLASH, load_timetable, plan_names
from scm.traffic.program import STEP_NS
from scm.traffic.promise import Cycle, Promise, end_after, green_end, red_end
from scm.v2x.messages.spat import Colour, SignalGroup, Spat

LATE_NS = 3 * STEP_NS

_COLOUR: dict[Phase, Colour] = {
    Phase.RED: "red",
    Phase.CLEARANCE: "red",
    Phase.GREEN: "green",
    Phase.YELLOW: "yellow",
    Phase.FLASH: "flashing_red",
}
_NEXT: dict[Colour, Colour] = {
    "red": "green",
    "green": "yellow",
    "yellow": "red",
    "flashing_red": "red",
}


@dataclass(slots=True)
class _Shown:
    """What one group shows, since when, and what was promised when it began."""

    colour: Colour
    since_ns: int
    promise: Promise


class Controller:
    """The signals of one junction; step it with the time, it never asks for it.

    Attributes:
        plan: In force, also while flashing.
        pending: Asked for, to come with the next cycle; empty: none.
        mode: `start`, `plan` or `flash`.
        changed: Whether the last step changed a colour.
        late_steps: How often time came in too large a piece, and the cycle was put off by it.
    """

    def __init__(self, junction: str, program: Program, plan: str, revision: int = 1) -> None:
        self.junction = junction
        self._program = program
        self._revision = revision
        self._tables = {name: load_timetable(name, program) for name in plan_names()}
        self.plan = self._known(plan)
        self.pending = ""
        self.mode = "start"
        self.changed = False
        self.late_steps = 0
        self._flash_reasons: set[str] = set()
        self._state = kernel.start(program)
        self._shown: dict[str, _Shown] = {}
        self._cycle = Cycle(None, 0, 0)
        self._last_ns: int | None = None
        self._seq = 0
        self._restart_ns = max(times.clearance for times in program.times) + STEP_NS

    @property
    def is_flashing(self) -> bool:
        """Whether there is a reason to flash, from the next step on."""
        return bool(self._flash_reasons)

    def ask(self, plan: str) -> None:
        """Wish for a plan from the next cycle on.

        Raises:
            PlanError: when there is no such plan.
        """
        self.pending = "" if self._known(plan) == self.plan else plan

    def flash(self, reason: str, *, on: bool) -> None:
        """Give or take back a reason to flash; it ends when the last reason is gone."""
        if on:
            self._flash_reasons.add(reason)
        else:
            self._flash_reasons.discard(reason)

    def step(self, now_ns: int) -> None:
        """Go on to `now_ns`."""
        dt_ns = self._take_time(now_ns)
        if self._flash_reasons:
            self.mode = FLASH
            wishes: frozenset[str] = frozenset()
        else:
            wishes = self._wishes(now_ns)
        self._state = kernel.step(
            self._program, self._state, wishes, dt_ns, flash=self.mode == FLASH
        )
        self._show(now_ns)

    def spat(self, now_ns: int) -> Spat:
        """Return what is shown, for the step that was just made."""
        self._seq += 1
        return Spat(
            junction=self.junction,
            t_ns=now_ns,
            seq=self._seq,
            mode=self.mode,
            plan=self.plan,
            groups=tuple(self._tell(name, shown) for name, shown in self._shown.items()),
            revision=self._revision,
        )

    def _known(self, plan: str) -> str:
        if plan not in self._tables:
            names = [*self._tables, FLASH]
            msg = f"junction {self.junction}: no plan {plan!r}{nearest(plan, names)}, only {names}"
            raise PlanError(msg)
        return plan

    def _take_time(self, now_ns: int) -> int:
        """Return the time since the last step; what is far too much of it puts the cycle off."""
        if self._last_ns is None:
            self._last_ns = now_ns
            self._begin_again(now_ns)
        dt_ns = now_ns - self._last_ns
        self._last_ns = now_ns
        if dt_ns > LATE_NS:
            self.late_steps += 1
            off_ns = dt_ns - STEP_NS
            cycle = self._cycle
            self._cycle = Cycle(cycle.timetable, cycle.began_ns + off_ns, cycle.ends_ns + off_ns)
        return dt_ns

    def _begin_again(self, now_ns: int) -> None:
        self.mode = "start"
        self._cycle = Cycle(None, now_ns, now_ns + self._restart_ns)

    def _wishes(self, now_ns: int) -> frozenset[str]:
        if self.mode == FLASH:
            self._begin_again(now_ns)
        if now_ns >= self._cycle.ends_ns:
            self._next_cycle()
        table = self._cycle.timetable
        return table.wishes(now_ns - self._cycle.began_ns) if table else frozenset()

    def _next_cycle(self) -> None:
        self.mode = "plan"
        self.plan, self.pending = self.pending or self.plan, ""
        table = self._tables[self.plan]
        began_ns = self._cycle.ends_ns
        self._cycle = Cycle(table, began_ns, began_ns + table.length_ns)

    def _show(self, now_ns: int) -> None:
        self.changed = False
        for index, name in enumerate(self._program.groups):
            colour = _COLOUR[self._state[index].phase]
            before = self._shown.get(name)
            if before is None or before.colour != colour:
                self.changed = True
                promise = self._promise(index, colour, now_ns)
                self._shown[name] = _Shown(colour, now_ns, promise)
            elif colour == "red":
                before.promise = self._promise(index, colour, now_ns)

    def _promise(self, index: int, colour: Colour, now_ns: int) -> Promise:
        name, times = self._program.groups[index], self._program.times[index]
        match colour:
            case "red":
                return red_end(name, self._cycle, now_ns, self._tables.values())
            case "green":
                return green_end(name, self._cycle, now_ns, times.min_green)
            case "yellow":
                return end_after(now_ns + times.yellow)
            case _:
                return Promise(now_ns, None)

    def _tell(self, name: str, shown: _Shown) -> SignalGroup:
        return SignalGroup(
            group=name,
            colour=shown.colour,
            since_ns=shown.since_ns,
            min_end_ns=shown.promise.min_end_ns,
            max_end_ns=shown.promise.max_end_ns,
            next_colour=_NEXT[shown.colour],
        )
