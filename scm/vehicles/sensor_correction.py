"""A recording as it would be without the faults of measurement that a car file states.

The faults are undone one after another, the last first, each by Newton's rule on every sample: a
law of a channel's own value or stamp takes one step, one that looks at other channels a few.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from scm.arrays import Floats
from scm.recording.read import Recording
from scm.vehicles.measure import Fault, Series, measure

POSES = ("pose.x", "pose.y", "pose.yaw")
ROUNDS = 50
ENOUGH = 1e-9  # metre, radian or second
NUDGE = 1e-3


def without_faults(
    recording: Recording, faults: Iterable[Fault], names: Sequence[str] = POSES
) -> Recording:
    """Return the recording with some channels as they would be without these faults.

    Args:
        recording: As measured.
        faults: In the order in which they acted; those of other channels do not matter.
        names: Channels to put right; those that are not there are left out.
    """
    known = {name: recording.channels[name] for name in names if name in recording.channels}
    now = {name: Series(channel.t, channel.values) for name, channel in known.items()}
    acting = [fault for fault in faults if any(fault.law_of(name) for name in known)]
    if not acting:
        return recording
    for fault in reversed(acting):
        now = _without(now, fault)
    right = {
        name: replace(known[name], t=series.t_s, values=series.values)
        for name, series in now.items()
    }
    return replace(recording, channels={**recording.channels, **right})


def _without(seen: Mapping[str, Series], fault: Fault) -> dict[str, Series]:
    """Return the channels that one fault made these of."""
    true, concerned = dict(seen), [name for name in seen if fault.law_of(name)]
    for _ in range(ROUNDS):
        again = measure(true, [fault])
        missing = {name: _changing(seen[name], fault) - _changing(again[name], fault)
                   for name in concerned}  # fmt: skip
        if max(float(np.abs(miss).max(initial=0.0)) for miss in missing.values()) < ENOUGH:
            break
        slopes = {name: _slope(true, name, again, fault) for name in concerned}
        for name, miss in missing.items():
            step = np.divide(miss, slopes[name], out=np.zeros_like(miss), where=slopes[name] != 0.0)
            true[name] = _moved(true[name], fault, step)
    return true


def _slope(
    true: Mapping[str, Series], name: str, now: Mapping[str, Series], fault: Fault
) -> Floats:
    """Return how much of a channel's change is measured, by sample."""
    start_s = min(float(series.t_s[0]) for series in true.values())
    nudged = {**true, name: _moved(true[name], fault, np.array(NUDGE))}
    changed = measure(nudged, [fault], start_s)[name]
    return (_changing(changed, fault) - _changing(now[name], fault)) / NUDGE


def _changing(series: Series, fault: Fault) -> Floats:
    return series.t_s if fault.measure.stamps else series.values


def _moved(series: Series, fault: Fault, step: Floats) -> Series:
    if fault.measure.stamps:
        return replace(series, t_s=series.t_s + step)
    return replace(series, values=series.values + step)
