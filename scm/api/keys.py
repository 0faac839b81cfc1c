"""API keys: shown once, stored as salted hashes, compared in constant time.

A key reads `scm_<id>_<secret>`. The id finds its record; the secret is 256 random bits, so that one
fast hash is enough: there is nothing to guess that a slow one would protect.
"""

import hashlib
import hmac
import re
import secrets
from collections.abc import Iterator

import msgspec

from scm.api.roles import check_role
from scm.errors import AccessError, StoreError
from scm.records.keys import Role
from scm.store.repository import Repository

SECRET_BYTES = 32
MOST_OWNER = 64  # characters
_PREFIX = "api/"
_KEY = re.compile(r"scm_([0-9a-f]{8})_([A-Za-z0-9_-]{43})")
_PERSON = b"scm api key"


class KeyRecord(msgspec.Struct, frozen=True, kw_only=True):
    """What is stored of a key.

    Attributes:
        key_id: Public part of the key.
        owner: Whose it is, for people.
        role: What it may do.
        made_s: When it was made, seconds since 1970.
        salt, digest: Hexadecimal, of the secret.
    """

    key_id: str
    owner: str
    role: Role
    made_s: int
    salt: str
    digest: str


class KeyRing:
    """The keys of one city in a store; changes count at once, in every process that reads it."""

    def __init__(self, store: Repository) -> None:
        self._store = store
        self._lent: dict[str, tuple[KeyRecord, str]] = {}
        self._ended: set[str] = set()

    def add(self, owner: str, role: str, now_s: int) -> str:
        """Make a key; return it, for it is never shown again.

        Raises:
            AccessError: when there is no such role, or the owner's name is empty.
        """
        if not owner.strip() or len(owner) > MOST_OWNER:
            msg = f"owner: got {owner!r}, expected 1 to {MOST_OWNER} characters"
            raise AccessError(msg)
        key, record = _made(owner, check_role(role), now_s)
        self._store.put("credentials", _PREFIX + record.key_id, msgspec.json.encode(record))
        return key

    def lend(self, key: str, doing: str) -> str:
        """Make a key for a program that works for somebody: it may do what they may.

        It is not stored, and ends with this process, with theirs, or when it is revoked.

        Args:
            key: Theirs.
            doing: What the program is, in a word: its requests are signed by owner and this.

        Raises:
            AccessError: when their key has ended.
        """
        stored = self.record(public_part(key))
        lender = None if stored is None else whose(key, stored)
        if lender is None:
            msg = f"{doing}: the key of its requester has ended"
            raise AccessError(msg)
        lent, record = _made(f"{lender.owner}: {doing}"[:MOST_OWNER], lender.role, lender.made_s)
        self._lent[record.key_id] = record, lender.key_id
        return lent

    def end_lent(self, lent: str) -> None:
        """End a key that was lent."""
        self._lent.pop(public_part(lent), None)
        self._ended.add(public_part(lent))

    def records(self) -> Iterator[KeyRecord]:
        """Return what is stored of all keys, by id."""
        for name, body in self._store.items("credentials"):
            if name.startswith(_PREFIX):
                yield _read(name, body)

    def revoke(self, key_id: str) -> KeyRecord:
        """End a key, and return what was stored of it.

        Raises:
            AccessError: when there is none of that id.
        """
        body = self._store.get("credentials", _PREFIX + key_id)
        if body is None:
            msg = f"key: got {key_id!r}, expected the id of one: `scm key list` names them"
            raise AccessError(msg)
        self._store.delete("credentials", _PREFIX + key_id)
        self._ended.add(key_id)
        return _read(key_id, body)

    def has_ended(self, key_id: str) -> bool:
        """Return, without the store, whether a key or one it was lent for was ended here."""
        while key_id not in self._ended:
            if key_id not in self._lent:
                return False
            key_id = self._lent[key_id][1]
        return True

    def record(self, key_id: str) -> KeyRecord | None:
        """Return what is stored of a key by its id; None: it has ended, or its lender's has."""
        lent = self._lent.get(key_id)
        if lent is not None:
            record, lender = lent
            return record if self.record(lender) is not None else None
        body = self._store.get("credentials", _PREFIX + key_id)
        return None if body is None else _read(key_id, body)


def whose(key: str, record: KeyRecord) -> KeyRecord | None:
    """Return the record of the key's id if the key's secret is the one it was made with."""
    match = _KEY.fullmatch(key)
    if match is None or match[1] != record.key_id:
        return None
    given = _digest(match[2], bytes.fromhex(record.salt))
    return record if hmac.compare_digest(given, record.digest) else None


def public_part(key: str) -> str:
    """Return the public part that identifies a key; empty: it is no key."""
    match = _KEY.fullmatch(key)
    return match[1] if match is not None else ""


def _made(owner: str, role: Role, made_s: int) -> tuple[str, KeyRecord]:
    """Return a new key, and what is to be stored of it."""
    key_id, secret = secrets.token_hex(4), secrets.token_urlsafe(SECRET_BYTES)
    salt = secrets.token_bytes(hashlib.blake2b.SALT_SIZE)
    record = KeyRecord(
        key_id=key_id,
        owner=owner,
        role=role,
        made_s=made_s,
        salt=salt.hex(),
        digest=_digest(secret, salt),
    )
    return f"scm_{key_id}_{secret}", record


def _digest(secret: str, salt: bytes) -> str:
    return hashlib.blake2b(secret.encode(), salt=salt, person=_PERSON).hexdigest()


def _read(name: str, body: bytes) -> KeyRecord:
    try:
        return msgspec.json.decode(body, type=KeyRecord)
    except msgspec.MsgspecError as cause:
        msg = f"credentials, {name}: {cause}; expected the record of an API key"
        raise StoreError(msg) from cause
