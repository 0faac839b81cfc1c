"""Every error this project raises on purpose.

    ScmError
    ├── MapError      (ValueError)       a map file or a route through it
    ├── CarError      (ValueError)       a car file
    ├── TermError     (ValueError)       a physical effect, or the assembly of several
    ├── MessageError  (ValueError)       a message, a key, or bytes that should have been one
    ├── RecordingError(ValueError)       a recording or its description
    ├── PlanError     (ValueError)       a signal plan or program card
    ├── EyeError      (ValueError)       a camera or its calibration
    ├── LinkError     (ConnectionError)  the bus, a serial line, a peer that is not there
    ├── StoreError    (OSError)          state that must survive, and cannot be read or written
    ├── AccessError   (PermissionError)  credentials, and what somebody may not do
    ├── LeaseError    (PermissionError)  driving a car that somebody else owns
    └── RunError      (RuntimeError)     a city that cannot start or go on

A message says what was wrong, where (file and key), what was got and what was expected.
"""

from collections.abc import Sequence


class ScmError(Exception):
    """Base of all errors raised on purpose; the command line prints it and exits with 2."""


class MapError(ScmError, ValueError):
    """A map file, or a route that its lanes do not allow."""


class CarError(ScmError, ValueError):
    """A car file: an unknown key, a wrong unit, a value outside its bounds."""


class TermError(ScmError, ValueError):
    """A physical effect that cannot be read, or effects that cannot be assembled."""


class MessageError(ScmError, ValueError):
    """A key or bytes that do not make a valid message."""


class RecordingError(ScmError, ValueError):
    """A recording, its description file, or a channel of it."""


class PlanError(ScmError, ValueError):
    """A signal plan or a program card that is not safe or not complete."""


class EyeError(ScmError, ValueError):
    """A camera model or its calibration."""


class LinkError(ScmError, ConnectionError):
    """The bus, a serial line, or a peer that does not answer."""


class StoreError(ScmError, OSError):
    """State that must survive, and cannot be read or written."""


class AccessError(ScmError, PermissionError):
    """Credentials: a fleet file, a certificate, a key, or what somebody may not do."""


class LeaseError(ScmError, PermissionError):
    """A command for a car that somebody else owns."""


class RunError(ScmError, RuntimeError):
    """A city that cannot start or cannot go on."""


def nearest(name: str, valid: Sequence[str]) -> str:
    """Return " (did you mean 'x'?)" for the closest valid name, or an empty string.

    Use at the end of an error message about an unknown name.
    """
    from difflib import get_close_matches  # noqa: PLC0415  only ever needed on the way to an error

    close = get_close_matches(name, list(valid), n=1)
    return f" (did you mean {close[0]!r}?)" if close else ""
