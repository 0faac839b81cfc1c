"""Signed CAMs: each keeps its sender's signature from the antenna to every reader.

The bus signs the CAMs of its station and rejects received ones that are unsigned, changed, old,
repeated, or signed by another station; parts are not involved. A car signs with its own ticket, the
world with its own for all cars that it hosts. The signature covers a hash of station, time and body
as JSON.
"""

import base64
import binascii
import hashlib

import msgspec

from scm.errors import AccessError
from scm.v2x.credentials import Credentials
from scm.v2x.message import Message
from scm.v2x.messages.cam import CamRx, CamTx
from scm.v2x.signing import CAM, Signer, Ticket, Verifier
from scm.v2x.tickets import certificate_of, read_ticket

WORLD_STATION = "world"
"""The station that signs for hosted cars."""

_encoder = msgspec.json.Encoder()


class SignedCams:
    """Signs and checks the CAMs of one station.

    Raises:
        AccessError: when the credentials' ticket or authority is invalid.
    """

    def __init__(self, credentials: Credentials) -> None:
        own = credentials.ticket
        self._ticket = read_ticket(own, credentials.ticket_key) if own else None
        self._verifier = Verifier(certificate_of(credentials.air_authority))
        self._signers: dict[str, Signer] = {}
        self._last: dict[str, CamTx | CamRx] = {}
        self._newest_ns: dict[tuple[str, str], int] = {}

    def signed(self, message: Message, now_ns: int) -> Message:
        """Return a CAM with our signature; other messages and signed CAMs unchanged."""
        if not isinstance(message, CamTx | CamRx) or message.signed or self._ticket is None:
            return message
        last = self._last.get(message.station)
        if last is None or last.body is not message.body or last.t_ns != message.t_ns:
            text = self._sign(self._ticket, message, now_ns)
            last = self._last[message.station] = msgspec.structs.replace(message, signed=text)
        return msgspec.structs.replace(message, signed=last.signed)

    def _sign(self, ticket: Ticket, cam: CamTx | CamRx, now_ns: int) -> str:
        signer = self._signers.get(cam.station)
        if signer is None:
            signer = self._signers[cam.station] = Signer(ticket)
        return base64.b64encode(signer.sign(_hash(cam), CAM, now_ns)).decode()

    def check(self, message: Message, now_ns: int) -> None:
        """Check that a CAM was signed recently by its station.

        Raises:
            AccessError: when it was not, with the reason.
            MessageError: when the signature cannot be read.
        """
        if not isinstance(message, CamTx | CamRx):
            return
        if not message.signed:
            msg = f"{message.station}: it is not signed"
            raise AccessError(msg)
        try:
            data = base64.b64decode(message.signed, validate=True)
        except (binascii.Error, ValueError) as cause:
            msg = f"{message.station}: its signature is no base64"
            raise AccessError(msg) from cause
        found = self._verifier.verify(data, now_ns)
        if found.station not in (message.station, WORLD_STATION):
            msg = f"{message.station}: it is signed by {found.station}"
            raise AccessError(msg)
        if found.psid != CAM or found.payload != _hash(message):
            msg = f"{message.station}: something else was signed"
            raise AccessError(msg)
        self._check_new(message, found.t_ns)

    def _check_new(self, cam: CamTx | CamRx, t_ns: int) -> None:
        stream = (getattr(cam, "receiver", ""), cam.station)
        if t_ns <= self._newest_ns.get(stream, 0):
            msg = f"{cam.station}: a newer one came before it"
            raise AccessError(msg)
        self._newest_ns[stream] = t_ns


def _hash(cam: CamTx | CamRx) -> bytes:
    signed_bytes = f"{cam.station} {cam.t_ns} ".encode() + _encoder.encode(cam.body)
    return hashlib.sha256(signed_bytes).digest()
