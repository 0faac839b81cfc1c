"""The verdict as one plain sentence, and what a data problem means for it."""

from collections.abc import Sequence

from scm.data_quality.problem import DataProblem
from scm.mismatch.findings import Diagnosis, Effect, Equation, Verdict
from scm.mismatch.report.wording import capital, joined, percent, title_of

_MOST_NAMED = 4  # effects in the verdict's sentence
_WHOLE_PROCESSOR = 0.8  # below, a search on an idle computer is clearly faster
_COUNTS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")


def verdict_sentence(diagnosis: Diagnosis) -> str:
    """Return what the recording says about the simulator, in one sentence."""
    if not diagnosis.effects and any(p.name == "other_car" for p in diagnosis.data):
        return "The car file does not fit this recording: another car was driven."
    if not can_judge(diagnosis):
        return "This recording does not allow a verdict on the car."
    if diagnosis.verdict is Verdict.UNDECIDED:
        return _undecided_sentence(diagnosis)
    if diagnosis.effects:
        return _mismatch_sentence(diagnosis.effects)
    return _nothing_named(diagnosis)


def _nothing_named(diagnosis: Diagnosis) -> str:
    """Say that no effect was found, and whether there was time to look for all."""
    if diagnosis.verdict is Verdict.NONE and diagnosis.unanswered:
        return "Nothing beyond noise was found, but time ran out before all was asked."
    if diagnosis.verdict is Verdict.NONE:
        return "Nothing beyond noise: the simulator drives as the car does."
    if diagnosis.unanswered:
        return "Simulator and recording differ, and time ran out before a cause was found."
    return "Simulator and recording differ, and no cause could be named."


def processor_said(diagnosis: Diagnosis) -> str:
    """Say that other processes took the time that a search lacked; nothing where they did not."""
    share = diagnosis.processor_share
    if not diagnosis.unanswered or share is None or share >= _WHOLE_PROCESSOR:
        return ""
    return f"This process got {percent(share)} of a processor: the computer was busy."


def _mismatch_sentence(effects: Sequence[Effect]) -> str:
    """Say apart what the car does and what only its measuring does."""
    if len(effects) > _MOST_NAMED:
        return _many_sentence(effects)
    car, measuring = (
        joined([effect_title(e) for e in effects if (e.equation is Equation.SENSOR) is sensor])
        for sensor in (False, True)
    )
    if not measuring:
        return f"The simulator leaves out {car}."
    if not car:
        return f"Not the car, its measuring is off: {measuring}."
    return f"The simulator leaves out {car}, and the measuring is off: {measuring}."


def _many_sentence(effects: Sequence[Effect]) -> str:
    """Count effects that no sentence can hold."""
    measuring = sum(effect.equation is Equation.SENSOR for effect in effects)
    car = len(effects) - measuring
    faults = f"{count(measuring)} fault{'s' if measuring > 1 else ''}"
    if not car:
        return f"Not the car, its measuring is off: it has {faults}."
    left_out = f"The simulator leaves out {count(car)} effect{'s' if car > 1 else ''}"
    return f"{left_out}, and the measuring has {faults}." if measuring else f"{left_out}."


def count(number: int) -> str:
    """Return a small number as a word."""
    return _COUNTS[number] if number < len(_COUNTS) else str(number)


def all_named(effects: Sequence[Effect]) -> str:
    """Return the effects by name where the verdict's sentence only counts them."""
    if len(effects) <= _MOST_NAMED:
        return ""
    return capital(joined([effect_title(effect) for effect in effects])) + "."


def effect_title(effect: Effect) -> str:
    """Return an effect as the verdict names it; one outside the library says so."""
    name = title_of(effect.name)
    return name if effect.is_known else f"{name}, an effect outside its library"


def _undecided_sentence(diagnosis: Diagnosis) -> str:
    between = [title_of(name) for u in diagnosis.undecided for name in u.between]
    either = joined(list(dict.fromkeys(between)), "or")
    if not either:
        return "Something is left out, but this recording does not tell what."
    open_names = {name for u in diagnosis.undecided for name in u.between}
    sure = [effect_title(e) for e in diagnosis.effects if e.name not in open_names]
    also = f"{joined(sure)}; and " if sure else ""
    return capital(f"{also}{either}: this recording cannot tell which.")


def can_judge(diagnosis: Diagnosis) -> bool:
    """Return whether the car itself could be judged at all."""
    if diagnosis.fit is not None or diagnosis.effects or diagnosis.undecided:
        return True
    return diagnosis.verdict is not Verdict.NONE or not diagnosis.data


def pressing_problems(diagnosis: Diagnosis) -> Sequence[DataProblem]:
    """Return data problems in the verdict's way, or that the next recording avoids."""
    open_ones = [problem for problem in diagnosis.data if not problem.corrected]
    if can_judge(diagnosis):
        open_ones = [problem for problem in open_ones if problem.record_instead]
    return sorted(open_ones, key=lambda problem: problem.name != "other_car")


def other_problems(diagnosis: Diagnosis, *, corrected: bool) -> Sequence[DataProblem]:
    """Return the other data problems, those put right or those only noticed."""
    pressing = pressing_problems(diagnosis)
    others = [problem for problem in diagnosis.data if problem not in pressing]
    return [problem for problem in others if bool(problem.corrected) is corrected]
