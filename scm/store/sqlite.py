"""A store in one file: SQLite with a write-ahead log.

Every commit reaches the disk before it returns (`synchronous=FULL`): a killed process loses
nothing either way, but with less a power cut could take back a lease that somebody already drives
on. Several processes may share the file; who writes waits for the others up to `BUSY_S`.
"""

import contextlib
import sqlite3
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from scm.errors import StoreError
from scm.store.repository import Entry, Log, Table

BUSY_S = 5.0
APPLICATION_ID = 0x53434D31  # "SCM1": tells our files from other people's

_TABLE = "CREATE TABLE {} (key TEXT PRIMARY KEY, value BLOB NOT NULL) WITHOUT ROWID"
_NEVER = "CREATE TRIGGER audit_no_{0} BEFORE {0} ON audit BEGIN SELECT RAISE(ABORT, '{1}'); END"

MIGRATIONS: tuple[tuple[str, ...], ...] = (
    (
        *(_TABLE.format(name) for name in ("leases", "plans", "answers", "credentials")),
        "CREATE TABLE audit (number INTEGER PRIMARY KEY, body BLOB NOT NULL)",
        _NEVER.format("UPDATE", "audit is append-only"),
        _NEVER.format("DELETE", "audit is append-only"),
    ),
    tuple(_TABLE.format(name) for name in ("latches", "marks")),
    (_TABLE.format("seen"),),
    (_TABLE.format("calibrations"),),
    (_TABLE.format("twins"),),
    (_TABLE.format("handovers"),),
)
"""What each schema version adds to the one before; `PRAGMA user_version` counts them."""


class SqliteStore:
    """A store in a file; see `scm.store.repository.Repository`.

    Raises:
        StoreError: when the file cannot be opened, is broken, locked, somebody else's, or written
            by a newer version.
    """

    def __init__(self, path: Path, busy_s: float = BUSY_S) -> None:
        self._path = path
        self._lock = threading.RLock()
        self._depth = 0
        self._closed = False
        with self._errors("open"):
            self._db = sqlite3.connect(
                path, timeout=busy_s, isolation_level=None, check_same_thread=False
            )
        try:
            with self._errors("open"):
                self._prepare()
        except BaseException:
            self._db.close()
            raise

    def get(self, table: Table, key: str) -> bytes | None:
        """Return a value; None: there is none of that key."""
        rows = self._run(f"SELECT value FROM {table} WHERE key = ?", key)
        return bytes(rows[0][0]) if rows else None

    def put(self, table: Table, key: str, value: bytes) -> None:
        """Write a value over whatever was there."""
        self._run(f"INSERT OR REPLACE INTO {table} VALUES (?, ?)", key, value)

    def delete(self, table: Table, key: str) -> None:
        """Take a value away; nothing happens when there is none."""
        self._run(f"DELETE FROM {table} WHERE key = ?", key)

    def items(self, table: Table) -> Iterator[tuple[str, bytes]]:
        """Return all keys with their values, sorted by key."""
        rows = self._run(f"SELECT key, value FROM {table} ORDER BY key")
        return iter([(str(key), bytes(value)) for key, value in rows])

    def append(self, log: Log, body: bytes) -> int:
        """Add an entry to a log; return its number."""
        number = f"SELECT coalesce(max(number), 0) + 1, ? FROM {log}"
        with self.transaction():
            return int(self._run(f"INSERT INTO {log} {number} RETURNING number", body)[0][0])

    def entries(self, log: Log, after: int = 0, limit: int = 500) -> list[Entry]:
        """Return entries after a number, in order."""
        sql = f"SELECT number, body FROM {log} WHERE number > ? ORDER BY number LIMIT ?"
        return [Entry(int(number), bytes(body)) for number, body in self._run(sql, after, limit)]

    def last(self, log: Log) -> Entry | None:
        """Return the newest entry; None: there is none."""
        rows = self._run(f"SELECT number, body FROM {log} ORDER BY number DESC LIMIT 1")
        return Entry(int(rows[0][0]), bytes(rows[0][1])) if rows else None

    @contextmanager
    def transaction(self) -> Iterator[None]:
        """Let everything inside happen at once, or not at all; inside another one it joins it."""
        with self._lock:
            if self._depth == 0:
                self._run("BEGIN IMMEDIATE")
            self._depth += 1
            try:
                yield
            except BaseException:
                self._depth -= 1
                self._roll_back()
                raise
            self._depth -= 1
            if self._depth == 0:
                try:
                    self._run("COMMIT")
                except StoreError:
                    self._roll_back()
                    raise

    def close(self) -> None:
        """Leave; safe to call twice."""
        with self._lock:
            self._closed = True
            with self._errors("close"):
                self._db.close()

    def _roll_back(self) -> None:
        if self._depth == 0 and self._db.in_transaction:
            with contextlib.suppress(sqlite3.Error):
                self._db.execute("ROLLBACK")

    def _prepare(self) -> None:
        db = self._db
        ours = db.execute("PRAGMA application_id").fetchone()[0]
        version = db.execute("PRAGMA user_version").fetchone()[0]
        tables = db.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]
        if tables and ours != APPLICATION_ID:
            msg = f"state {self._path}: an SQLite file, but not one of a city"
            raise StoreError(msg)
        if version > len(MIGRATIONS):
            msg = (
                f"state {self._path}: written by a newer scm "
                f"(schema {version}, expected at most {len(MIGRATIONS)})"
            )
            raise StoreError(msg)
        found = db.execute("PRAGMA quick_check(1)").fetchone()[0]
        if found != "ok":
            msg = f"state {self._path}: the file is broken ({found}); restore a copy of it"
            raise StoreError(msg)
        db.execute("PRAGMA journal_mode = WAL")
        db.execute("PRAGMA synchronous = FULL")
        self._migrate()

    def _migrate(self) -> None:
        with self.transaction():
            version = self._db.execute("PRAGMA user_version").fetchone()[0]
            for script in MIGRATIONS[version:]:
                for sql in script:
                    self._db.execute(sql)
            if version < len(MIGRATIONS):
                self._db.execute(f"PRAGMA application_id = {APPLICATION_ID}")
                self._db.execute(f"PRAGMA user_version = {len(MIGRATIONS)}")

    def _run(self, sql: str, *values: object) -> list[tuple[Any, ...]]:
        with self._lock:
            if self._closed:
                msg = f"state {self._path}: it is closed"
                raise StoreError(msg)
            with self._errors(sql.partition(" ")[0].lower()):
                return self._db.execute(sql, values).fetchall()

    @contextmanager
    def _errors(self, what: str) -> Iterator[None]:
        try:
            yield
        except sqlite3.Error as cause:
            msg = f"state {self._path}: cannot {what}: {_why(cause)}"
            raise StoreError(msg) from cause


def _why(cause: sqlite3.Error) -> str:
    """Return an error that explains SQLite's message to whoever runs the city."""
    code = getattr(cause, "sqlite_errorcode", 0) & 0xFF
    meanings = {
        sqlite3.SQLITE_BUSY: "another process keeps it locked",
        sqlite3.SQLITE_FULL: "the disk is full",
        sqlite3.SQLITE_IOERR: f"the disk does not take it ({cause})",
        sqlite3.SQLITE_CORRUPT: f"the file is broken ({cause}); restore a copy of it",
        sqlite3.SQLITE_NOTADB: "this is no SQLite file",
        sqlite3.SQLITE_READONLY: "it may not be written",
        sqlite3.SQLITE_CANTOPEN: "it cannot be opened: is there such a folder, may we write there?",
    }
    return meanings.get(code, str(cause))
