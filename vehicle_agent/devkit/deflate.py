"""A packet for a server that inflates: each piece is deflated once, however often it is sent.

A script's server unmasks each received byte in Python, and inflates in C. Base64 carries six bits
in eight, and lists of numbers far fewer: deflated (RFC 7692, permessage-deflate) a packet is the
size of its JPEGs. Most of a packet equals the one before, so a piece stores its deflated form, and
a packet is assembled from such forms and stored blocks:

    stored 42 number ["Bridge",{ | piece | stored , | piece | ... | stored }] | a last head

Each piece ends on a whole byte and refers to nothing outside itself. A server that does not know
the extension declines it, and receives the same packet as text.
"""

import struct
import zlib
from collections.abc import Sequence

from websockets.extensions import Extension
from websockets.extensions.permessage_deflate import (
    ClientPerMessageDeflateFactory,
    PerMessageDeflate,
)
from websockets.frames import Frame
from websockets.sync.client import ClientConnection
from websockets.typing import ExtensionParameter

LEVEL = 1
MAX_STORED_BYTES = 65_535
_LAST_HEAD = b"\x00"


class Piece:
    """A part of a packet that may be sent many times.

    Args:
        text: ASCII.
        is_picture: Whether only runs of one byte repeat in it: deflates in a quarter of the time.
    """

    __slots__ = ("_deflated", "_strategy", "text")

    def __init__(self, text: str = "", is_picture: bool = False) -> None:
        self.text = text
        self._strategy = zlib.Z_RLE if is_picture else zlib.Z_DEFAULT_STRATEGY
        self._deflated: bytes | None = None

    @property
    def deflated(self) -> bytes:
        """Whole deflate blocks, none of them final; created on first use."""
        if self._deflated is None:
            packer = zlib.compressobj(
                LEVEL, zlib.DEFLATED, -zlib.MAX_WBITS, strategy=self._strategy
            )
            begun = packer.compress(self.text.encode("ascii"))
            self._deflated = begun + packer.flush(zlib.Z_SYNC_FLUSH)
        return self._deflated


class Deflated(bytes):
    """A payload that is deflated already, without its last four bytes."""

    __slots__ = ()


class Packet:
    """One packet for a script.

    Args:
        event: Name of the Socket.IO event.
        pieces: Keys and values of one JSON object, without separators.
    """

    def __init__(self, event: str, pieces: Sequence[Piece]) -> None:
        self._event = event
        self._pieces = pieces

    def text(self, number: int | None) -> str:
        """Return the frame as text; `number` requests a confirmation, None does not."""
        body = ",".join(piece.text for piece in self._pieces)
        return f"{self._head(number)}{body}}}]"

    def deflated(self, number: int | None) -> Deflated:
        """Return the same, deflated."""
        comma = _stored(",")
        body = comma.join(piece.deflated for piece in self._pieces)
        return Deflated(_stored(self._head(number)) + body + _stored("}]") + _LAST_HEAD)

    def _head(self, number: int | None) -> str:
        return f'42{"" if number is None else number}["{self._event}",{{'


def _stored(text: str) -> bytes:
    """Return a short text as a deflate block that holds it as it is."""
    data = text.encode("ascii")
    return struct.pack("<BHH", 0, len(data), len(data) ^ MAX_STORED_BYTES) + data


class Inflating(PerMessageDeflate):
    """The negotiated extension: sends deflated payloads as they are, inflates the server's."""

    def encode(self, frame: Frame) -> Frame:
        """Mark deflated payloads; the rest goes as text."""
        if isinstance(frame.data, Deflated):
            return Frame(frame.opcode, frame.data, frame.fin, rsv1=True)
        return frame


class OfferToDeflate(ClientPerMessageDeflateFactory):
    """Offers compression to the server; a piece may refer back as far as deflate can."""

    def __init__(self) -> None:
        super().__init__(client_max_window_bits=None)

    def process_response_params(
        self, params: Sequence[ExtensionParameter], accepted_extensions: Sequence[Extension]
    ) -> Inflating:
        """Return the negotiated extension.

        Raises:
            NegotiationError: if the server requests what was not offered.
        """
        agreed = super().process_response_params(params, accepted_extensions)
        return Inflating(
            agreed.remote_no_context_takeover,
            agreed.local_no_context_takeover,
            agreed.remote_max_window_bits,
            agreed.local_max_window_bits,
        )


def inflates(connection: ClientConnection) -> bool:
    """Return whether the server at the other end inflates what is sent to it."""
    return any(isinstance(one, Inflating) for one in connection.protocol.extensions)
