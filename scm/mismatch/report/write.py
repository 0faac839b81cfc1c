"""Writes a report: `report.html`, `report.json`, `car.toml` and `pictures/` of one diagnosis.

`drawn.json` holds what the pictures draw and the sentences beside them, for other programs.
`summary` returns the few lines that the command prints at the end.
"""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path

from scm.data_quality.quality import DataProblem
from scm.errors import CarError
from scm.mismatch.evidence import Evidence
from scm.mismatch.findings import Course, Diagnosis, Effect
from scm.mismatch.report.car_file import FILE, given_text, write_car, write_own_terms
from scm.mismatch.report.page import page_html
from scm.mismatch.report.record import drawn_text, json_text, make_report, on_clock, since_start
from scm.mismatch.report.sentences import can_judge, processor_sentence, sensors, verdict_sentence
from scm.mismatch.report.wording import (
    amounts,
    bicycle_name,
    percent,
    pretty,
    quantities,
    quantity,
    title_of,
)
from scm.vehicles.car import Car

PAGE, FIELDS, DRAWN, PICTURES = "report.html", "report.json", "drawn.json", "pictures"
GIVEN, WINDOWS = "given.toml", "windows.csv"


def write_report(
    diagnosis: Diagnosis, evidence: Evidence, car: Car, patched: Car, out: Path, check: str = ""
) -> None:
    """Write everything into the folder `out`, which is made if it is missing.

    Args:
        diagnosis: What was found.
        evidence: What is drawn.
        car: As given.
        patched: The same with the effects found. An effect outside the library is one of its own,
            read from a file that is still there; the file is copied beside `car.toml`.
        out: Pictures of an earlier report there are removed.
        check: The command that computes the report's figures again; empty: none is printed.
    """
    pictures = out / PICTURES
    pictures.mkdir(parents=True, exist_ok=True)
    for old in pictures.glob("*.svg"):
        old.unlink()
    use = _write_car(since_start(diagnosis, evidence), evidence, car, patched, out)
    _write_windows(evidence, car, out)
    if check and diagnosis.fit is not None:
        use += f". These figures are of that file; to compute them again: `{check}`"
    report = make_report(diagnosis, evidence, car, patched)
    (out / FIELDS).write_text(json_text(on_clock(diagnosis, evidence)), encoding="utf-8")
    (out / DRAWN).write_text(drawn_text(report), encoding="utf-8")
    for picture in report.pictures.all():
        (pictures / f"{picture.name}.svg").write_text(picture.as_file(), encoding="utf-8")
    (out / PAGE).write_text(page_html(report, use), encoding="utf-8")


def _write_car(diagnosis: Diagnosis, evidence: Evidence, car: Car, patched: Car, out: Path) -> str:
    """Write the car file, and return what to do with it; without it there is still a report."""
    try:
        files = write_car(diagnosis, evidence, car, patched, out)
    except CarError as error:
        (out / FILE).unlink(missing_ok=True)
        return f"The car with what was found could not be written as a file: {error}"
    beside = f" It needs {', '.join(files[1:])} beside it." if files[1:] else ""
    courses = [effect.course for effect in diagnosis.effects]
    during = " (`during.toml` is the car with what came and went)"
    during = during if Course.INTERMITTENT in courses else ""
    if not _is_changed(car, patched):
        return f"`{FILE}` beside this page is the car as it was given{during}.{beside}"
    stays = any(course is not Course.INTERMITTENT for course in courses)
    what = "with what was found" if stays else "with its own numbers refitted"
    if Course.STEP in courses or Course.RAMP in courses:
        what += ", as it was at the end of the recording; `before.toml` is the car as it was before"
    what += during
    if any(effect.is_of_recording for effect in diagnosis.effects):
        what += ", but without laws against its time, which `recorded.toml` has as well"
    return (
        f"`{FILE}` beside this page is the given car {what}.{beside} The simulator loads it; see "
        f"how it does on another drive: `scm replay ANOTHER_DRIVE --car {FILE}`"
    )


def _write_windows(evidence: Evidence, car: Car, out: Path) -> None:
    """Write the car as given and when each window starts, to simulate them again."""
    (out / GIVEN).write_text(given_text(car), encoding="utf-8")
    write_own_terms(car, out)
    runs = evidence.free_runs
    if runs is None:
        (out / WINDOWS).unlink(missing_ok=True)
        return
    files = runs.file or (FILE,) * len(runs.part)
    rows = zip(runs.recording.tolist(), runs.part, runs.stamp_s.tolist(), files, strict=True)
    lines = [f"{number},{part},{start:.6f},{file}" for number, part, start, file in rows]
    header = "recording,part,start_s,car"
    (out / WINDOWS).write_text("\n".join([header, *lines, ""]), encoding="utf-8")


def _is_changed(car: Car, patched: Car) -> bool:
    return (car.terms, car.measures, dict(car.values)) != (
        patched.terms,
        patched.measures,
        dict(patched.values),
    )


def summary(diagnosis: Diagnosis, out: Path, retuned_m: float | None = None) -> str:
    """Return the verdict, each effect, how much better, and where the page is.

    `retuned_m` is the error of the car with its own numbers refitted alone; None: not mentioned.
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
    for gone in diagnosis.dropped:
        yield f"  not confirmed: {gone.text}"
    if diagnosis.failure:
        yield from (f"  {text}" for text in (diagnosis.failure.text, *diagnosis.failure.reasons))
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
    bicycle = math.nan if fit.witness is None else fit.witness.position_m
    before, after, tuned, plain = quantities((*sides, own, bicycle), "m")
    horizon = quantity(fit.horizon_s, "s")
    beside = [] if math.isnan(own) else [f"with its own numbers refitted alone: {tuned}"]
    beside += [] if fit.witness is None else [f"a {bicycle_name(fit.witness)}: {plain}"]
    brackets = f" ({'; '.join(beside)})" if beside else ""
    yield f"  position error after {horizon}, on unseen parts: {before} -> {after}{brackets}"
