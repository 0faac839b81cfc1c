"""The few lines that the command line prints at the end."""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path

from scm.data_quality.quality import DataProblem
from scm.mismatch.findings import Diagnosis, Effect
from scm.mismatch.report.sentences import (
    can_judge,
    processor_sentence,
    sensors,
    verdict_sentence,
)
from scm.mismatch.report.wording import amounts, percent, pretty, quantities, quantity, title_of
from scm.mismatch.report.write import PAGE


def summary(diagnosis: Diagnosis, out: Path, retuned_m: float | None = None) -> str:
    """Return the verdict, each effect, how much better, and where the page is.

    Args:
        diagnosis: What was found.
        out: Folder of the report.
        retuned_m: Error of the car with its own numbers refitted alone; None: not mentioned.
    """
    return "\n".join(_lines(diagnosis, out, retuned_m))


def _lines(diagnosis: Diagnosis, out: Path, retuned_m: float | None) -> Iterator[str]:
    verdict = str(diagnosis.verdict) if can_judge(diagnosis) else "no verdict"
    yield f"{verdict}: {verdict_sentence(diagnosis)}"
    for effect in diagnosis.effects:
        yield f"  {effect.name}  {percent(effect.probability)}  {_numbers(effect)}".rstrip()
        yield f"    {pretty(effect.text)}"
    for question in diagnosis.undecided:
        yield f"  undecided: {' or '.join(map(title_of, question.between))}"
        yield f"    drive this: {question.drive_this}"
    for left in diagnosis.unanswered:
        yield f"  not answered: {left.text}"
    if busy := processor_sentence(diagnosis):
        yield f"  {busy}"
    yield from _problems(diagnosis.data)
    yield from _better(diagnosis, retuned_m)
    yield f"  {out / PAGE}  ({diagnosis.runtime_s:.0f} s)"


def _problems(problems: Sequence[DataProblem]) -> Iterator[str]:
    """Yield what is wrong with the recording, what is alike in several sensors once."""
    alike: dict[tuple[str, str, str], list[str]] = {}
    for problem in problems:
        key = (problem.text, problem.corrected, problem.record_instead)
        alike.setdefault(key, []).append(problem.channel)
    for (text, corrected, instead), channels in alike.items():
        where = ", ".join(filter(None, ("recording", _sensors(channels))))
        yield f"  {where}: {text}{f' ({corrected})' if corrected else ''}"
        if instead:
            yield f"    record instead: {instead}"


def _sensors(channels: Sequence[str]) -> str:
    """Return whose problem it is; nothing where it is the whole recording's."""
    return "" if set(channels) <= {"", "*"} else sensors(channels)


def _numbers(effect: Effect) -> str:
    return effect.formula or "; ".join(amounts(effect.parameters))


def _better(diagnosis: Diagnosis, retuned_m: float | None) -> Iterator[str]:
    fit = diagnosis.fit
    if fit is None or "position_m" not in fit.confirm.before:
        return
    sides = [fit.confirm.before["position_m"], fit.confirm.after.get("position_m", math.nan)]
    own = math.nan if retuned_m is None else retuned_m
    before, after, tuned = quantities((*sides, own), "m")
    horizon = quantity(fit.horizon_s, "s")
    alone = "" if math.isnan(own) else f" (with its own numbers refitted alone: {tuned})"
    yield f"  position error after {horizon}, on unseen parts: {before} -> {after}{alone}"
