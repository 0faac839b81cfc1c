"""A real PostgreSQL server for those tests that want one."""

import pytest


@pytest.fixture(scope="session")
def server(tmp_path_factory):
    """The URL of a server of our own, on a socket in a folder."""
    pgserver = pytest.importorskip("pgserver", reason="pgserver is not here to start PostgreSQL")
    pytest.importorskip("psycopg", reason="psycopg is not here: pip install scm[postgres]")
    folder = tmp_path_factory.mktemp("pg", numbered=True)
    try:
        running = pgserver.get_server(folder, cleanup_mode="stop")
    except Exception as cause:  # noqa: BLE001  whatever this machine lacks
        pytest.skip(f"no PostgreSQL server can be started here: {cause}")
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
