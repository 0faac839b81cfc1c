"""A part of a recording: what was recorded between two moments."""

import math
from dataclasses import replace

from scm.errors import RecordingError
from scm.recording.read import Channel, Recording


def part_of(recording: Recording, from_s: float | None, to_s: float | None) -> Recording:
    """Return what lies between two moments, seconds since the recording's first row; None: its end.

    Times stay as they were recorded.

    Raises:
        RecordingError: when nothing lies there.
    """
    if from_s is None and to_s is None:
        return recording
    starts = [float(channel.t.min()) for channel in recording.channels.values() if len(channel.t)]
    start_s = min(starts, default=0.0)
    first = start_s + (0.0 if from_s is None else from_s)
    last = math.inf if to_s is None else start_s + to_s
    channels = {
        name: cut
        for name, channel in recording.channels.items()
        if len((cut := _between(channel, first, last)).t)
    }
    if not channels:
        msg = f"{recording.path}: from {from_s} s to {to_s} s: nothing was recorded there"
        raise RecordingError(msg)
    return replace(recording, channels=channels)


def _between(channel: Channel, first: float, last: float) -> Channel:
    inside = (channel.t >= first) & (channel.t <= last)
    return replace(channel, t=channel.t[inside], values=channel.values[inside])
