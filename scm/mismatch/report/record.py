"""A report as one record: everything that its files and its page show, worked out once."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from msgspec import structs

from scm.arrays import Floats
from scm.data_quality.quality import Span
from scm.mismatch.evidence import Evidence, Residual
from scm.mismatch.findings import Diagnosis
from scm.mismatch.report.panels import Panel, panels_of
from scm.mismatch.report.pictures import Pictures, draw
from scm.mismatch.report.sentences import (
    all_named,
    better_sentence,
    can_judge,
    other_problems_sentence,
    verdict_sentence,
)
from scm.mismatch.validate.residuals import APART_S
from scm.vehicles.car import Car

_MAX_READABLE_S = 1e5  # a larger time is a date, not a stop watch


@dataclass(frozen=True, slots=True, kw_only=True)
class Report:
    """What a report shows; `report.json`, `drawn.json`, page and pictures are written from it.

    Attributes:
        diagnosis: What was found, with times as they are shown.
        evidence: What is drawn, with times as they are shown, residuals strongest first.
        start_s: What was subtracted from all times.
        given, patched: The car before, and with what was found.
        sentence: The verdict.
        named: All effects by name if the sentence only counts them.
        better: How much better the simulator got, in a sentence.
        can_judge: Whether the recordings allow a verdict on the car.
        panels: The first screen.
        other_problems: A line about problems of the recording that have no card.
        pictures: All of them.
    """

    diagnosis: Diagnosis
    evidence: Evidence
    start_s: float
    given: Car
    patched: Car
    sentence: str
    named: str
    better: str
    can_judge: bool
    panels: Sequence[Panel]
    other_problems: str
    pictures: Pictures


def make_report(diagnosis: Diagnosis, evidence: Evidence, given: Car, patched: Car) -> Report:
    """Return the report of a diagnosis on the recordings' clock."""
    start_s = _start_s(evidence)
    residuals = sorted(evidence.residuals, key=_strength, reverse=True)
    evidence = replace(evidence, residuals=tuple(residuals))
    if start_s:
        diagnosis, evidence = _since(start_s, diagnosis, evidence)
    return Report(
        diagnosis=diagnosis,
        evidence=evidence,
        start_s=start_s,
        given=given,
        patched=patched,
        sentence=verdict_sentence(diagnosis),
        named=all_named(diagnosis.effects),
        better=better_sentence(diagnosis, evidence.retuned_m),
        can_judge=can_judge(diagnosis),
        panels=panels_of(diagnosis, evidence),
        other_problems=other_problems_sentence(diagnosis, evidence.recordings),
        pictures=draw(diagnosis, evidence, start_s),
    )


def on_clock(diagnosis: Diagnosis, evidence: Evidence) -> Diagnosis:
    """Return a diagnosis whose times are on the recording's clock, with its pauses."""
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
    """Return spans as they were before pauses were cut out; one over a pause becomes two."""
    ends = [first for first, _ in pauses[1:]] + [math.inf]
    return tuple(
        (max(a, first) + later, min(b, end - APART_S) + later)
        for a, b in when_s
        for (first, later), end in zip(pauses, ends, strict=True)
        if a < end - APART_S and b > first
    )


def _strength(residual: Residual) -> float:
    """Return how far a residual stands out of its noise: the mean of its squared deviations."""
    with np.errstate(divide="ignore", invalid="ignore"):
        stds = (residual.before / residual.std) ** 2
    known = stds[np.isfinite(stds)]
    return float(known.mean()) if len(known) else 0.0


def _start_s(evidence: Evidence) -> float:
    """Return the whole second at which a clock that counts from 1970 starts; 0 of any other."""
    runs = evidence.free_runs
    times: list[Floats] = [r.t_s for r in evidence.residuals]
    times += [runs.start_s] if runs is not None else []
    known = [float(np.nanmin(t)) for t in times if np.isfinite(t).any()]
    first = min(known, default=0.0)
    return float(math.floor(first)) if abs(first) > _MAX_READABLE_S else 0.0


def _since(start_s: float, diagnosis: Diagnosis, evidence: Evidence) -> tuple[Diagnosis, Evidence]:
    """Return both with times since a start."""

    def earlier(when_s: tuple[Span, ...] | None) -> tuple[Span, ...] | None:
        return when_s and tuple((a - start_s, b - start_s) for a, b in when_s)

    located = tuple(structs.replace(e, when_s=earlier(e.when_s)) for e in diagnosis.located)
    data = tuple(structs.replace(p, when_s=earlier(p.when_s)) for p in diagnosis.data)
    residuals = tuple(replace(r, t_s=r.t_s - start_s) for r in evidence.residuals)
    runs = evidence.free_runs
    if runs is not None:
        runs = replace(runs, start_s=runs.start_s - start_s)
    shown = replace(evidence, residuals=residuals, free_runs=runs)
    return structs.replace(diagnosis, located=located, data=data), shown
