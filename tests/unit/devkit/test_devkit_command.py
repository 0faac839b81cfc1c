"""What the bridge's command line refuses before it speaks to anybody."""

import pytest

from scm.v2x import credentials as files
from scm.v2x.credentials import Credentials
from vehicle_agent.__main__ import main

DEVKIT = ("devkit", "--connect", "tcp/127.0.0.1:1", "--car", "p1")


@pytest.mark.parametrize(
    ("station", "role", "more"),
    [("ann", "driver", ()), ("p2", "vehicle", ()), ("p1", "vehicle", ("--car", "p2"))],
)
def test_a_placed_car_needs_the_rights_of_that_very_vehicle(
    monkeypatch, capsys, station, role, more
):
    monkeypatch.setattr(
        files, "read_credentials", lambda *_: Credentials(station=station, role=role)
    )
    assert main([*DEVKIT, *more, "--cosim", "--credentials", "x.toml"]) == 2
    assert "scm fleet add p1 --role vehicle" in capsys.readouterr().err


def test_the_oldest_packet_is_of_one_car(capsys):
    assert main([*DEVKIT, "--car", "p2", "--packet", "0.1"]) == 2
    assert "one car only" in capsys.readouterr().err


@pytest.mark.parametrize(
    "command", [DEVKIT, ("join", "--name", "j1", "--connect", "tcp/127.0.0.1:1")]
)
def test_coordinates_that_are_none_are_refused_before_anybody_is_asked(capsys, command):
    with pytest.raises(SystemExit, match="2"):
        main([*command, "--spawn=-1,2"])
    assert "got '-1,2', expected X,Y,DEG" in capsys.readouterr().err
