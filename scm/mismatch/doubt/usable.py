"""Which parts of a recording can be used: no gaps, no jumps, nothing frozen."""

from collections.abc import Iterable

from scm.mismatch.doubt.rows import gaps_of
from scm.mismatch.doubt.suspicion import Usable
from scm.mismatch.doubt.track import clean
from scm.mismatch.findings import DataProblem, Span
from scm.recording.read import Recording

SHORTEST_SPAN_S = 0.5
SHORTEST_DRIVE_S = 5.0
POSE = ("pose.x", "pose.y", "pose.yaw")
COMMANDS = ("command.throttle", "command.speed", "command.steering")
SPOILS = ("frozen", "jump")


def usable(recording: Recording, problems: Iterable[DataProblem]) -> Usable:
    """Return the usable spans of each channel, and what keeps the recording from being used.

    Args:
        recording: After repair.
        problems: Found in it.
    """
    listed = list(problems)
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
    return Usable(spans=spans, lacks=tuple(_lacks(spans, listed)))


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


def _lacks(spans: dict[str, tuple[Span, ...]], problems: list[DataProblem]) -> Iterable[str]:
    missing = [name for name in POSE if not spans.get(name)]
    driven = [name for name in COMMANDS if spans.get(name)]
    if missing or not driven:
        yield f"missing: {', '.join(missing or COMMANDS)}"
        return
    if any(p.name == "other_car" for p in problems):
        yield "the car file is another car's"
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
