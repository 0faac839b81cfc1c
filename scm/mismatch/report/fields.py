"""A report as JSON: `report.json` holds the findings, `drawn.json` what its pictures draw.

What is not a finite number is null. In `drawn.json` times are those that the page shows, long
arrays are thinned, and numbers rounded.
"""

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

import msgspec
import numpy as np

from scm.arrays import Floats
from scm.mismatch.evidence import FreeRuns, Residual
from scm.mismatch.findings import Diagnosis, Effect, folders_of
from scm.mismatch.report.record import Report
from scm.mismatch.report.wording import capital, interval, name_of, title_of
from scm.vehicles.describe_effects import all_effects, neutral_of, params_of

_MAX_RESIDUALS, _MAX_POINTS, _MAX_TIMES = 6, 1500, 40
_DIGITS = 5
_MILLI = 3  # decimals of metres and radians of free runs


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
