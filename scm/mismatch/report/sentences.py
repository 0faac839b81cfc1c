"""The sentences of a report: the verdict, where and when, how much better, what to do."""

import math
from collections.abc import Iterable, Sequence

from msgspec import structs

from scm.data_quality.quality import DataProblem, Span
from scm.mismatch.effect_catalogue import identifications
from scm.mismatch.findings import Course, Diagnosis, Effect, Equation, Located, Place, Verdict
from scm.mismatch.report.wording import (
    amounts,
    bicycle_name,
    capital,
    joined,
    moment,
    percent,
    quantities,
    quantity,
    short,
    title_of,
)

_MAX_NAMED_EFFECTS = 4  # in the verdict's sentence
_WHOLE_PROCESSOR = 0.8  # share; below it, a search on an idle computer is clearly faster
_COUNTS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")
_PARTS_OF_CAR = {
    Equation.DRIVE: "In the drive",
    Equation.STEERING: "In the steering",
    Equation.TYRE: "In the tyres",
    Equation.BODY: "On the body",
    Equation.SURFACE: "From the floor",
    Equation.SENSOR: "In the measurements",
}
_SENSORS = {  # what a person calls the channels, in the order in which they are named
    "the whole recording": ("*",),
    "measured position": ("pose.x", "pose.y", "pose.z"),
    "measured heading": ("pose.yaw",),
    "measured tilt": ("pose.roll", "pose.pitch"),
    "poses": ("pose.*",),
    "gyro": ("imu.gyro_x", "imu.gyro_y", "imu.gyro_z"),
    "accelerometer": ("imu.accel_x", "imu.accel_y", "imu.accel_z"),
    "IMU": ("imu.*",),
    "yaw rate": ("yaw_rate",),
    "measured velocity": ("velocity.x", "velocity.y", "velocity.*"),
    "speed": ("speed",),
    "wheel speeds": ("wheel_speed.fl", "wheel_speed.fr", "wheel_speed.rl", "wheel_speed.rr",
                     "wheel_speed.*"),
    "encoders": ("encoder.left", "encoder.right", "encoder.*"),
    "battery voltage": ("battery.voltage", "battery.*"),
    "motor current": ("motor.current", "motor.*"),
    "throttle command": ("command.throttle",),
    "steering command": ("command.steering",),
    "speed command": ("command.speed",),
    "acceleration command": ("command.acceleration",),
    "commands": ("command.*",),
}  # fmt: skip
_SINGLE = {"encoder.left": "left encoder", "encoder.right": "right encoder"}
_NEARLY_ALL = 0.995  # share of the error
_NOT_INFORMATIVE = ("constant", "wheel")  # variables that explain nothing to a reader
_MAX_SPANS = 4  # named by their times
_UNKNOWN_EFFECT = (
    "No known effect explains it, so look at what changes with {drivers}. Until the cause is "
    "found, car.toml contains the formula as it was measured."
)
_OF_RECORDING = (
    "No known effect explains it, so look at what changes with time. Another drive has another "
    "time, so car.toml does not contain it; recorded.toml does."
)
_KNOWN_EFFECT = (
    "Compare the car with the numbers above, and correct the car file where they are right: "
    "car.toml has them."
)


def verdict_sentence(diagnosis: Diagnosis) -> str:
    """Return what the recording shows about the simulator, in one sentence."""
    if not diagnosis.effects and any(p.name == "other_car" for p in diagnosis.data):
        return "The car file does not fit this recording: another car was driven."
    if not can_judge(diagnosis):
        return "This recording does not allow a verdict on the car."
    if diagnosis.verdict is Verdict.UNDECIDED:
        return _undecided_sentence(diagnosis)
    if len(diagnosis.effects) > _MAX_NAMED_EFFECTS:
        return _counting_sentence(diagnosis.effects)
    return _naming_sentence(diagnosis.effects) if diagnosis.effects else _no_name(diagnosis)


def _no_name(diagnosis: Diagnosis) -> str:
    """Return that no effect was found, and whether there was time to look for all."""
    if diagnosis.verdict is Verdict.NONE and diagnosis.unanswered:
        return "Nothing beyond noise was found, but time ran out before everything was checked."
    if diagnosis.verdict is Verdict.NONE and diagnosis.fit and diagnosis.fit.stated:
        return "Nothing new: the simulator follows the car as nearly as its file states."
    if diagnosis.verdict is Verdict.NONE:
        return "Nothing beyond noise: the simulator drives as the car does."
    if diagnosis.unanswered:
        return "Simulator and recording differ, and time ran out before a cause was found."
    return "Simulator and recording differ, and no cause could be named."


def processor_sentence(diagnosis: Diagnosis) -> str:
    """Return that other processes slowed the search down; empty if they did not."""
    share = diagnosis.processor_share
    if not diagnosis.unanswered or share is None or share >= _WHOLE_PROCESSOR:
        return ""
    return f"This process got {percent(share)} of a processor: the computer was busy."


def _naming_sentence(effects: Sequence[Effect]) -> str:
    """Return a sentence that separates what the car does from what its sensors do."""
    car, sensors_ = (
        joined([effect_title(e) for e in effects if (e.equation is Equation.SENSOR) is sensor])
        for sensor in (False, True)
    )
    if not sensors_:
        return f"The simulator leaves out {car}."
    if not car:
        return f"The measurements are off, not the car: {sensors_}."
    return f"The simulator leaves out {car}, and the measurements are off: {sensors_}."


def _counting_sentence(effects: Sequence[Effect]) -> str:
    sensor = sum(effect.equation is Equation.SENSOR for effect in effects)
    car = len(effects) - sensor
    faults = f"the measurements have {count(sensor)} fault{'s' if sensor > 1 else ''}"
    if not car:
        return f"The measurements are off, not the car: {faults}."
    left_out = f"The simulator leaves out {count(car)} effect{'s' if car > 1 else ''}"
    return f"{left_out}, and {faults}." if sensor else f"{left_out}."


def count(number: int) -> str:
    """Return a small number as a word."""
    return _COUNTS[number] if number < len(_COUNTS) else str(number)


def all_named(effects: Sequence[Effect]) -> str:
    """Return the names of the effects if the verdict's sentence only counts them."""
    if len(effects) <= _MAX_NAMED_EFFECTS:
        return ""
    return capital(joined([effect_title(effect) for effect in effects])) + "."


def effect_title(effect: Effect) -> str:
    """Return an effect as the verdict names it, with a note if the library does not have it."""
    name = title_of(effect.name)
    if effect.since_s is not None and effect.until_s is not None:
        return f"{name} from {effect.since_s.value:.0f} s to {effect.until_s.value:.0f} s"
    if effect.since_s is not None:
        return f"{name} since {effect.since_s.value:.0f} s"
    if effect.course is Course.RAMP:
        return f"{name}, growing over the recording"
    return name if effect.is_known else f"{name}, an effect outside its library"


def since_sentence(effect: Effect) -> str:
    """Return since when an effect is as it is, or from when to when it was there; empty: always."""
    before = "; ".join(amounts(effect.before))
    was = f" Before: {before}." if before else ""
    if effect.since_s is not None and effect.until_s is not None:
        return (
            f"From {moment(effect.since_s)} to {moment(effect.until_s)}; the numbers are those "
            f"between, and the car at the end is without it.{was}"
        )
    if effect.since_s is not None:
        return f"{moment(effect.since_s)}; the numbers are those after it.{was}"
    if effect.course is Course.RAMP:
        return f"It grows evenly over the recording; the numbers are those of its end.{was}"
    return ""


def range_sentence(effect: Effect) -> str:
    """Return where an effect was seen, of what it depends on; empty if nothing is known of it."""
    seen = list[str]()
    for name, one in effect.recorded_range.items():
        low, high = quantities((one.low, one.high), one.unit)
        seen.append(f"{name} {low.rpartition(' ')[0] or low} to {high}")
    return f"Seen at {joined(seen)}." if seen else ""


def _undecided_sentence(diagnosis: Diagnosis) -> str:
    between = [title_of(name) for u in diagnosis.undecided for name in u.between]
    either = joined(list(dict.fromkeys(between)), "or")
    if not either:
        return "Something is left out, but this recording does not show what."
    open_names = {name for u in diagnosis.undecided for name in u.between}
    sure = [effect_title(e) for e in diagnosis.effects if e.name not in open_names]
    also = f"{joined(sure)}; and " if sure else ""
    return capital(f"{also}{either}: this recording cannot tell which.")


def can_judge(diagnosis: Diagnosis) -> bool:
    """Return whether the car itself could be judged at all."""
    if diagnosis.fit is not None or diagnosis.effects or diagnosis.undecided:
        return True
    return diagnosis.verdict is not Verdict.NONE or not diagnosis.data


def better_sentence(diagnosis: Diagnosis, retuned_m: float | None = None) -> str:
    """Return how much better the simulator got; empty if nothing was fitted.

    `retuned_m` is the error of the car with only its own numbers refitted; None: not mentioned.
    """
    fit = diagnosis.fit
    if fit is None:
        return ""
    before, after = (side.get("position_m") for side in (fit.confirm.before, fit.confirm.after))
    if before is None or after is None:
        return ""
    floor = fit.confirm.noise_floor.get("position_m", math.nan)
    own = math.nan if retuned_m is None else retuned_m
    bicycle = math.nan if fit.witness is None else fit.witness.position_m
    was, now, tuned, noise, other = quantities((before, after, own, floor, bicycle), "m")
    plain = f" A {bicycle_name(fit.witness)} is {other} off." if fit.witness else ""
    text = (
        f"On parts of the recording that no fit has seen, after {quantity(fit.horizon_s, 's')} of "
        f"driving by the recorded commands alone, the simulator is {was} off"
    )
    if diagnosis.effects:
        found = "the likeliest of them" if diagnosis.undecided else "what was found"
        alone = f"; with its own numbers refitted alone, {tuned}" if math.isfinite(own) else ""
        beside = f" as well, {now}" if alone else f" and its own numbers refitted, {now}"
        return f"{text}{alone}; with {found}{beside}.{plain}"
    if diagnosis.undecided and after < before:
        text += f"; with the best of these, {now}"
    elif diagnosis.verdict is Verdict.NONE:
        text += f"; with its own numbers refitted within their standard deviations, {now}"
    noise = f" Measurement noise alone causes {noise}." if floor > 0 else ""
    return f"{text}.{plain}{noise}"


def advice_of(effect: Effect) -> str:
    """Return what to check or repair; for an effect outside the library, where to look."""
    if effect.is_known:
        known = identifications().get(effect.name)
        return known.advice if known and known.advice else _KNOWN_EFFECT
    if effect.is_of_recording:
        return _OF_RECORDING
    head, against, variable = effect.name.partition(" against ")
    base = identifications().get(head.replace(" ", "_"))
    if against and base and base.varies:
        return f"{base.advice} See how it changes with {variable}: car.toml has it so."
    return _UNKNOWN_EFFECT.format(drivers=" and ".join(effect.depends_on) or "the drive")


def checks_of(names: Sequence[str]) -> list[str]:
    """Return what to check for each of several effects of which one is present."""
    known = identifications()
    return [
        f"{capital(title_of(n))}: {known[n].advice}"
        for n in names
        if n in known and known[n].advice
    ]


def where_and_when(found: Sequence[Located]) -> str:
    """Return where and when the error occurs."""
    return " ".join(_one_place(located) for located in found)


def _one_place(located: Located) -> str:
    where = _place(located.where) if located.where else "everywhere on the floor"
    when = spans(located.when_s) if located.when_s else "all the time"
    text = f"{_PARTS_OF_CAR[located.equation]}, {where}, {when}."
    if located.channels:
        text += f" Shows in {sensors(located.channels)}."
    drivers = [name for name in located.depends_on if name not in _NOT_INFORMATIVE]
    if drivers:
        text += f" Depends on {joined(drivers)}."
    share = located.share_of_error
    much = "nearly all" if share > _NEARLY_ALL else percent(share)
    return f"{text} It makes {much} of the error."


def _place(box: Place) -> str:
    (x0, x1), (y0, y1) = box.x_m, box.y_m
    return f"at x {short(x0)} to {short(x1)} m, y {short(y0)} to {short(y1)} m"


def spans(when_s: Sequence[Span]) -> str:
    """Return spans of time, the first few by their numbers."""
    shown = [f"{a:.1f} to {b:.1f} s" for a, b in when_s[:_MAX_SPANS]]
    more = len(when_s) - len(shown)
    return "at " + ", ".join(shown) + (f" and {more} more times" if more else "")


def sensors(channels: Sequence[str]) -> str:
    """Return channels as a person would name them, each sensor once; a text may name several."""
    named = {channel: words for words, group in _SENSORS.items() for channel in group}
    channels = [channel for text in channels for channel in text.split(", ")]
    if len(channels) == 1 and channels[0] in _SINGLE:
        return _SINGLE[channels[0]]
    return joined(list(dict.fromkeys(named.get(channel, channel) for channel in channels)))


def pressing_problems(diagnosis: Diagnosis) -> Sequence[DataProblem]:
    """Return data problems that prevent a verdict, or that the next recording can avoid."""
    open_ones = [problem for problem in diagnosis.data if not problem.corrected]
    if can_judge(diagnosis):
        open_ones = [problem for problem in open_ones if problem.record_instead]
    return sorted(open_ones, key=lambda problem: problem.name != "other_car")


def other_problems_sentence(diagnosis: Diagnosis, recordings: Sequence[str]) -> str:
    """Return one line about the other problems; empty if there are none."""
    pressing = pressing_problems(diagnosis)
    others = [problem for problem in diagnosis.data if problem not in pressing]
    fixed, noticed = (
        _named([p for p in others if bool(p.corrected) is corrected], recordings)
        for corrected in (True, False)
    )
    text = f"Corrected in the recording before the car was judged: {fixed}. " if fixed else ""
    return text + (f"Noticed in the recording and left unchanged: {noticed}. " if noticed else "")


def _named(problems: Sequence[DataProblem], recordings: Sequence[str]) -> str:
    groups = alike(problems, recordings)
    names = [f"{p.name.replace('_', ' ')} of {sensors(c)}" for p, c, _ in groups]
    return joined(list(dict.fromkeys(names)))


def alike(
    problems: Iterable[DataProblem], recordings: Sequence[str], *, by_channel: bool = False
) -> list[tuple[DataProblem, list[str], list[str]]]:
    """Return problems that say the same, once, with their channels and recordings.

    Args:
        problems: Of one recording or several; then a text begins with the recording's name.
        recordings: Names.
        by_channel: Keep problems of different channels apart.
    """
    found: dict[DataProblem, tuple[list[str], list[str]]] = {}
    for problem in problems:
        name = next((r for r in recordings if problem.text.startswith(f"{r}: ")), "")
        text = problem.text.removeprefix(f"{name}: ") if name else problem.text
        key = structs.replace(problem, text=text, channel=problem.channel if by_channel else "")
        channels, names = found.setdefault(key, ([], []))
        channels.append(problem.channel)
        names.append(name)
    return [
        (problem, list(dict.fromkeys(channels)), list(dict.fromkeys(filter(None, names))))
        for problem, (channels, names) in found.items()
    ]
