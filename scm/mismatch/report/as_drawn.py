"""What a report draws and says, as data: for a page that draws it itself and lets people ask.

Words are those of the report's own page. Times are those that the page shows: since the start where
the recording's clock counts from 1970. Long arrays are thinned, and numbers rounded.
"""

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from scm.arrays import Floats
from scm.mismatch.evidence import Evidence, FreeRuns, Residual
from scm.mismatch.experiment.folders import folders_of
from scm.mismatch.findings import Diagnosis, Effect
from scm.mismatch.report.as_json import plain
from scm.mismatch.report.drawings import strength
from scm.mismatch.report.first_screen import better_said, cards_of, name_of
from scm.mismatch.report.problems import other_problems_said
from scm.mismatch.report.verdict_text import all_named, can_judge, verdict_sentence
from scm.mismatch.report.wording import capital, interval, title_of
from scm.vehicles.describe_effects import all_effects, neutral_of, params_of

_MOST_RESIDUALS, _MOST_POINTS, _MOST_TIMES = 6, 1500, 40
_DIGITS = 5
_MILLI = 3  # decimals of metres and radians of free runs


def drawn_text(diagnosis: Diagnosis, evidence: Evidence, start_s: float = 0.0) -> str:
    """Return the text of `drawn.json`; `start_s` was taken off all times already."""
    return json.dumps(drawn(diagnosis, evidence, start_s), ensure_ascii=False, allow_nan=False)


def drawn(diagnosis: Diagnosis, evidence: Evidence, start_s: float = 0.0) -> dict[str, Any]:
    """Return lists, mappings, text, and finite numbers or None; the README of the fields is here.

    `effects` and `questions` stand in the order of the report's; `cards` are its first screen.
    `residuals` come strongest first, `free_runs` as (windows, times).
    """
    residuals = sorted(evidence.residuals, key=strength, reverse=True)[:_MOST_RESIDUALS]
    runs = evidence.free_runs
    return {
        "vehicle": evidence.vehicle,
        "recordings": list(evidence.recordings),
        "start_s": start_s,
        "said": verdict_sentence(diagnosis),
        "named": all_named(diagnosis.effects),
        "better": better_said(diagnosis, evidence.retuned_m),
        "can_judge": can_judge(diagnosis),
        "retuned_m": plain(evidence.retuned_m),
        "cards": [
            {"kind": card.kind, "label": card.label, "title": card.title,
             "rows": [list(row) for row in card.rows if row[1]]}
            for card in cards_of(diagnosis, evidence)
        ],
        "other_problems": other_problems_said(diagnosis, evidence),
        "effects": [_effect(effect) for effect in diagnosis.effects],
        "questions": [
            {"titles": [capital(title_of(name)) for name in question.between], "folder": folder}
            for question, folder in zip(
                diagnosis.undecided, folders_of(diagnosis.undecided), strict=True
            )
        ],
        "located": plain(diagnosis.located),
        "data": plain(diagnosis.data),
        "residuals": [_residual(residual) for residual in residuals],
        "free_runs": None if runs is None or not len(runs.start_s) else _runs(runs),
        "curves": [_rounded(plain(curve)) for curve in evidence.curves],
        "numbers": [_rounded(plain(ordinary)) for ordinary in evidence.refitted],
        "tried": [
            {"name": one.name, "title": capital(title_of(one.name)), **_rounded(
                {"gain": one.gain, "needed": one.needed})}
            for one in sorted(evidence.tried, key=lambda one: -one.gain)
        ],
    }  # fmt: skip


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
        "rivals": [capital(title_of(rival.name)) for rival in effect.alternatives],
    }


def _residual(residual: Residual) -> dict[str, Any]:
    keep = slice(None, None, max(1, math.ceil(len(residual.t_s) / _MOST_POINTS)))
    arrays = {
        name: [_round(v) for v in getattr(residual, name)[keep].tolist()]
        for name in ("t_s", "x_m", "y_m", "before", "after", "std")
    }
    return {"channel": residual.channel, "unit": residual.unit, **arrays}


def _runs(runs: FreeRuns) -> dict[str, Any]:
    keep = slice(None, None, max(1, math.ceil(len(runs.t_s) / _MOST_TIMES)))

    def side(of: Mapping[str, Floats]) -> dict[str, Any]:
        return {name: _milli(of[name][:, keep]) for name in ("x", "y", "yaw")}

    return {
        "part": list(runs.part),
        "start_s": _milli(runs.start_s),
        "t_s": _milli(runs.t_s[keep]),
        "measured": side(runs.measured),
        "before": side(runs.before),
        "after": side(runs.after),
    }


def _milli(values: Floats) -> Any:
    return _finite(np.round(values, _MILLI).tolist())


def _finite(values: Any) -> Any:
    if isinstance(values, list):
        return [_finite(value) for value in values]
    return values if math.isfinite(values) else None


def _rounded(fields: Any) -> Any:
    if isinstance(fields, Mapping):
        return {name: _rounded(value) for name, value in fields.items()}
    if isinstance(fields, Sequence) and not isinstance(fields, str):
        return [_rounded(value) for value in fields]
    return _round(fields) if isinstance(fields, float) else fields


def _round(value: float) -> float | None:
    return float(f"{value:.{_DIGITS}g}") if math.isfinite(value) else None
