"""What signals showed, and how well they forecast it."""

import msgspec

from scm.records.fields import (
    ColourName,
    Detail,
    EndNs,
    FaultName,
    GroupName,
    JunctionName,
    ModeName,
    PlanName,
    StartNs,
    TNs,
)


class Bar(msgspec.Struct, kw_only=True, frozen=True):
    """One colour of one group; `end_ns` None: it is shown still."""

    colour: ColourName
    start_ns: StartNs
    end_ns: EndNs | None


class GroupBars(msgspec.Struct, kw_only=True, frozen=True):
    """What one group showed, oldest first.

    Attributes:
        bars: What was shown, oldest first.
    """

    group: GroupName
    bars: tuple[Bar, ...]


class Running(msgspec.Struct, kw_only=True, frozen=True):
    """What ran from a time on."""

    t_ns: TNs
    mode: ModeName
    plan: PlanName


class History(msgspec.Struct, kw_only=True, frozen=True):
    """The last minutes of one junction, on its controller's clock.

    Attributes:
        t_ns: Of the last message received; None: none yet.
        kept_s: How far back anything is stored.
        groups: Signal groups.
        ran: What ran, oldest first.
    """

    junction: JunctionName
    t_ns: TNs | None
    kept_s: int
    groups: tuple[GroupBars, ...]
    ran: tuple[Running, ...]


class LeadScore(msgspec.Struct, kw_only=True, frozen=True):
    """Likely ends as forecast some time before the end, against the end.

    Attributes:
        colour: That ended.
        lead_s: How long before.
        errors_s: Forecast minus truth, one for each colour that ended; + = it ended earlier.
        unknown: How often there was no forecast.
        mean_s, worst_s: Of the errors; None: there are none. `worst_s` by its amount.
        within: Share of errors of a second at most.
        told: Mean of the published confidence.
    """

    colour: ColourName
    lead_s: int
    errors_s: tuple[float, ...]
    unknown: int
    mean_s: float | None
    worst_s: float | None
    within: float | None
    told: float | None


class ForecastScore(msgspec.Struct, kw_only=True, frozen=True):
    """How the forecasts of SPaT of the last minutes came true.

    Attributes:
        kept_s: How far back anything is stored [s].
        judged: Colours that ended.
        early: Of them, before the earliest published end.
        late: After the latest published end.
        open: Whose latest end was never published.
        cut: Ended by flash; not judged.
        leads: By how long before.
    """

    junction: JunctionName
    kept_s: int
    judged: int
    early: int
    late: int
    open: int
    cut: int
    leads: tuple[LeadScore, ...]


class Verdict(msgspec.Struct, kw_only=True, frozen=True):
    """A verdict of the monitor, from a time on its clock."""

    t_ns: TNs
    fault: FaultName | None
    detail: Detail
