"""A real PostgreSQL server for those tests that want one."""

import pytest


@pytest.fixture(scope="package")
def server(tmp_path_factory):
    """The URL of a server of our own, on a socket in a folder."""
    pgserver = pytest.importorskip("pgserver", reason="pgserver is not here to start PostgreSQL")
    psycopg = pytest.importorskip("psycopg", reason="psycopg is not here: scm[postgres]")
    folder = tmp_path_factory.mktemp("pg", numbered=True)
    try:
        running = pgserver.get_server(folder, cleanup_mode="stop")
    except Exception as cause:  # noqa: BLE001  whatever this machine lacks
        pytest.skip(f"no PostgreSQL server can be started here: {cause}")
    with psycopg.connect(running.get_uri(), autocommit=True) as connection:
        connection.execute("ALTER SYSTEM SET fsync = off")  # no power fails here: wait for no disk
        connection.execute("SELECT pg_reload_conf()")
    yield running.get_uri()
    running.cleanup()


@pytest.fixture
def database(server, request):
    """The URL of an empty database."""
    import psycopg

    name = f"t{abs(hash(request.node.nodeid))}"
    with psycopg.connect(server, autocommit=True) as connection:
        connection.execute(f"DROP DATABASE IF EXISTS {name} WITH (FORCE)")
        connection.execute(f"CREATE DATABASE {name}")
    return server.replace("/postgres?", f"/{name}?")
