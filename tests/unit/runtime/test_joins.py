"""The words of `scm up --join` and `--admit`, and what is refused before anything starts."""

from datetime import UTC, datetime
from types import SimpleNamespace

import pytest

from scm.__main__ import main
from scm.errors import AccessError, RunError
from scm.runtime.joins import Join, joins_of
from scm.v2x.certificates import make_authority
from scm.v2x.fleet_file import Fleet, add, add_neighbour, load_fleet

NOW = datetime(2030, 1, 1, tzinfo=UTC)
HERE = "tcp/127.0.0.1:7448"
FAR = "tls/192.168.2.7:7448"


def with_neighbours(*names):
    return SimpleNamespace(neighbours=[SimpleNamespace(city=name) for name in names])


def test_only_neighbour_needs_no_name():
    assert joins_of("lab_a", with_neighbours("lab_b"), [HERE], [], None) == (
        Join("lab_b", HERE, False),
    )
    assert joins_of("lab_a", with_neighbours("lab_b"), [], [HERE], None)[0].words == (
        "--admit",
        HERE,
    )


def test_one_of_several_neighbours_is_named():
    found = joins_of("lab_a", with_neighbours("b", "c"), [f"c={HERE}"], ["b=tcp/127.0.0.1:1"], None)
    assert [(join.neighbour, join.listens) for join in found] == [("c", False), ("b", True)]
    with pytest.raises(RunError, match="expected CITY=ENDPOINT with one of b, c"):
        joins_of("lab_a", with_neighbours("b", "c"), [HERE], [], None)


@pytest.mark.parametrize(
    ("names", "join", "expected"),
    [
        ((), [HERE], r"no \[\[neighbours\]\]"),
        (("lab_b",), [f"lab_c={HERE}"], "one of lab_b"),
        (("lab_b",), [HERE, HERE], "lab_b is joined already"),
        (("lab_a",), [HERE], "this city itself is named 'lab_a'"),
    ],
)
def test_neighbour_that_the_map_does_not_have_is_refused(names, join, expected):
    with pytest.raises(RunError, match=expected):
        joins_of("lab_a", with_neighbours(*names), join, [], None)


@pytest.mark.parametrize("endpoint", ["tcp/192.168.2.7:7448", "tcp/0.0.0.0:7448", FAR, "ws/x:1"])
def test_link_that_leaves_this_machine_needs_certificates(endpoint):
    with pytest.raises(AccessError, match=f"got '{endpoint}'"):
        joins_of("lab_a", with_neighbours("lab_b"), [endpoint], [], None)


@pytest.mark.parametrize("endpoint", ["tcp/127.0.0.1", "tcp/127.0.0.1:x", "tls/", "tcp/h:99999"])
def test_endpoint_without_a_host_or_port_is_refused(endpoint):
    with pytest.raises(AccessError, match=f"got '{endpoint}', expected tls/HOST:PORT"):
        joins_of("lab_a", with_neighbours("lab_b"), [endpoint], [], None)


def test_fleet_with_certificates_needs_tls_and_the_authority_of_the_neighbour(tmp_path):
    fleet = Fleet(tmp_path / "fleet.toml", "mtls")
    city_map = with_neighbours("lab_b")
    with pytest.raises(AccessError, match="expected tls/HOST:PORT"):
        joins_of("lab_a", city_map, [HERE], [], fleet)
    with pytest.raises(AccessError, match="scm fleet neighbour lab_b FILE"):
        joins_of("lab_a", city_map, [FAR], [], fleet)
    add_neighbour(fleet, "lab_b", make_authority("b", NOW).certificate, NOW)
    assert joins_of("lab_a", city_map, [FAR], [], fleet) == (Join("lab_b", FAR, False),)


def test_fleet_with_passwords_joins_no_city(tmp_path):
    fleet = Fleet(tmp_path / "fleet.toml", "password")
    with pytest.raises(AccessError, match="passwords"):
        joins_of("lab_a", with_neighbours("lab_b"), [HERE], [], fleet)


def test_two_labs_exchange_their_authorities_by_commands(tmp_path, capsys, monkeypatch):
    for lab in ("a", "b"):
        (tmp_path / lab).mkdir()
        monkeypatch.chdir(tmp_path / lab)
        assert main(["fleet", "authority", f"{lab}.crt", "--host", "192.168.1.5"]) == 0
        assert "PRIVATE" not in (tmp_path / lab / f"{lab}.crt").read_text()
    shown = capsys.readouterr().out.split()[-1]
    monkeypatch.chdir(tmp_path / "a")
    assert main(["fleet", "neighbour", "lab_b", "../b/b.crt"]) == 0
    assert capsys.readouterr().out.split()[-1] == shown
    assert main(["fleet", "list"]) == 0
    assert f"lab_b            neighbour authority {shown}" in capsys.readouterr().out
    assert load_fleet(tmp_path / "a" / "fleet.toml").neighbours == ["lab_b"]
    assert main(["fleet", "neighbour", "lab_b", "--remove"]) == 0
    assert load_fleet(tmp_path / "a" / "fleet.toml").neighbours == []


def test_what_is_no_authority_of_another_city_is_not_trusted(tmp_path):
    fleet = Fleet(tmp_path / "fleet.toml", "mtls")
    station = add(fleet, "n1", "vehicle", NOW)
    other = make_authority("b", NOW)
    for text, expected in (
        (fleet.pem("authority.crt").read_text(), "this fleet's own"),
        (station.certificate, "a station's"),
        (other.certificate + other.private_key, "private key"),
        ("no certificate", "in PEM"),
    ):
        with pytest.raises(AccessError, match=expected):
            add_neighbour(fleet, "lab_b", text, NOW)
    assert fleet.neighbours == []
