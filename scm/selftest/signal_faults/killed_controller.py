"""The controller's process is gone at once."""

from signal import SIGKILL

from scm.selftest.signal_fault import SignalFault

FAULT = SignalFault(
    what="killed controller",
    expects=("stale", "overload", "skipped_yellow", "sequence"),
    process=SIGKILL,
)
