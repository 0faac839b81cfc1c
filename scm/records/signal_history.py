"""What signals showed, and how well they forecast it."""

import msgspec


class Bar(msgspec.Struct, kw_only=True, frozen=True):
    """One colour of one group; `end_ns` None: it is shown still."""

    colour: str
    start_ns: int
    end_ns: int | None


class GroupBars(msgspec.Struct, kw_only=True, frozen=True):
    """What one group showed, oldest first."""

    group: str
    bars: tuple[Bar, ...]


class Running(msgspec.Struct, kw_only=True, frozen=True):
    """What ran from a time on."""

    t_ns: int
    mode: str
    plan: str


class History(msgspec.Struct, kw_only=True, frozen=True):
    """The last minutes of one junction, on its controller's clock.

    Attributes:
        t_ns: Of the last message received; None: none yet.
        kept_s: How far back anything is stored.
    """

    junction: str
    t_ns: int | None
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

    colour: str
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
        judged: Colours that ended.
        early: Of them, before the earliest published end.
        late: After the latest published end.
        open: Whose latest end was never published.
        cut: Ended by flash; not judged.
    """

    junction: str
    kept_s: int
    judged: int
    early: int
    late: int
    open: int
    cut: int
    leads: tuple[LeadScore, ...]


class Verdict(msgspec.Struct, kw_only=True, frozen=True):
    """A verdict of the monitor, from a time on its clock."""

    t_ns: int
    fault: str | None
    detail: str
