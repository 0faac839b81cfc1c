"""Which parts of a recording can be used: no gaps, no jumps, nothing frozen."""

from collections.abc import Iterable

from scm.data_quality.conclusion import OTHER_CAR
from scm.data_quality.problem import DataProblem, Span
from scm.data_quality.rows import gaps_of
from scm.data_quality.suspicion import Usable
from scm.data_quality.track import clean
from scm.recording.read import Recording
from scm.vehicles.car import Car
from scm.vehicles.drive_channel import drive_name

SHORTEST_SPAN_S = 0.5
SHORTEST_DRIVE_S = 5.0
POSE = ("pose.x", "pose.y", "pose.yaw")
COMMANDS = ("command.throttle", "command.steering")
SPOILS = ("frozen", "jump")


def usable(recording: Recording, problems: Iterable[DataProblem], car: Car | None = None) -> Usable:
    """Return the usable spans of each channel, and what keeps the recording from being used.

    Args:
        recording: After repair.
        problems: Found in it.
        car: Says what drives it; None takes a throttle for granted.
    """
    listed = list(problems)
    driver = drive_name(recording, car) if car else COMMANDS[0]
    spans: dict[str, tuple[Span, ...]] = {}
    for name, channel in recording.channels.items():
        t = clean(channel).t
        if len(t) < 2:
            spans[name] = ()
            continue
        bad = list(gaps_of(t, name.startswith("command.")))
        for problem in listed:
            if problem.name in SPOILS and problem.when_s and _concerns(problem.channel, name):
                bad += problem.when_s
        spans[name] = _between((float(t[0]), float(t[-1])), bad)
    return Usable(spans=spans, lacks=tuple(_lacks(spans, listed, driver)))


def _concerns(pattern: str, name: str) -> bool:
    return pattern in (name, "*") or (pattern.endswith(".*") and name.startswith(pattern[:-1]))


def _between(whole: Span, bad: Iterable[Span]) -> tuple[Span, ...]:
    """Return what of a span is left between bad ones."""
    start, left = whole[0], []
    for begin, end in sorted(bad):
        if begin - start >= SHORTEST_SPAN_S:
            left.append((start, begin))
        start = max(start, end)
    if whole[1] - start >= SHORTEST_SPAN_S:
        left.append((start, whole[1]))
    return tuple(left)


def _lacks(
    spans: dict[str, tuple[Span, ...]], problems: list[DataProblem], driver: str
) -> Iterable[str]:
    driven = (driver, COMMANDS[1])
    missing = [name for name in (*driven, *POSE) if not spans.get(name)]
    if missing:
        yield f"missing: {', '.join(missing)}"
        return
    if any(p.name == "time_backwards" and p.channel == "*" for p in problems):
        yield "time runs backwards"
    if any(p.name == "standing" for p in problems):
        yield "the car does not move"
    if any(p.name == "other_car" for p in problems):
        yield OTHER_CAR
    unrelated = [p.channel for p in problems if p.name == "without_effect"]
    if unrelated:
        yield f"commands without effect: {', '.join(unrelated)}"
    pose = sum(end - start for start, end in spans["pose.x"])
    if pose < SHORTEST_DRIVE_S:
        yield f"only {pose:.1f} s of poses without gaps; {SHORTEST_DRIVE_S:.0f} s are needed"
    together = [spans[name] for name in (*driven, *POSE)]
    start = max(part[0][0] for part in together)
    end = min(part[-1][1] for part in together)
    if end - start < SHORTEST_DRIVE_S <= pose:
        yield f"poses and commands overlap for {max(0.0, end - start):.1f} s only"
