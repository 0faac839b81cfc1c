"""The signal monitor of one junction: checks shown colours and latches the first fault.

    conflict, dual, dark, card   on 2 samples, the second within 666 ms of the first: latched after
                                 0.1 s at 10 Hz; one sample alone may be a broken message
    short_green, short_yellow, short_clearance, skipped_yellow, sequence    at once
    stale                        no new sample for more than 500 ms; a repeated one is not new
    overload                     the same, while the monitor itself waited for a processor
    clock_jump                   time stamps that go back, or run ahead by more than 500 ms

`dual` is two colours for one group, `dark` none or dark, `card` a group missing from the conflict
table. Each duration is the longest it can have been: from the sample before it began to the sample
that ended it, so lost samples never cause a fault. A fault stays until `reset`. Two end by
themselves: the first silence of a controller that was never seen, and an overload after 5 s
without another gap. A silence of 5 s is `stale` however busy the computer is.

Pattern: conflict monitors of signal cabinets (NEMA TS 2), with times for this city: real ones must
ignore 200 ms and must act at 450 ms because relays bounce; messages do not.
"""

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from scm.clock import NS_PER_MS
from scm.records.signals import Colour
from scm.traffic.monitor.conflict_table import ConflictTable
from scm.v2x.messages.spat import Spat

MAX_SILENCE_NS = 500 * NS_PER_MS  # five samples of a controller in a row
MAX_FIRST_SILENCE_NS = 5_000 * NS_PER_MS  # a controller that was never seen may still be starting
CONFIRM_WITHIN_NS = 666 * NS_PER_MS  # one sample alone may be a broken message
MAX_CLOCK_LEAD_NS = 500 * NS_PER_MS  # further ahead, the controller's clock has jumped
MAX_TICK_GAP_NS = 300 * NS_PER_MS  # a monitor that slept for longer cannot judge silence
MAX_OVERLOAD_SILENCE_NS = 5_000 * NS_PER_MS  # no overload excuses a longer silence
OVERLOAD_CLEARS_NS = 5_000 * NS_PER_MS  # without a gap
MIN_WAIT_SHARE = 0.1  # of a silence, to be an overload; an idle computer waits for less than 0.01
OVERLOAD = "overload"

_GOING = ("green", "yellow")
_MAY_GO = (*_GOING, "flashing_red")
_MAY_FOLLOW: dict[Colour, tuple[Colour, ...]] = {
    "red": ("green", "flashing_red"),
    "green": ("yellow", "flashing_red"),
    "yellow": ("red", "flashing_red"),
    "flashing_red": ("red",),
}


@dataclass(slots=True)
class _Group:
    """What the monitor saw of one group.

    Attributes:
        seen_ns: Stamp of the last sample with this colour.
        other_ns: Stamp of the last sample with another colour; None: always this one.
        going_ns: Stamp of the last sample in which cars might go; None: never.
    """

    colour: Colour
    seen_ns: int
    other_ns: int | None = None
    going_ns: int | None = None


class Monitor:
    """Judges one junction by what it shows; has no clock of its own.

    Args:
        waited_ns: Returns how long this process has waited for a processor so far [ns].

    Attributes:
        fault: The name of the latched fault; None while all is well.
        detail: What was seen, in words.
        since_ns: Of the fault, or of the start or last reset.
    """

    def __init__(
        self, table: ConflictTable, now_ns: int, waited_ns: Callable[[], int] = lambda: 0
    ) -> None:
        self.table = table
        self._waited_ns = waited_ns
        self._limits = {group.name: group for group in table.groups}
        self._is_new = True
        self.reset(now_ns)

    def reset(self, now_ns: int) -> None:
        """Forget the fault and everything seen, but not whether there was a controller."""
        self.fault: str | None = None
        self.detail = ""
        self.since_ns = now_ns
        self._groups: dict[str, _Group] = {}
        self._suspects: dict[str, int] = {}
        self._right_colours: list[tuple[str, Colour]] | None = None  # of the last sample
        self._stamp_ns: int | None = None
        self._ahead_ns: deque[int] = deque(maxlen=20)
        self._received_ns = now_ns
        self._ticked_ns = now_ns
        self._waited_before_ns = self._waited_ns()
        self._regular_ns = now_ns  # since when no sample was missed

    def keep(self, fault: str, now_ns: int) -> None:
        """Keep a fault that was latched before the monitor itself was started again."""
        self._is_new = False
        self._latch(fault, "latched before the monitor was started again", now_ns)

    def tick(self, now_ns: int) -> None:
        """Check whether the controller has fallen silent."""
        if now_ns - self._ticked_ns > MAX_TICK_GAP_NS:
            # Who slept cannot call others silent: its own link may just be coming back.
            self._received_ns = max(self._received_ns, now_ns)
        self._ticked_ns = now_ns
        silent_ns = now_ns - self._received_ns
        if silent_ns > (MAX_FIRST_SILENCE_NS if self._is_new else MAX_SILENCE_NS):
            self._regular_ns = now_ns
            self._judge_silence(silent_ns, now_ns)

    def _judge_silence(self, silent_ns: int, now_ns: int) -> None:
        """Distinguish a frozen controller from an overloaded computer."""
        detail = f"no signal phase for {silent_ns // NS_PER_MS} ms"
        waited_ns = self._waited_ns() - self._waited_before_ns
        is_busy = self.fault == OVERLOAD or waited_ns >= MIN_WAIT_SHARE * silent_ns
        if silent_ns > MAX_OVERLOAD_SILENCE_NS or not is_busy:
            self._latch("stale", detail, now_ns)
        elif self.fault is None:
            why = f"the monitor itself waited {waited_ns // NS_PER_MS} ms for a processor"
            self._latch(OVERLOAD, f"{detail}: this computer is too busy, {why}", now_ns)

    def see(self, spat: Spat, arrived_ns: int) -> None:
        """Judge one sample that arrived at `arrived_ns` on the monitor's own clock."""
        if spat.t_ns == self._stamp_ns:
            return  # nothing new: an output that hangs says the same for ever
        self._received_ns = max(self._received_ns, arrived_ns)
        self._waited_before_ns = self._waited_ns()
        is_over = self.fault == OVERLOAD and arrived_ns - self._regular_ns >= OVERLOAD_CLEARS_NS
        if is_over or (self._is_new and self.fault == "stale"):
            self.fault, self.detail, self.since_ns = None, "", arrived_ns
        self._is_new = False
        self._judge_clock(spat.t_ns, arrived_ns)
        colours = [(group.group, group.colour) for group in spat.groups]
        if colours == self._right_colours:
            for name, colour in colours:
                self._remember(name, colour, spat.t_ns)
        else:
            is_right = self._judge_sample(spat, arrived_ns)
            self._judge_changes(spat, arrived_ns)
            self._right_colours = colours if is_right else None
        self._stamp_ns = spat.t_ns

    def _latch(self, fault: str, detail: str, now_ns: int) -> None:
        if self.fault in (None, OVERLOAD):
            self.fault, self.detail, self.since_ns = fault, detail, now_ns

    def _judge_clock(self, stamp_ns: int, arrived_ns: int) -> None:
        if self._stamp_ns is not None and stamp_ns < self._stamp_ns:
            back_ms = (self._stamp_ns - stamp_ns) // NS_PER_MS
            self._latch("clock_jump", f"time stamps went back by {back_ms} ms", arrived_ns)
        ahead_ns = stamp_ns - arrived_ns
        if self._ahead_ns and ahead_ns - max(self._ahead_ns) > MAX_CLOCK_LEAD_NS:
            jump_ms = (ahead_ns - max(self._ahead_ns)) // NS_PER_MS
            self._latch("clock_jump", f"time stamps ran ahead by {jump_ms} ms", arrived_ns)
        self._ahead_ns.append(ahead_ns)

    def _judge_sample(self, spat: Spat, arrived_ns: int) -> bool:
        """Suspect what one sample alone can show; latch what was suspected before.

        Returns:
            Whether there was nothing to suspect.
        """
        found = self._wrong_in(spat)
        for fault, detail in found.items():
            before_ns = self._suspects.get(fault)
            if before_ns is not None and arrived_ns - before_ns <= CONFIRM_WITHIN_NS:
                self._latch(fault, detail, arrived_ns)
            self._suspects[fault] = arrived_ns
        return not found

    def _wrong_in(self, spat: Spat) -> dict[str, str]:
        shown: dict[str, list[Colour]] = {name: [] for name in self._limits}
        wrong: dict[str, str] = {}
        for group in spat.groups:
            if group.group in shown:
                shown[group.group].append(group.colour)
            else:
                wrong["card"] = f"group {group.group} is not on the card"
        for name, colours in shown.items():
            if len(colours) > 1:
                wrong["dual"] = f"group {name} shows {' and '.join(colours)}"
            if not colours or "dark" in colours:
                wrong["dark"] = f"group {name} shows nothing"
        for one, other in self.table.conflicts:
            if any(c in _GOING for c in shown[one]) and any(c in _GOING for c in shown[other]):
                both = f"{one} {shown[one][0]} against {other} {shown[other][0]}"
                wrong["conflict"] = both
        return wrong

    def _judge_changes(self, spat: Spat, arrived_ns: int) -> None:
        """Follow the groups that show one clear colour from sample to sample."""
        names = [group.group for group in spat.groups]
        shown = {
            group.group: group.colour
            for group in spat.groups
            if group.group in self._limits
            and names.count(group.group) == 1
            and group.colour != "dark"
        }
        for name, colour in shown.items():
            before = self._groups.get(name)
            if before is not None and before.colour != colour:
                for fault, detail in self._wrong_change(name, before, shown, spat.t_ns):
                    self._latch(fault, f"group {name}: {detail}", arrived_ns)
        for name, colour in shown.items():
            self._remember(name, colour, spat.t_ns)

    def _remember(self, name: str, colour: Colour, stamp_ns: int) -> None:
        group = self._groups.setdefault(name, _Group(colour, stamp_ns))
        if group.colour != colour:
            group.colour, group.other_ns = colour, group.seen_ns
        group.seen_ns = stamp_ns
        if colour in _MAY_GO:
            group.going_ns = stamp_ns

    def _wrong_change(
        self, name: str, before: _Group, shown: Mapping[str, Colour], stamp_ns: int
    ) -> list[tuple[str, str]]:
        """Return the faults of a group's change to what it shows now."""
        colour, table = shown[name], self._limits[name]
        longest_ns = None if before.other_ns is None else stamp_ns - before.other_ns
        match before.colour, colour:
            case "green", "yellow":
                return _short("short_green", "green", longest_ns, table.green_ns)
            case "yellow", "red":
                return _short("short_yellow", "yellow", longest_ns, table.yellow_ns)
            case "red", "green":
                return self._short_clearances(name, shown, stamp_ns)
            case "green", "red":
                return [("skipped_yellow", "red without yellow")]
        if colour in _MAY_FOLLOW[before.colour]:
            return []
        return [("sequence", f"{colour} after {before.colour}")]

    def _short_clearances(
        self, name: str, shown: Mapping[str, Colour], stamp_ns: int
    ) -> list[tuple[str, str]]:
        wrong = []
        for pair in self.table.conflicts:
            conflicting = pair[0] if pair[1] == name else pair[1]
            seen = self._groups.get(conflicting)
            if name not in pair or seen is None or shown.get(conflicting) in _GOING:
                continue  # two that go at once are a conflict, not a short clearance
            cleared_ns = None if seen.going_ns is None else stamp_ns - seen.going_ns
            least_ns = self._limits[conflicting].clearance_ns
            wrong += _short("short_clearance", f"red after {conflicting}", cleared_ns, least_ns)
        return wrong


def _short(fault: str, what: str, longest_ns: int | None, least_ns: int) -> list[tuple[str, str]]:
    if longest_ns is None or longest_ns >= least_ns:
        return []
    got_ms, least_ms = longest_ns // NS_PER_MS, least_ns // NS_PER_MS
    return [(fault, f"{what} for {got_ms} ms at most, expected {least_ms} ms")]
