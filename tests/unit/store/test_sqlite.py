"""What is particular to the store in a file: kills, locks, full disks, broken and strange files."""

import os
import random
import signal
import sqlite3
import subprocess
import sys

import pytest

from scm.errors import StoreError
from scm.store.sqlite import MIGRATIONS, SqliteStore

WRITER = """
import sys
from pathlib import Path
from scm.store.sqlite import SqliteStore
store = SqliteStore(Path(sys.argv[1]))
while True:
    n = int(store.get("leases", "n") or b"0") + 1
    with store.transaction():
        store.put("leases", "n", b"%d" % n)
        store.append("audit", b"%d" % n)
        store.put("plans", "n", b"%d" % n)
    sys.stdout.write(f"{n}\\n")
    sys.stdout.flush()
"""


@pytest.fixture
def path(tmp_path):
    return tmp_path / "city.db"


def test_what_was_told_as_written_survives_a_kill_at_any_moment(path):
    rng, told = random.Random(3), 0
    for _ in range(12):
        with subprocess.Popen(
            [sys.executable, "-c", WRITER, str(path)], stdout=subprocess.PIPE, text=True
        ) as writer:
            for _ in range(rng.randrange(1, 40)):
                line = writer.stdout.readline()
                told = max(told, int(line))
            os.kill(writer.pid, signal.SIGKILL)
            for line in writer.stdout:
                told = max(told, int(line)) if line.endswith("\n") else told
        store = SqliteStore(path)
        stored = int(store.get("leases", "n"))
        assert told <= stored <= told + 1
        assert store.get("plans", "n") == b"%d" % stored
        assert [e.body for e in store.entries("audit", limit=10**6)] == [
            b"%d" % n for n in range(1, stored + 1)
        ]
        store.close()


def test_a_file_of_the_first_schema_is_brought_up_and_keeps_what_it_holds(path):
    db = sqlite3.connect(path)
    for sql in MIGRATIONS[0]:
        db.execute(sql)
    db.execute(f"PRAGMA application_id = {0x53434D31}")
    db.execute("PRAGMA user_version = 1")
    db.execute("INSERT INTO leases VALUES ('n1', x'31')")
    db.commit()
    db.close()
    store = SqliteStore(path)
    assert store.get("leases", "n1") == b"1"
    store.put("latches", "stop", b"ann")
    store.close()
    assert sqlite3.connect(path).execute("PRAGMA user_version").fetchone() == (len(MIGRATIONS),)


def test_a_file_of_a_newer_schema_is_refused_with_both_numbers(path):
    SqliteStore(path).close()
    db = sqlite3.connect(path)
    db.execute("PRAGMA user_version = 99")
    db.close()
    with pytest.raises(StoreError, match=rf"{path}.*newer scm.*99.*{len(MIGRATIONS)}"):
        SqliteStore(path)


def test_somebody_elses_database_is_not_written_to(path):
    db = sqlite3.connect(path)
    db.execute("CREATE TABLE theirs (x)")
    db.close()
    before = path.read_bytes()
    with pytest.raises(StoreError, match="not one of a city"):
        SqliteStore(path)
    assert path.read_bytes() == before


def test_what_is_no_database_is_refused_and_left_as_it_is(path):
    path.write_bytes(b"a diary, not a database. " * 100)
    with pytest.raises(StoreError, match="no SQLite file"):
        SqliteStore(path)
    assert path.read_bytes().startswith(b"a diary")


def test_a_broken_file_is_refused_at_the_start(path):
    store = SqliteStore(path)
    for n in range(200):
        store.put("answers", f"k{n}", b"x" * 500)
    store.close()
    whole = bytearray(path.read_bytes())
    assert len(whole) > 80_000
    for at in range(20_000, 60_000):
        whole[at] = 0x5A
    path.write_bytes(whole)
    with pytest.raises(StoreError, match="broken"):
        SqliteStore(path)


def test_a_file_that_another_keeps_locked_is_refused_after_the_patience_is_over(path):
    store = SqliteStore(path, busy_s=0.1)
    other = sqlite3.connect(path, isolation_level=None)
    other.execute("BEGIN IMMEDIATE")
    with pytest.raises(StoreError, match="another process keeps it locked"):
        store.put("leases", "n1", b"1")
    other.execute("ROLLBACK")
    store.put("leases", "n1", b"1")
    assert store.get("leases", "n1") == b"1"
    store.close()
    other.close()


def test_a_full_disk_is_named_and_nothing_is_half_written(path):
    store = SqliteStore(path)
    store.put("leases", "n1", b"old")
    pages = store._db.execute("PRAGMA page_count").fetchone()[0]
    store._db.execute(f"PRAGMA max_page_count = {pages}")

    def work():
        with store.transaction():
            store.put("leases", "n1", b"new")
            store.put("answers", "big", b"x" * 100_000)

    with pytest.raises(StoreError, match="the disk is full"):
        work()
    assert store.get("leases", "n1") == b"old"
    store._db.execute("PRAGMA max_page_count = 1000000")
    store.put("answers", "big", b"x" * 100_000)
    store.close()


def test_a_folder_that_is_not_there_is_named(tmp_path):
    with pytest.raises(StoreError, match=r"nowhere/city\.db.*is there such a folder"):
        SqliteStore(tmp_path / "nowhere" / "city.db")


@pytest.mark.parametrize("sql", ["UPDATE audit SET body = x'00'", "DELETE FROM audit"])
def test_the_audit_log_cannot_be_changed_through_sql_either(path, sql):
    store = SqliteStore(path)
    store.append("audit", b"x")
    with pytest.raises(sqlite3.IntegrityError, match="append-only"):
        store._db.execute(sql)
    store.close()
