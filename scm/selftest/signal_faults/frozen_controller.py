"""The controller's process stops at an arbitrary point."""

from signal import SIGSTOP

from scm.selftest.signal_fault import SignalFault

FAULT = SignalFault(what="frozen controller", expects=("stale", "overload"), process=SIGSTOP)
