"""Operations on keys of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.operation import Noun, operation
from scm.records.keys import AllKeys, KeyRow


class KeysNoun(Noun):
    """Operations on keys."""

    @operation("GET", "/api/v1/keys")
    def all_keys(self) -> AllKeys:
        """All API keys, without their secrets."""

    @operation("DELETE", "/api/v1/keys/{key_id}")
    def revoke(self, key_id: str, *, idempotency_key: str = "") -> KeyRow:
        """End an API key at once.

        Args:
            key_id: public part of the key
        """
