"""A part of a recording: what was recorded between two moments."""

import math
from dataclasses import replace

from scm.errors import RecordingError
from scm.recording.read import Channel, Recording


def part_of(recording: Recording, from_s: float | None, to_s: float | None) -> Recording:
    """Return what lies between two moments, seconds since the recording's begin; None: its end.

    It begins with its first row, or as a run of a city does. Times stay as they were recorded.

    Raises:
        RecordingError: when nothing lies there; with what there is.
    """
    if from_s is None and to_s is None:
        return recording
    times = [channel.t for channel in recording.channels.values() if len(channel.t)]
    starts = min((float(t.min()) for t in times), default=0.0)
    begin_s = starts if recording.begin_s is None else recording.begin_s
    first = begin_s + (0.0 if from_s is None else from_s)
    last = math.inf if to_s is None else begin_s + to_s
    channels = {
        name: cut
        for name, channel in recording.channels.items()
        if len((cut := _between(channel, first, last)).t)
    }
    if not channels:
        ends = max((float(t.max()) for t in times), default=0.0)
        span = f"from {from_s or 0.0:g} s" + ("" if to_s is None else f" to {to_s:g} s")
        of = f" of {recording.name}" if recording.begin_s is not None else ""
        msg = f"{recording.path}: {span}: nothing{of} was recorded there that can be driven again; "
        msg += f"there is from {starts - begin_s:.1f} s to {ends - begin_s:.1f} s"
        raise RecordingError(msg)
    return replace(recording, channels=channels)


def _between(channel: Channel, first: float, last: float) -> Channel:
    inside = (channel.t >= first) & (channel.t <= last)
    return replace(channel, t=channel.t[inside], values=channel.values[inside])
