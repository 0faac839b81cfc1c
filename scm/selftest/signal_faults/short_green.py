"""A green ends after 0.3 s: too short for any car to be over the line."""

from scm.selftest.signal_fault import SignalFault, cut_short

FAULT = SignalFault(
    what="short green",
    expects=("short_green",),
    output=cut_short("green", "yellow", after_ms=300),
)
