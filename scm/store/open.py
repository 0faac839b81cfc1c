"""Open a store by its URL: `sqlite:PATH`, `postgresql://...`, or `memory:`."""

from pathlib import Path

from scm.errors import StoreError
from scm.store.memory import MemoryStore
from scm.store.repository import Repository
from scm.store.sqlite import SqliteStore

_POSTGRES = ("postgresql:", "postgres:")


def open_store(url: str) -> Repository:
    """Open a store, and make it when it is new.

    Raises:
        StoreError: when the URL means no store, or that one cannot be opened.
    """
    if url.startswith(_POSTGRES):
        # Loads only with scm[postgres]
        from scm.store.postgres import PostgresStore  # noqa: PLC0415

        return PostgresStore(url)
    if url == "memory:":
        return MemoryStore()
    scheme, colon, path = url.partition(":")
    if scheme != "sqlite" or not colon or not path:
        msg = f"state {url!r}: expected sqlite:PATH, postgresql://USER@HOST/DATABASE or memory:"
        raise StoreError(msg)
    return SqliteStore(Path(path.removeprefix("//")))
