"""Operations on keys of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.connection import Connection, part
from scm.records.keys import AllKeys, KeyRow


class KeysNoun:
    """Operations on keys."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def all_keys(self) -> AllKeys:
        """All API keys, without their secrets."""
        return self._connection.request("GET", "/api/v1/keys", AllKeys)

    def revoke(self, key_id: str, *, idempotency_key: str = "") -> KeyRow:
        """End an API key at once.

        Args:
            key_id: public part of the key
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "DELETE", f"/api/v1/keys/{part(key_id)}", KeyRow, key=idempotency_key
        )
