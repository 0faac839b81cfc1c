"""Frames of an IP camera over HTTP: JPEGs one after the other in one endless response.

`multipart/x-mixed-replace`: each part has a few header lines and one JPEG. `Content-Length` is its
size if the camera sends it, else the JPEG ends at the next boundary. `X-Timestamp`, in seconds on
the camera's clock, is the time stamp if there is one.
"""

import base64
import math
import socket
from contextlib import suppress
from http.client import HTTPConnection, HTTPException, HTTPMessage, HTTPResponse, HTTPSConnection
from urllib.parse import SplitResult, unquote, urlsplit

from scm.clock import nanoseconds
from scm.errors import EyeError
from scm.eye.picture import decode_picture
from scm.eye.sources.capture import DamagedFrameError, Grabbed

TIMEOUT_S = 2.0  # without a byte
LONGEST_LINE, MOST_LINES, LARGEST = 65536, 64, 64 * 2**20


class MjpegCapture:
    """One response of an IP camera.

    Raises:
        EyeError: No answer, or no stream of JPEGs.
    """

    def __init__(self, address: str, timeout_s: float = TIMEOUT_S) -> None:
        url = urlsplit(address)
        self._connection = _connection(url, timeout_s)
        self._timeout_s = timeout_s
        self._jpeg: bytes = b""
        self._stamp_ns: int | None = None
        self._is_at_part = False
        try:
            self._connection.connect()
            self._socket: socket.socket = self._connection.sock
            self._connection.request("GET", _path(url), headers=_headers(url))
            self._answer = self._connection.getresponse()
            self._boundary = _boundary(self._answer)
        except (OSError, HTTPException) as cause:
            self._connection.close()
            raise EyeError(self._explain(cause)) from cause
        except EyeError:
            self._connection.close()
            raise

    def wait(self) -> None:
        """Read the next part; raises an `EyeError` if the camera is gone."""
        try:
            while not self._is_at_part:
                self._is_at_part = self._is_boundary(self._line())
            self._is_at_part = False
            self._jpeg, self._stamp_ns = self._part()
        except (OSError, HTTPException, ValueError, AttributeError) as cause:
            raise EyeError(self._explain(cause)) from cause

    def fetch(self) -> Grabbed:
        """Return the part's picture."""
        try:
            return Grabbed(decode_picture(self._jpeg, "a frame"), self._stamp_ns)
        except EyeError as cause:
            raise DamagedFrameError(str(cause)) from cause

    def interrupt(self) -> None:
        """Close the connection, which ends a wait for its data."""
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """Close the connection."""
        self._answer.close()
        self._connection.close()
        self._socket.close()

    def _line(self) -> bytes:
        line = self._answer.readline(LONGEST_LINE)
        if not line:
            raise EyeError("the camera ended the connection")
        return line

    def _part(self) -> tuple[bytes, int | None]:
        facts: dict[bytes, bytes] = {}
        for _ in range(MOST_LINES):
            name, _, value = self._line().partition(b":")
            if not name.strip():
                break
            facts[name.strip().lower()] = value.strip()
        length = facts.get(b"content-length", b"")
        jpeg = self._sized(int(length)) if length.isdigit() else self._unsized()
        return jpeg, _stamp_ns(facts.get(b"x-timestamp", b""))

    def _sized(self, size: int) -> bytes:
        if size > LARGEST:
            raise EyeError(f"expected a frame of at most {LARGEST} bytes, got {size}")
        data = self._answer.read(size)
        if len(data) < size:
            missing = size - len(data)
            raise EyeError(f"the camera ended the connection {missing} bytes before a frame's end")
        return data

    def _unsized(self) -> bytes:
        """Return the data before the next boundary, which is consumed."""
        lines: list[bytes] = []
        size = 0
        while size <= LARGEST:
            line = self._line()
            if self._is_boundary(line):
                self._is_at_part = True
                return b"".join(lines)
            lines.append(line)
            size += len(line)
        raise EyeError(f"expected a frame of at most {LARGEST} bytes, got more")

    def _is_boundary(self, line: bytes) -> bool:
        return line.startswith(b"--") and line.lstrip(b"-").startswith(self._boundary)

    def _explain(self, cause: Exception) -> str:
        if isinstance(cause, TimeoutError):
            return f"no answer for {self._timeout_s:g} s"
        return str(cause) or type(cause).__name__


def _connection(url: SplitResult, timeout_s: float) -> HTTPConnection:
    kind = HTTPSConnection if url.scheme == "https" else HTTPConnection
    return kind(url.hostname or "", url.port, timeout=timeout_s)


def _path(url: SplitResult) -> str:
    return (url.path or "/") + (f"?{url.query}" if url.query else "")


def _headers(url: SplitResult) -> dict[str, str]:
    if url.username is None:
        return {}
    both = f"{unquote(url.username)}:{unquote(url.password or '')}"
    return {"Authorization": f"Basic {base64.b64encode(both.encode()).decode()}"}


def _boundary(answer: HTTPResponse) -> bytes:
    """Return the boundary of parts, without its dashes."""
    if answer.status != 200:
        raise EyeError(f"the camera answers {answer.status} {answer.reason}")
    headers: HTTPMessage = answer.headers
    if headers.get_content_type() != "multipart/x-mixed-replace":
        got = headers.get_content_type()
        raise EyeError(f"expected a film of JPEGs (multipart/x-mixed-replace), got {got}")
    return (headers.get_boundary() or "").lstrip("-").encode()


def _stamp_ns(text: bytes) -> int | None:
    try:
        stamp_s = float(text)
    except ValueError:
        return None
    return nanoseconds(stamp_s) if math.isfinite(stamp_s) and stamp_s > 0.0 else None
