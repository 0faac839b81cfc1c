"""What is particular to the store on a server: broken connections, its schema, no secrets told."""

import sys

import pytest

from scm.errors import StoreError
from scm.store.open import open_store

psycopg = pytest.importorskip("psycopg", reason="psycopg is not here: pip install scm[postgres]")


@pytest.fixture
def store(database):
    store = open_store(database)
    yield store
    store.close()


@pytest.fixture
def admin(database):
    with psycopg.connect(database, autocommit=True) as admin:
        yield admin


def cut(admin):
    admin.execute(
        "SELECT pg_terminate_backend(pid) FROM pg_stat_activity "
        "WHERE application_name = 'scm' AND datname = current_database()"
    )


def test_a_connection_that_broke_is_opened_again_by_the_next_use(store, admin):
    store.put("leases", "n1", b"1")
    cut(admin)
    assert store.get("leases", "n1") == b"1"
    cut(admin)
    store.put("leases", "n1", b"2")
    assert store.get("leases", "n1") == b"2"


def test_a_connection_that_breaks_amid_a_transaction_fails_it_whole(store, admin):
    def work():
        with store.transaction():
            store.put("leases", "n1", b"1")
            cut(admin)
            store.put("leases", "n2", b"1")

    with pytest.raises(StoreError):
        work()
    assert dict(store.items("leases")) == {}
    assert store.append("audit", b"x") == 1


def test_a_newer_schema_is_refused_with_its_number(store, database, admin):
    admin.execute("UPDATE scm_schema SET version = 99")
    with pytest.raises(StoreError, match=r"newer scm.*99"):
        open_store(database)


def test_a_schema_of_the_first_version_is_brought_up(database, admin):
    from scm.store import postgres

    admin.execute("CREATE TABLE scm_schema (version INTEGER NOT NULL)")
    admin.execute("INSERT INTO scm_schema VALUES (1)")
    for sql in postgres.MIGRATIONS[0]:
        admin.execute(sql)
    admin.execute("INSERT INTO leases VALUES ('n1', 'x')")
    store = open_store(database)
    assert store.get("leases", "n1") == b"x"
    store.put("latches", "stop", b"ann")
    store.close()


@pytest.mark.parametrize(
    "sql", ["UPDATE audit SET body = ''", "DELETE FROM audit", "TRUNCATE audit"]
)
def test_the_audit_log_cannot_be_changed_through_sql_either(store, admin, sql):
    store.append("audit", b"x")
    with pytest.raises(psycopg.errors.RaiseException, match="append-only"):
        admin.execute(sql)


def test_an_error_names_the_server_and_not_the_password():
    with pytest.raises(StoreError, match=r"postgresql://127\.0\.0\.1/city") as told:
        open_store("postgresql://ann:secret@127.0.0.1:1/city")
    assert "secret" not in str(told.value)


def test_without_the_library_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "psycopg", None)
    monkeypatch.delitem(sys.modules, "scm.store.postgres", raising=False)
    with pytest.raises(StoreError, match=r"scm\[postgres\]"):
        open_store("postgresql://127.0.0.1/city")
