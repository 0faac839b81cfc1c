"""Times as a page shows them: since the start, where the recording's clock counts from 1970."""

import math
from dataclasses import replace

import numpy as np
from msgspec import structs

from scm.arrays import Floats
from scm.data_quality.problem import Span
from scm.mismatch.evidence import Evidence
from scm.mismatch.findings import Diagnosis
from scm.mismatch.validate.residual_forces import APART_S

_READABLE_S = 1e5  # a clock beyond it is no stop watch


def on_clock(diagnosis: Diagnosis, evidence: Evidence) -> Diagnosis:
    """Return a diagnosis whose places in time are by the recording's clock, its pauses included."""
    if not evidence.pauses:
        return diagnosis
    located = tuple(
        structs.replace(e, when_s=e.when_s and _with_pauses(e.when_s, evidence.pauses))
        for e in diagnosis.located
    )
    return structs.replace(diagnosis, located=located)


def _with_pauses(
    when_s: tuple[Span, ...], pauses: tuple[tuple[float, float], ...]
) -> tuple[Span, ...]:
    """Return spans as they were before pauses were left out; one over a pause becomes two."""
    ends = [first for first, _ in pauses[1:]] + [math.inf]
    return tuple(
        (max(a, first) + later, min(b, end - APART_S) + later)
        for a, b in when_s
        for (first, later), end in zip(pauses, ends, strict=True)
        if a < end - APART_S and b > first
    )


def since_start(diagnosis: Diagnosis, evidence: Evidence) -> tuple[Diagnosis, Evidence, float]:
    """Return both with times that can be read, and what was taken off them [s]."""
    start_s = _start_s(evidence)
    if not start_s:
        return diagnosis, evidence, 0.0
    located = tuple(structs.replace(e, when_s=_spans(e.when_s, start_s)) for e in diagnosis.located)
    data = tuple(structs.replace(p, when_s=_spans(p.when_s, start_s)) for p in diagnosis.data)
    residuals = tuple(replace(r, t_s=r.t_s - start_s) for r in evidence.residuals)
    runs = evidence.free_runs
    if runs is not None:
        runs = replace(runs, start_s=runs.start_s - start_s)
    shown = replace(evidence, residuals=residuals, free_runs=runs)
    return structs.replace(diagnosis, located=located, data=data), shown, start_s


def _start_s(evidence: Evidence) -> float:
    """Return the whole second at which a clock that nobody can read begins; 0 of any other."""
    runs = evidence.free_runs
    times: list[Floats] = [r.t_s for r in evidence.residuals]
    times += [runs.start_s] if runs is not None else []
    known = [float(np.nanmin(t)) for t in times if np.isfinite(t).any()]
    first = min(known, default=0.0)
    return float(math.floor(first)) if abs(first) > _READABLE_S else 0.0


def _spans(when_s: tuple[Span, ...] | None, start_s: float) -> tuple[Span, ...] | None:
    return when_s and tuple((a - start_s, b - start_s) for a, b in when_s)
