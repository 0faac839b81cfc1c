"""A yellow ends after 0.1 s."""

from scm.selftest.signal_fault import SignalFault, cut_short

FAULT = SignalFault(
    what="short yellow",
    expects=("short_yellow",),
    output=cut_short("yellow", "red", after_ms=100),
)
