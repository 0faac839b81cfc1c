"""Every error this project raises on purpose.

    ScmError
    ├── MapError      (ValueError)       a map file or a route through it
    ├── CarError      (ValueError)       a car file
    ├── TermError     (ValueError)       a physical effect, or the assembly of several
    ├── MessageError  (ValueError)       a message, a key, or bytes that should have been one
    ├── RecordingError(ValueError)       a recording or its description
    ├── PlanError     (ValueError)       a signal plan or program card
    ├── PathError     (ValueError)       a start, a goal, or a path between them that cannot be
    ├── DemandError   (ValueError)       a table of who wants to drive where, and when
    ├── StudyError    (ValueError)       a study file, a factor or a scenario
    ├── LearningError (ValueError)       a demonstration, or a trained network
    ├── EyeError      (ValueError)       a camera or its calibration
    ├── LinkError     (ConnectionError)  the bus, a serial line, a peer that is not there
    ├── StoreError    (OSError)          state that must survive, and cannot be read or written
    ├── AccessError   (PermissionError)  credentials, and what somebody may not do
    ├── LeaseError    (PermissionError)  driving a car that somebody else owns
    ├── RunError      (RuntimeError)     a city that cannot start or go on
    └── VoidError     (RuntimeError)     a measurement that something in the city made void

A message states what was wrong, where (file and key), the value and what was expected.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

MAX_REASON = 200  # characters of another library's words: a line of a terminal or two


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


class PathError(ScmError, ValueError):
    """A start or a goal where no car can be, or no path between them."""


class DemandError(ScmError, ValueError):
    """A demand table that cannot be."""


class StudyError(ScmError, ValueError):
    """A study file, what its factors name, or a scenario that cannot be."""


class LearningError(ScmError, ValueError):
    """A demonstration, a trained network, or a car that one cannot drive."""


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


class VoidError(ScmError, RuntimeError):
    """A void measurement: signals flashed, a part was lost, or the computer was too slow."""


def nearest(name: str, valid: Sequence[str]) -> str:
    """Return " (did you mean 'x'?)" for the closest valid name, or an empty string.

    Use at the end of an error message about an unknown name.
    """
    from difflib import get_close_matches  # noqa: PLC0415  only ever needed on the way to an error

    close = get_close_matches(name, list(valid), n=1)
    return f" (did you mean {close[0]!r}?)" if close else ""


@contextmanager
def reading(
    path: Path, what: str, error: type[ScmError] = RecordingError, hint: str = ""
) -> Iterator[None]:
    """Turn whatever a library raises over a file that a user gave into one line of ours.

    Args:
        path: The file.
        what: Which kind of file was expected: "a Parquet file".
        error: What to raise.
        hint: What to do about it.

    Raises:
        ScmError: an `error` that names the file, what was expected and what was found.
    """
    try:
        yield
    except ScmError:
        raise
    except Exception as cause:
        msg = f"{path}: {_refusal(cause, what)}{hint and f': {hint}'}"
        raise error(msg) from cause


def _refusal(cause: Exception, what: str) -> str:
    """Return why a file cannot be read, in one line."""
    if isinstance(cause, OSError) and cause.strerror:
        return f"cannot be read: {cause.strerror}"
    if isinstance(cause, MemoryError):
        return f"not {what} that can be read: it declares more than fits into memory"
    if isinstance(cause, UnicodeDecodeError):
        return f"not {what} that can be read: it is not text in UTF-8 (byte {cause.start})"
    if isinstance(cause, RecursionError):
        return f"not {what} that can be read: it is nested too deeply"
    words = " ".join(str(cause).split())
    words = words if len(words) <= MAX_REASON else words[:MAX_REASON] + " ..."
    kind = "" if words and isinstance(cause, OSError | ValueError) else f"{type(cause).__name__} "
    return f"not {what} that can be read: {kind}{words}".rstrip()
