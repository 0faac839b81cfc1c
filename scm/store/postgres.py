"""A store on a PostgreSQL server, for cities that share one, or whose machine may burn.

Transactions of all processes take turns by an advisory lock, as in a file. A connection that broke
is opened again at the next use; what was under way is reported as a StoreError, never repeated in
secret: whether a commit that broke off has happened only the server knows.
"""

import contextlib
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, LiteralString

from scm.errors import StoreError
from scm.store.repository import Entry, Log, Table

try:
    import psycopg
    from psycopg.conninfo import conninfo_to_dict
except ImportError as missing:
    msg = "state on a PostgreSQL server needs `pip install scm[postgres]`"
    raise StoreError(msg) from missing

CONNECT_S = 5
STATEMENT_MS = 5000
_TURN = 0x53434D31  # the advisory lock of all cities' stores in one database

MIGRATIONS: tuple[tuple[LiteralString, ...], ...] = (
    (
        'CREATE TABLE leases (key TEXT COLLATE "C" PRIMARY KEY, value BYTEA NOT NULL)',
        'CREATE TABLE plans (key TEXT COLLATE "C" PRIMARY KEY, value BYTEA NOT NULL)',
        'CREATE TABLE answers (key TEXT COLLATE "C" PRIMARY KEY, value BYTEA NOT NULL)',
        'CREATE TABLE credentials (key TEXT COLLATE "C" PRIMARY KEY, value BYTEA NOT NULL)',
        "CREATE TABLE audit (number BIGINT PRIMARY KEY, body BYTEA NOT NULL)",
        "CREATE FUNCTION audit_never() RETURNS trigger LANGUAGE plpgsql AS "
        "$$ BEGIN RAISE EXCEPTION 'audit is append-only'; END $$",
        "CREATE TRIGGER audit_only_grows BEFORE UPDATE OR DELETE OR TRUNCATE ON audit "
        "FOR EACH STATEMENT EXECUTE FUNCTION audit_never()",
    ),
    (
        'CREATE TABLE latches (key TEXT COLLATE "C" PRIMARY KEY, value BYTEA NOT NULL)',
        'CREATE TABLE marks (key TEXT COLLATE "C" PRIMARY KEY, value BYTEA NOT NULL)',
    ),
    ('CREATE TABLE seen (key TEXT COLLATE "C" PRIMARY KEY, value BYTEA NOT NULL)',),
    ('CREATE TABLE calibrations (key TEXT COLLATE "C" PRIMARY KEY, value BYTEA NOT NULL)',),
    ('CREATE TABLE twins (key TEXT COLLATE "C" PRIMARY KEY, value BYTEA NOT NULL)',),
    ('CREATE TABLE handovers (key TEXT COLLATE "C" PRIMARY KEY, value BYTEA NOT NULL)',),
)
"""What each schema version adds to the one before; the table `scm_schema` counts them."""


class PostgresStore:
    """A store on a server; see `scm.store.repository.Repository`.

    Raises:
        StoreError: when the server cannot be reached, refuses, or holds a newer schema.
    """

    def __init__(self, url: str) -> None:
        self._url = url
        self._where = _without_password(url)
        self._lock = threading.RLock()
        self._depth = 0
        self._closed = False
        self._connection: psycopg.Connection[Any] | None = None
        try:
            with self.transaction():
                self._migrate()
        except BaseException:
            self.close()
            raise

    def get(self, table: Table, key: str) -> bytes | None:
        """Return a value; None: there is none of that key."""
        rows = self._run(f"SELECT value FROM {table} WHERE key = %s", [key])
        return bytes(rows[0][0]) if rows else None

    def put(self, table: Table, key: str, value: bytes) -> None:
        """Write a value over whatever was there."""
        sql = f"INSERT INTO {table} VALUES (%s, %s) ON CONFLICT (key) DO UPDATE SET value = %s"
        self._run(sql, [key, value, value])

    def delete(self, table: Table, key: str) -> None:
        """Take a value away; nothing happens when there is none."""
        self._run(f"DELETE FROM {table} WHERE key = %s", [key])

    def items(self, table: Table) -> Iterator[tuple[str, bytes]]:
        """Return all keys with their values, sorted by key."""
        rows = self._run(f"SELECT key, value FROM {table} ORDER BY key")
        return iter([(str(key), bytes(value)) for key, value in rows])

    def append(self, log: Log, body: bytes) -> int:
        """Add an entry to a log; return its number."""
        number = f"SELECT coalesce(max(number), 0) + 1, %s FROM {log}"
        return int(self._run(f"INSERT INTO {log} {number} RETURNING number", [body])[0][0])

    def entries(self, log: Log, after: int = 0, limit: int = 500) -> list[Entry]:
        """Return entries after a number, in order."""
        sql = f"SELECT number, body FROM {log} WHERE number > %s ORDER BY number LIMIT %s"
        return [Entry(int(number), bytes(body)) for number, body in self._run(sql, [after, limit])]

    def last(self, log: Log) -> Entry | None:
        """Return the newest entry; None: there is none."""
        rows = self._run(f"SELECT number, body FROM {log} ORDER BY number DESC LIMIT 1")
        return Entry(int(rows[0][0]), bytes(rows[0][1])) if rows else None

    @contextmanager
    def transaction(self) -> Iterator[None]:
        """Let everything inside happen at once, or not at all; inside another one it joins it."""
        with self._lock:
            if self._depth:
                yield
                return
            connection = self._begin()
            self._depth = 1
            try:
                yield
                with self._errors():
                    connection.execute("COMMIT")
            except BaseException:
                with contextlib.suppress(psycopg.Error):
                    connection.execute("ROLLBACK")
                raise
            finally:
                self._depth = 0

    def _begin(self) -> "psycopg.Connection[Any]":
        """Begin a transaction; nothing has happened yet, so a broken connection may be replaced."""
        with self._errors():
            try:
                return self._begin_exclusive(self._connected())
            except psycopg.OperationalError:
                if self._connection is None or not self._connection.closed:
                    raise
                return self._begin_exclusive(self._connected())

    @staticmethod
    def _begin_exclusive(connection: "psycopg.Connection[Any]") -> "psycopg.Connection[Any]":
        try:
            connection.execute("BEGIN")
            connection.execute("SELECT pg_advisory_xact_lock(%s)", [_TURN])
        except psycopg.Error:
            with contextlib.suppress(psycopg.Error):
                connection.execute("ROLLBACK")
            raise
        return connection

    def close(self) -> None:
        """Leave; safe to call twice."""
        with self._lock:
            self._closed = True
            if self._connection is not None:
                self._connection.close()

    def _migrate(self) -> None:
        self._run("CREATE TABLE IF NOT EXISTS scm_schema (version INTEGER NOT NULL)")
        rows = self._run("SELECT version FROM scm_schema")
        version = int(rows[0][0]) if rows else 0
        if version > len(MIGRATIONS):
            msg = (
                f"state {self._where}: written by a newer scm "
                f"(schema {version}, expected at most {len(MIGRATIONS)})"
            )
            raise StoreError(msg)
        for script in MIGRATIONS[version:]:
            for sql in script:
                self._run(sql)
        if version < len(MIGRATIONS):
            self._run("DELETE FROM scm_schema")
            self._run("INSERT INTO scm_schema VALUES (%s)", [len(MIGRATIONS)])

    def _connected(self) -> "psycopg.Connection[Any]":
        """Return the connection, a new one when the last one broke."""
        if self._closed:
            msg = f"state {self._where}: it is closed"
            raise StoreError(msg)
        if self._connection is None or self._connection.closed:
            with self._errors():
                self._connection = psycopg.connect(
                    self._url,
                    autocommit=True,
                    connect_timeout=CONNECT_S,
                    tcp_user_timeout=CONNECT_S * 1000,
                    application_name="scm",
                )
                self._connection.execute(f"SET statement_timeout = {STATEMENT_MS}")
        return self._connection

    def _run(self, sql: str, values: Sequence[object] = ()) -> list[tuple[Any, ...]]:
        with self._lock:
            if not self._depth:  # a reader's: the connection may have broken since its last use
                with self.transaction():
                    return self._run(sql, values)
            with self._errors():
                cursor = self._connected().execute(sql.encode(), values)
                return cursor.fetchall() if cursor.description is not None else []

    @contextmanager
    def _errors(self) -> Iterator[None]:
        try:
            yield
        except psycopg.Error as cause:
            why = " ".join(str(cause).split())
            msg = f"state {self._where}: {why}"
            raise StoreError(msg) from cause


def _without_password(url: str) -> str:
    """Return a URL without its secrets.

    Raises:
        StoreError: when it cannot be read.
    """
    try:
        facts = conninfo_to_dict(url)
    except psycopg.Error as cause:
        msg = f"state: cannot read the PostgreSQL URL: {str(cause).strip()}"
        raise StoreError(msg) from None
    host, name = facts.get("host", "localhost"), facts.get("dbname", "")
    return f"postgresql://{host}/{name}"
