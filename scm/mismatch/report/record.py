"""A report as one record, and as JSON: `report.json` and `drawn.json`.

All that files and page show is worked out here, once. In JSON what is not a finite number is null.
In `drawn.json` times are those that the page shows, long arrays are thinned, and numbers rounded.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import msgspec
import numpy as np
from msgspec import structs

from scm.arrays import Floats
from scm.data_quality.quality import Span
from scm.mismatch.evidence import Evidence, FreeRuns, Residual
from scm.mismatch.findings import Diagnosis, Effect, folders_of
from scm.mismatch.report.panels import Panel, panels_of
from scm.mismatch.report.pictures import Pictures, draw
from scm.mismatch.report.sentences import (
    all_named,
    better_sentence,
    can_judge,
    other_problems_sentence,
    verdict_sentence,
)
from scm.mismatch.report.wording import capital, interval, name_of, title_of
from scm.mismatch.validate.residuals import APART_S
from scm.vehicles.car import Car
from scm.vehicles.describe_effects import all_effects, neutral_of, params_of

_MAX_READABLE_S = 1e5  # a larger time is a date, not a stop watch
_MAX_RESIDUALS, _MAX_POINTS, _MAX_TIMES = 6, 1500, 40
_DIGITS = 5
_MILLI = 3  # decimals of metres and radians of free runs


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


def since_start(diagnosis: Diagnosis, evidence: Evidence) -> Diagnosis:
    """Return a diagnosis with times since its recording began, where its clock counts from 1970."""
    start_s = _start_s(evidence)
    return _since(start_s, diagnosis, evidence)[0] if start_s else diagnosis


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
    effects = tuple(_effect_since(start_s, effect) for effect in diagnosis.effects)
    return structs.replace(diagnosis, located=located, data=data, effects=effects), shown


def _effect_since(start_s: float, effect: Effect) -> Effect:
    since, until = (
        at and structs.replace(at, value=at.value - start_s, low=at.low - start_s,
                               high=at.high - start_s)
        for at in (effect.since_s, effect.until_s)
    )  # fmt: skip
    return structs.replace(effect, since_s=since, until_s=until)


def json_text(diagnosis: Diagnosis) -> str:
    """Return the text of `report.json`."""
    return json.dumps(plain(diagnosis), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def plain(value: Any) -> Any:
    """Return a value as lists, mappings, text, and finite numbers or None."""
    return msgspec.json.decode(msgspec.json.encode(value, enc_hook=_of_numpy))


def drawn_text(report: Report) -> str:
    """Return the text of `drawn.json`."""
    return json.dumps(drawn(report), ensure_ascii=False, allow_nan=False)


def drawn(report: Report) -> dict[str, Any]:
    """Return the fields of `drawn.json`; this function is their documentation.

    `effects` and `questions` are in the order of the report's; `cards` are its first screen.
    `residuals` come strongest first, `free_runs` as (windows, times).
    """
    diagnosis, evidence, runs = report.diagnosis, report.evidence, report.evidence.free_runs
    folders = folders_of(diagnosis.undecided)
    return {
        "vehicle": evidence.vehicle,
        "recordings": list(evidence.recordings),
        "start_s": report.start_s,
        "said": report.sentence,
        "named": report.named,
        "better": report.better,
        "can_judge": report.can_judge,
        "retuned_m": plain(evidence.retuned_m),
        "cards": [
            {"kind": panel.kind, "label": panel.label, "title": panel.title,
             "rows": [list(row) for row in panel.rows if row[1]]}
            for panel in report.panels
        ],
        "other_problems": report.other_problems,
        "effects": [_effect(effect) for effect in diagnosis.effects],
        "questions": [
            {"titles": [capital(title_of(name)) for name in question.between], "folder": folder}
            for question, folder in zip(diagnosis.undecided, folders, strict=True)
        ],
        "located": plain(diagnosis.located),
        "data": plain(diagnosis.data),
        "residuals": [_residual(residual) for residual in evidence.residuals[:_MAX_RESIDUALS]],
        "free_runs": None if runs is None or not len(runs.start_s) else _runs(runs),
        "curves": [_rounded(plain(curve)) for curve in evidence.curves],
        "numbers": [_rounded(plain(number)) for number in evidence.refitted],
        "tried": [
            {"name": one.name, "title": capital(title_of(one.name)), **_rounded(
                {"gain": one.gain, "needed": one.needed})}
            for one in sorted(evidence.tried, key=lambda one: -one.gain)
        ],
    }  # fmt: skip


def _of_numpy(value: Any) -> Any:
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    msg = f"{type(value)} has no form in JSON"
    raise NotImplementedError(msg)


def _effect(effect: Effect) -> dict[str, Any]:
    known = all_effects().get(effect.name)
    neutral = {} if known is None else neutral_of(known)
    params = () if known is None else params_of(known)
    by_reported = {param.reported: neutral.get(param.name) for param in params}
    return {
        "name": effect.name,
        "title": capital(title_of(effect.name)),
        "about": "" if known is None else known.about,
        "numbers": [
            {
                "name": name_of(name, estimate.unit),
                "said": interval(estimate),
                "neutral": by_reported.get(name),
                **_rounded(plain(estimate)),
            }
            for name, estimate in effect.parameters.items()
        ],
        "rivals": [capital(title_of(one.name)) for one in effect.alternatives],
    }


def _residual(residual: Residual) -> dict[str, Any]:
    rows = slice(None, None, max(1, math.ceil(len(residual.t_s) / _MAX_POINTS)))
    arrays = {
        name: [_round(v) for v in getattr(residual, name)[rows].tolist()]
        for name in ("t_s", "x_m", "y_m", "before", "after", "std")
    }
    return {"channel": residual.channel, "unit": residual.unit, **arrays}


def _runs(runs: FreeRuns) -> dict[str, Any]:
    times = slice(None, None, max(1, math.ceil(len(runs.t_s) / _MAX_TIMES)))

    def side(of: Mapping[str, Floats]) -> dict[str, Any]:
        return {name: _milli(of[name][:, times]) for name in ("x", "y", "yaw")}

    return {
        "part": list(runs.part),
        "start_s": _milli(runs.start_s),
        "t_s": _milli(runs.t_s[times]),
        "measured": side(runs.measured),
        "before": side(runs.before),
        "after": side(runs.after),
    }


def _milli(values: Floats) -> Any:
    return plain(np.round(values, _MILLI))


def _rounded(fields: Any) -> Any:
    if isinstance(fields, Mapping):
        return {name: _rounded(value) for name, value in fields.items()}
    if isinstance(fields, Sequence) and not isinstance(fields, str):
        return [_rounded(value) for value in fields]
    return _round(fields) if isinstance(fields, float) else fields


def _round(value: float) -> float | None:
    return float(f"{value:.{_DIGITS}g}") if math.isfinite(value) else None
