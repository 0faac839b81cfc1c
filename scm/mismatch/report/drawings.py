"""All pictures of a report, drawn once: the page shows them, and the folder holds them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scm.mismatch.evidence import Evidence, Residual
from scm.mismatch.findings import Diagnosis
from scm.mismatch.report.bars import better_picture, tried_picture
from scm.mismatch.report.curve_pictures import curve_pictures
from scm.mismatch.report.floor_map import floor_map
from scm.mismatch.report.forest import forest_picture
from scm.mismatch.report.free_run_pictures import error_pictures, window_pictures
from scm.mismatch.report.plot import Picture
from scm.mismatch.report.time_line import ON_ITS_CLOCK, time_line

_MOST_MAPS = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawings:
    """What there is to see; what the evidence does not hold is None or empty."""

    better: Picture | None
    maps: Sequence[Picture]
    time_line: Picture | None
    curves: Sequence[Picture]
    windows: Sequence[Picture]
    errors: Sequence[Picture]
    numbers: Picture | None
    tried: Picture | None

    def all(self) -> list[Picture]:
        """Return every picture."""
        single = (self.better, self.time_line, self.numbers, self.tried)
        several = (*self.maps, *self.curves, *self.windows, *self.errors)
        return [picture for picture in (*single, *several) if picture is not None]


def draw(diagnosis: Diagnosis, evidence: Evidence, start_s: float = 0.0) -> Drawings:
    """Return the pictures of a diagnosis; `start_s` was taken off its times already."""
    residuals = sorted(evidence.residuals, key=strength, reverse=True)
    on_floor = [r for r in residuals if (np.isfinite(r.x_m) & np.isfinite(r.y_m)).any()]
    after = "with what was found" if diagnosis.effects else "with its numbers refitted"
    clock = ON_ITS_CLOCK
    if len(evidence.recordings) > 1:
        clock = "time, one recording after another [s]"
    elif evidence.pauses:
        clock = "time without pauses [s]"
    elif start_s:
        clock = f"time since {start_s:.0f} s of the recording's clock [s]"
    return Drawings(
        better=better_picture(diagnosis, evidence.retuned_m),
        maps=[
            floor_map(residual, diagnosis.located, i)
            for i, residual in enumerate(on_floor[:_MOST_MAPS], start=1)
        ],
        time_line=time_line(residuals, diagnosis.located, evidence.free_runs, after, clock),
        curves=curve_pictures(evidence.curves),
        windows=window_pictures(evidence.free_runs),
        errors=error_pictures(evidence.free_runs),
        numbers=forest_picture(evidence.refitted),
        tried=tried_picture(evidence.tried, [effect.name for effect in diagnosis.effects]),
    )


def strength(residual: Residual) -> float:
    """Return how far a residual stands out of its noise: the mean of its squared deviations."""
    with np.errstate(divide="ignore", invalid="ignore"):
        stds = (residual.before / residual.std) ** 2
    known = stds[np.isfinite(stds)]
    return float(known.mean()) if len(known) else 0.0
