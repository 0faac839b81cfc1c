"""The controller's process stops in the middle of whatever it did."""

from signal import SIGSTOP

from scm.selftest.signal_fault import SignalFault

FAULT = SignalFault(what="frozen controller", expects=("stale", "overload"), process=SIGSTOP)
