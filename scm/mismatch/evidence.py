"""What a report shows beside the findings: arrays to draw, all on the recording's clock.

Times of several recordings follow one another; the first keeps its own.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from scm.arrays import Floats, Ints
from scm.mismatch.findings import Estimate

_MOVED_STDS, _AT_STDS = 0.5, 0.02


@dataclass(frozen=True, slots=True, kw_only=True)
class Residual:
    """What acted on the car that the simulator does not know, along the drive.

    Attributes:
        channel: `drive force`, `yaw moment`, `wheel angle`, `pose.x` ... as a person would say it.
        unit: Of `before` and `after`.
        t_s, x_m, y_m: When, and where on the floor, shape (n,).
        before, after: Smoothed, with the car as given and with what was found, shape (n,).
        std: Of either, shape (n,).
    """

    channel: str
    unit: str
    t_s: Floats
    x_m: Floats
    y_m: Floats
    before: Floats
    after: Floats
    std: Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class Curve:
    """An effect as a curve: what it does against what it depends on, with a 90 % band, (n,)."""

    effect: str
    x_name: str
    x_unit: str
    y_name: str
    y_unit: str
    x: Floats
    y: Floats
    low: Floats
    high: Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class FreeRuns:
    """Free runs of windows against the recording, arrays (windows, times); NaN in gaps.

    Attributes:
        part: `fit`, `choose` or `confirm` of each window.
        recording: Number of the recording that each window is of, (windows,).
        stamp_s: When each starts on its recording's own clock, (windows,).
        start_s: The same on one axis for all recordings, (windows,).
        t_s: Since the window's start, (times,).
        measured, before, after: x, y [m] and yaw [rad] by name.
        file: Of the car that each was driven with for `after`; empty: `car.toml`.
    """

    part: tuple[str, ...]
    recording: Ints
    stamp_s: Floats
    start_s: Floats
    t_s: Floats
    measured: Mapping[str, Floats]
    before: Mapping[str, Floats]
    after: Mapping[str, Floats]
    file: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class RefittedParameter:
    """A nominal parameter of the car file, before and after, with what the file allows it.

    Attributes:
        found_std: Of what was found; None: as its interval says, which ends at physical bounds.
        bounds: Lowest and highest value that makes physical sense.
    """

    key: str
    given: float
    given_std: float
    found: Estimate
    found_std: float | None = None
    bounds: tuple[float, float] = (-math.inf, math.inf)

    @property
    def limit(self) -> float | None:
        """The bound that the number was moved to; None: it was not moved to one."""
        has_moved = abs(self.found.value - self.given) > _MOVED_STDS * self.given_std
        near = (b for b in self.bounds if abs(self.found.value - b) <= _AT_STDS * self.given_std)
        return next(near, None) if has_moved else None


@dataclass(frozen=True, slots=True, kw_only=True)
class Tried:
    """An effect that was tried alone: how much better the recording is explained, and how sure.

    Attributes:
        gain: Decrease of the objective, in squared standard deviations.
        needed: What chance alone may bring among so many tried.
    """

    name: str
    gain: float
    needed: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Evidence:
    """All that is drawn; what a recording cannot show is empty.

    Attributes:
        retuned_m: Position error, as in `Fit.confirm`, of the given car with its own numbers
            refitted and no effect; None where none was found, then `after` is that car.
        pauses: Of a recording that was cut into stretches, by stretch: its first time as drawn,
            and how much later the recording's clock is [s]. Pauses are not drawn.
        widened: What was believed less firmly than car file and recording state it.
    """

    vehicle: str
    recordings: tuple[str, ...]
    residuals: tuple[Residual, ...] = ()
    curves: tuple[Curve, ...] = ()
    free_runs: FreeRuns | None = None
    refitted: tuple[RefittedParameter, ...] = ()
    tried: tuple[Tried, ...] = ()
    retuned_m: float | None = None
    pauses: tuple[tuple[float, float], ...] = ()
    widened: tuple[str, ...] = ()


def without_pauses(t_s: float, pauses: Sequence[tuple[float, float]]) -> float:
    """Return a time on the recording's clock as it is drawn; in a pause, where this was cut out.

    Args:
        t_s: On the recording's clock.
        pauses: As `Evidence.pauses`.
    """
    drawn_s = t_s
    for (first_s, later_s), (end_s, _) in pairwise((*pauses, (math.inf, 0.0))):
        if t_s - later_s >= first_s:
            drawn_s = min(t_s - later_s, end_s)
    return drawn_s
