"""The controller's process is killed."""

from signal import SIGKILL

from scm.selftest.signal_fault import SignalFault

FAULT = SignalFault(
    what="killed controller",
    expects=("stale", "overload", "skipped_yellow", "sequence"),
    process=SIGKILL,
)
