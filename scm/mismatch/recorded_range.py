"""The range of what an effect depends on, as recordings cover it: there the effect was seen.

A written effect that grows with a variable is limited to it: beyond, it acts as at the nearest end.
Except of places the size counts, and only its upper end limits: a car at rest is inside, and one
side is like the other.
"""

import re
from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
from msgspec import structs

from scm.mismatch.discovery.general_effect import GAIN
from scm.mismatch.effect_catalogue import Candidate, identifications
from scm.mismatch.findings import Range
from scm.mismatch.fit.hypothesis import Hypothesis
from scm.mismatch.report.wording import joined
from scm.replay.drive import Drive
from scm.replay.recorded_variables import (
    HOT_S,
    LATERAL,
    PLACE,
    PLACES,
    VARIABLES,
    WARM_S,
    YAW_RATE,
    mean_throttle,
    moving,
    range_of,
)

Ranges = Mapping[str, Range]  # by variable
NO_RANGES: Ranges = MappingProxyType({})
HEADING, STEERING = "heading", "steering angle"
LIMIT = "steering.limit_rad"  # without it no command is an angle
DECIMALS = 4  # of a range's ends in a file
TURN = 2.0 * np.pi
WHOLE_TURN_GAP = 0.35  # rad; headings of a drive all around are nowhere further apart
_SPEED, _THROTTLE, _STEERING = (VARIABLES[PLACES[n]] for n in ("speed", "throttle", STEERING))
_OF_WORD = {
    "speed": (_SPEED,), "throttle": (_THROTTLE,), "torque": (_THROTTLE,), "position": PLACE,
    "yaw rate": (YAW_RATE,), "use": (mean_throttle(WARM_S),), "long use": (mean_throttle(HOT_S),),
    **dict.fromkeys(("load", "lateral acceleration", "lateral force", "slip", "slip history"),
                    (LATERAL,)),
    **dict.fromkeys(("steering", STEERING, "steering sign", "steering history", "left turns",
                     "right turns"), (_STEERING,)),
}  # fmt: skip
_NAMES = {
    "vx": "speed", "throttle_command": "throttle", "steer_demand": STEERING,
    "linkage_angle": STEERING, "yaw_rate": "yaw rate", "accel_y": "lateral acceleration",
    "throttle_memory": "mean throttle", "x_cog": "x", "y_cog": "y",
}  # fmt: skip
_COORDINATES = ("x_cog", "y_cog")
_OF_KNOWN = {**_OF_WORD, "load": (_THROTTLE,)}  # a motor's


def recorded_range(fitted: Hypothesis, effect: Candidate) -> dict[str, Range]:
    """Return the range of each variable that an effect of a hypothesis depends on.

    Time has none, and neither has what a recording does not show, such as the turn of a wheel.
    """
    drives, found = fitted.model.drives, dict[str, Range]()
    values = fitted.values[fitted.place_of(effect)].tolist()
    numbers = dict(zip((one.name for one in effect.parameters), values, strict=True))
    of_word = dict(_OF_KNOWN if effect.name in identifications() else _OF_WORD)
    of_word["throttle's past"] = (mean_throttle(numbers.get("memory_s", WARM_S)),)
    for word in effect.depends_on:
        if word == HEADING:
            found |= _headings(drives)
        for variable in of_word.get(word, ()):
            ends = range_of(variable, drives)
            if ends is not None and (variable is not _STEERING or fitted.model.car.has(LIMIT)):
                found[variable.name] = Range(low=ends[0], high=ends[1], unit=variable.unit)
    if STEERING in found:
        found |= {STEERING: _of_wheels(found[STEERING], fitted)}
    return found


def _of_wheels(demanded: Range, fitted: Hypothesis) -> Range:
    """Return the range of the wheels' angle, which a steering gain above 1 makes wider."""
    own = fitted.model.car.value(GAIN) if fitted.model.car.has(GAIN) else 1.0
    wider = max(1.0, fitted.numbers.get(GAIN, own))
    return structs.replace(demanded, high=wider * demanded.high)


def _headings(drives: Sequence[Drive]) -> dict[str, Range]:
    """Return the range of headings, that begins within -pi to pi; a whole turn without a gap."""
    seen = np.concatenate([d.smoothed["pose.yaw"].at(d.edges)[moving(d)] for d in drives])
    if not len(seen):
        return {}
    at = np.sort(np.mod(seen + np.pi, TURN) - np.pi)
    gaps = np.diff(at, append=at[0] + TURN)
    widest = int(np.argmax(gaps))
    if gaps[widest] < WHOLE_TURN_GAP:
        return {HEADING: Range(low=-np.pi, high=np.pi, unit="rad")}
    low, high = float(at[(widest + 1) % len(at)]), float(at[widest])
    return {HEADING: Range(low=low, high=high + TURN * (high < low), unit="rad")}


def holds(ranges: Ranges, *, limited: bool) -> str:
    """Return where a written effect holds, as its file's docstring has it."""
    if not ranges:
        return "within what the recording showed"
    where = [
        f"{name} {one.low:.3g} to {one.high:.3g} {one.unit}".removesuffix(" 1")
        for name, one in ranges.items()
    ]
    outside = "outside, as at the nearest end" if "x" in ranges else "above, as at the upper end"
    beyond = f"; {outside}" if limited else ""
    return f"at {joined(where)}, which the recording showed{beyond}"


def limit(text: str, variables: Sequence[str], ranges: Ranges) -> tuple[list[str], str]:
    """Return lines that limit physics variables to their ranges, and an expression of these."""
    lines = list[str]()
    for variable in variables:
        one = ranges.get(_NAMES.get(variable, ""))
        if one is not None:
            least = one.low if variable in _COORDINATES else -one.high
            low, high = (round(end, DECIMALS) for end in (least, one.high))
            inside = f"{variable}_in_range"
            lines.append(f"{inside} = min(max({variable}, {low}), {high})")
            text = re.sub(rf"\b{variable}\b", inside, text)
    return lines, text
