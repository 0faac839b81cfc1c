"""Red follows green at once."""

from scm.selftest.signal_fault import SignalFault, cut_short

FAULT = SignalFault(
    what="skipped yellow",
    expects=("skipped_yellow",),
    output=cut_short("yellow", "red", after_ms=0),
)
