"""Correct a recording for the sensor faults that a car file lists.

The faults are inverted one by one, the last first, by Newton's method on every sample: one step
for a fault of a channel's own value or stamp, a few for one that depends on other channels.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from scm.arrays import Floats
from scm.recording.read import Recording
from scm.vehicles.sensor_fault import AppliedFault, Series, apply_faults

POSES = ("pose.x", "pose.y", "pose.yaw")
MAX_ITERATIONS = 50
TOLERANCE = 1e-9  # metre, radian or second; below any sensor's resolution
STEP = 1e-3


def without_faults(
    recording: Recording, faults: Iterable[AppliedFault], names: Sequence[str] = POSES
) -> Recording:
    """Return the recording with some channels corrected for these faults.

    Args:
        recording: As measured.
        faults: In the order in which they acted; faults of other channels are ignored.
        names: Channels to correct; missing ones are skipped.
    """
    known = {name: recording.channels[name] for name in names if name in recording.channels}
    now = {name: Series(channel.t, channel.values) for name, channel in known.items()}
    acting = [fault for fault in faults if any(fault.function_for(name) for name in known)]
    if not acting:
        return recording
    for fault in reversed(acting):
        now = _without(now, fault)
    right = {
        name: replace(known[name], t=series.t_s, values=series.values)
        for name, series in now.items()
    }
    return replace(recording, channels={**recording.channels, **right})


def _without(seen: Mapping[str, Series], fault: AppliedFault) -> dict[str, Series]:
    """Invert one fault: return the channels before it acted."""
    true, concerned = dict(seen), [name for name in seen if fault.function_for(name)]
    for _ in range(MAX_ITERATIONS):
        again = apply_faults(true, [fault])
        missing = {name: _changing(seen[name], fault) - _changing(again[name], fault)
                   for name in concerned}  # fmt: skip
        if max(float(np.abs(miss).max(initial=0.0)) for miss in missing.values()) < TOLERANCE:
            break
        slopes = {name: _slope(true, name, again, fault) for name in concerned}
        for name, miss in missing.items():
            step = np.divide(miss, slopes[name], out=np.zeros_like(miss), where=slopes[name] != 0.0)
            true[name] = _moved(true[name], fault, step)
    return true


def _slope(
    true: Mapping[str, Series], name: str, now: Mapping[str, Series], fault: AppliedFault
) -> Floats:
    """Return the derivative of the measured channel by the true one, per sample."""
    start_s = min(float(series.t_s[0]) for series in true.values())
    stepped = {**true, name: _moved(true[name], fault, np.array(STEP))}
    changed = apply_faults(stepped, [fault], start_s)[name]
    return (_changing(changed, fault) - _changing(now[name], fault)) / STEP


def _changing(series: Series, fault: AppliedFault) -> Floats:
    return series.t_s if fault.kind.stamps else series.values


def _moved(series: Series, fault: AppliedFault, step: Floats) -> Series:
    if fault.kind.stamps:
        return replace(series, t_s=series.t_s + step)
    return replace(series, values=series.values + step)
