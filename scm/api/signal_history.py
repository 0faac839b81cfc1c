"""What signals showed in the last minutes, and how it compares with what SPaT published.

One bar is one colour of one group, from its first step to the first step of the next colour, on
the controller's clock. While it is shown, its end according to SPaT is noted; when it has ended,
it is judged once: an end before the earliest or after the latest published time breaks a guarantee,
and the likely end is compared as published 2, 5, 10 and 20 s before. Flash is immediate and
guarantees nothing: a colour that it cuts short is not judged.
"""

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field

from scm.clock import NS_PER_MS, NS_PER_S, seconds
from scm.records.signal_history import (
    Bar,
    ForecastScore,
    GroupBars,
    History,
    LeadScore,
    Running,
    Verdict,
)
from scm.records.signals import SignalGroup
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.spat import Spat

HISTORY_S = 600
GAP_NS = 1_000 * NS_PER_MS
LEADS_S = (2, 5, 10, 20)
CLOSE_S = 1.0
MAX_VERDICTS = 50
_UNPROMISED = ("flashing_red", "dark")


@dataclass(frozen=True, slots=True)
class _Judged:
    """One colour that ended; `leads` holds error and confidence, None: not published."""

    end_ns: int
    colour: str
    early: bool
    late: bool
    open: bool
    cut: bool
    leads: tuple[tuple[int, tuple[float, float] | None], ...]


@dataclass(slots=True)
class _Shown:
    """A colour while it is shown, and all published times of its end."""

    colour: str
    start_ns: int
    earliest_ns: int
    latest_ns: int | None
    forecasts: list[tuple[int, int | None, float]] = field(default_factory=list)

    def note(self, group: SignalGroup, now_ns: int) -> None:
        self.earliest_ns = max(self.earliest_ns, group.min_end_ns)
        if group.max_end_ns is not None:
            latest_ns = self.latest_ns
            self.latest_ns = min(group.max_end_ns, latest_ns or group.max_end_ns)
        if not self.forecasts or self.forecasts[-1][1] != group.likely_end_ns:
            self.forecasts.append((now_ns, group.likely_end_ns, group.likely_confidence or 0.0))

    def judged(self, end_ns: int, *, cut: bool) -> _Judged:
        leads = [] if cut else [(lead_s, self._error(end_ns, lead_s)) for lead_s in LEADS_S]
        lasted_s = seconds(end_ns - self.start_ns)
        return _Judged(
            end_ns,
            self.colour,
            early=not cut and end_ns < self.earliest_ns,
            late=not cut and self.latest_ns is not None and end_ns > self.latest_ns,
            open=not cut and self.latest_ns is None,
            cut=cut,
            leads=tuple((lead_s, error) for lead_s, error in leads if lead_s <= lasted_s),
        )

    def _error(self, end_ns: int, lead_s: int) -> tuple[float, float] | None:
        """Return the error of the likely end that was published some time before the end."""
        at_ns = end_ns - lead_s * NS_PER_S
        forecasts = next((one for one in reversed(self.forecasts) if one[0] <= at_ns), None)
        if forecasts is None or forecasts[1] is None:
            return None
        return round(seconds(forecasts[1] - end_ns), 3), forecasts[2]


@dataclass(slots=True)
class _Group:
    shown: _Shown | None = None
    bars: deque[Bar] = field(default_factory=deque)
    judged: deque[_Judged] = field(default_factory=deque)


class JunctionHistory:
    """The last minutes of one junction; receives every `Spat`."""

    def __init__(self, junction: str) -> None:
        self._junction = junction
        self._groups: dict[str, _Group] = {}
        self._ran: deque[Running] = deque()
        self._t_ns: int | None = None

    def receive(self, spat: Spat) -> None:
        """Note what is shown and published."""
        now_ns, last_ns = spat.t_ns, self._t_ns
        if last_ns is not None and now_ns < last_ns:
            self._groups.clear()  # another controller, with a clock of its own
            self._ran.clear()
        elif last_ns is not None and now_ns - last_ns > GAP_NS:
            self._interrupt(last_ns)
        self._t_ns = now_ns
        running = (spat.mode, spat.plan)
        if not self._ran or (self._ran[-1].mode, self._ran[-1].plan) != running:
            self._ran.append(Running(t_ns=now_ns, mode=spat.mode, plan=spat.plan))
        for forecasts in spat.groups:
            self._receive_group(
                self._groups.setdefault(forecasts.group, _Group()), forecasts, now_ns
            )
        self._forget(now_ns - HISTORY_S * NS_PER_S)

    def history(self, names: Iterable[str]) -> History:
        """Return what was shown, of the groups named, in their order."""
        groups = ((name, self._groups.get(name, _Group())) for name in names)
        return History(
            junction=self._junction,
            t_ns=self._t_ns,
            kept_s=HISTORY_S,
            groups=tuple(GroupBars(group=name, bars=_bars(group)) for name, group in groups),
            ran=tuple(self._ran),
        )

    def score(self) -> ForecastScore:
        """Return how published times compare with what happened."""
        ended = [one for group in self._groups.values() for one in group.judged]
        return ForecastScore(
            junction=self._junction,
            kept_s=HISTORY_S,
            judged=sum(not one.cut for one in ended),
            early=sum(one.early for one in ended),
            late=sum(one.late for one in ended),
            open=sum(one.open for one in ended),
            cut=sum(one.cut for one in ended),
            leads=tuple(
                _lead_score(ended, colour, lead_s)
                for colour in ("green", "red")
                for lead_s in LEADS_S
            ),
        )

    def _receive_group(self, group: _Group, forecasts: SignalGroup, now_ns: int) -> None:
        shown = group.shown
        if shown is None or shown.colour != forecasts.colour:
            if shown is not None:
                group.bars.append(_bar(shown, forecasts.since_ns))
                if shown.colour not in _UNPROMISED:
                    cut = forecasts.colour in _UNPROMISED
                    group.judged.append(shown.judged(forecasts.since_ns, cut=cut))
            start_ns = forecasts.since_ns if shown is not None else now_ns
            shown = group.shown = _Shown(
                forecasts.colour, start_ns, forecasts.min_end_ns, forecasts.max_end_ns
            )
        shown.note(forecasts, now_ns)

    def _interrupt(self, last_ns: int) -> None:
        """Nothing was received for a while: the colours then are unknown, and when they ended."""
        for group in self._groups.values():
            if group.shown is not None:
                group.bars.append(_bar(group.shown, last_ns))
                group.shown = None

    def _forget(self, oldest_ns: int) -> None:
        for group in self._groups.values():
            while group.bars and (group.bars[0].end_ns or 0) < oldest_ns:
                group.bars.popleft()
            while group.judged and group.judged[0].end_ns < oldest_ns:
                group.judged.popleft()
        while len(self._ran) > 1 and self._ran[1].t_ns < oldest_ns:
            self._ran.popleft()


class SignalHistory:
    """All junctions, and the reports of their monitors."""

    def __init__(self) -> None:
        self._junctions: dict[str, JunctionHistory] = {}
        self._verdicts: dict[str, deque[Verdict]] = {}

    def receive(self, spat: Spat) -> None:
        """Note what a junction shows and publishes."""
        if spat.junction not in self._junctions:
            self._junctions[spat.junction] = JunctionHistory(spat.junction)
        self._junctions[spat.junction].receive(spat)

    def receive_monitor(self, status: MonitorStatus) -> None:
        """Note a monitor's report when it differs from the last."""
        verdicts = self._verdicts.setdefault(status.junction, deque(maxlen=MAX_VERDICTS))
        if not verdicts or (verdicts[-1].fault, verdicts[-1].detail) != (
            status.fault,
            status.detail,
        ):
            verdict = Verdict(t_ns=status.t_ns, fault=status.fault, detail=status.detail)
            verdicts.append(verdict)

    def history(self, junction: str, groups: Iterable[str]) -> History:
        """Return what a junction's groups showed."""
        return self._of(junction).history(groups)

    def score(self, junction: str) -> ForecastScore:
        """Return how a junction's published times compare with what happened."""
        return self._of(junction).score()

    def verdicts(self, junction: str) -> tuple[Verdict, ...]:
        """Return the reports of a junction's monitor, newest first."""
        return tuple(reversed(self._verdicts.get(junction, ())))

    def _of(self, junction: str) -> JunctionHistory:
        return self._junctions.get(junction, JunctionHistory(junction))


def _bars(group: _Group) -> tuple[Bar, ...]:
    return (*group.bars, *([_bar(group.shown, None)] if group.shown is not None else []))


def _bar(shown: _Shown, end_ns: int | None) -> Bar:
    return Bar(colour=shown.colour, start_ns=shown.start_ns, end_ns=end_ns)


def _lead_score(ended: Iterable[_Judged], colour: str, lead_s: int) -> LeadScore:
    found = [
        error for one in ended if one.colour == colour for at, error in one.leads if at == lead_s
    ]
    known = [error for error in found if error is not None]
    errors_s = tuple(error_s for error_s, _ in known)
    count = len(known)
    return LeadScore(
        colour=colour,
        lead_s=lead_s,
        errors_s=errors_s,
        unknown=len(found) - count,
        mean_s=round(sum(errors_s) / count, 3) if count else None,
        worst_s=max(errors_s, key=abs) if count else None,
        within=sum(abs(error_s) <= CLOSE_S for error_s in errors_s) / count if count else None,
        told=round(sum(share for _, share in known) / count, 3) if count else None,
    )
