"""The command line ends every command with a sentence and an exit code that means something."""

import logging
import subprocess
import sys
from pathlib import Path

import pytest

from scm.__main__ import main, parse
from scm.api.keys import KeyRing, public_part, whose
from scm.client.key import key_of_environment
from scm.command import Command
from scm.commands import show
from scm.errors import MapError
from scm.registry import load, names
from scm.store.open import open_store


@pytest.fixture
def failing(monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> None:
    """Let `scm show car` fail with what the test asks for."""

    def fail(_arguments: object) -> str:
        raise request.param

    monkeypatch.setattr(show, "_car", fail)


@pytest.mark.parametrize(
    ("failing", "code", "said"),
    [
        (MapError("m.toml: bad"), 2, "scm show: m.toml: bad"),
        (PermissionError(13, "Permission denied", "out.csv"), 2, "Permission denied: 'out.csv'"),
        (KeyError("x"), 1, "unexpected KeyError: 'x'\nThis is a bug"),
        (OSError(28, "No space left on device"), 2, "scm show: [Errno 28] No space left"),
        (OSError(5, "Input/output error"), 1, "unexpected OSError"),
        (KeyboardInterrupt(), 130, ""),
    ],
    indirect=["failing"],
)
def test_each_way_to_fail_has_its_code_and_sentence(
    failing: None, code: int, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["show", "car"]) == code
    err = capsys.readouterr().err
    assert said in err
    assert "Traceback" not in err


def test_a_map_is_shown_with_what_scripts_and_pages_call_by_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "town.svg"
    assert main(["show", "map", "driving_school", "--out", str(out)]) == 0
    shown = capsys.readouterr().out.splitlines()
    assert shown[0].startswith("Driving School: 4 lanes, 1 junction")
    assert "  east_loop            2.07 m  0.25 m/s  crossing_south_west" in shown
    assert "  crossing  south_east, south_west" in shown
    assert "  c  lane east_loop at 1.52 m  x 2.54 m, y 0.94 m, yaw 2.17 rad" in shown
    assert shown[-1] == f"drawn in {out}"
    assert all(f">{name}</text>" in out.read_text("utf-8") for name in ("east_loop", "crossing"))


@pytest.mark.parametrize("failing", [KeyError("x")], indirect=True)
def test_the_traceback_is_shown_to_who_debugs(
    failing: None, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.DEBUG)
    assert main(["--log", "debug", "show", "car"]) == 1
    (record,) = [record for record in caplog.records if record.exc_info]
    assert record.levelno == logging.DEBUG


def test_a_log_level_that_does_not_exist_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--log", "nonsense", "show", "car"])
    assert ended.value.code == 2
    assert "'nonsense'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "second"),
    [(["fleet"], "scm fleet add"), (["v2x", "expor"], "scm v2x export"), (["key", "-h"], "'add'")],
)
def test_half_a_command_is_told_its_second_word(
    words: list[str], second: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(words)
    assert ended.value.code == 2
    assert second in capsys.readouterr().err


@pytest.mark.parametrize("words", [["list"], ["revoke", "1a2b3c4d"]])
def test_keys_that_are_not_there_are_not_made_by_looking(
    words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    keys = tmp_path / "keys.db"
    assert main(["key", *words, "--keys", f"sqlite:{keys}"]) == 2
    assert "there is no such file" in capsys.readouterr().err
    assert not keys.exists()


def test_a_key_can_be_made_for_a_program_without_being_shown(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    file, store = tmp_path / "anna.key", f"sqlite:{tmp_path}/keys.db"
    command = ["key", "add", "anna", "--role", "viewer", "--keys", store, "--out", str(file)]
    assert main(command) == 0
    assert file.stat().st_mode & 0o777 == 0o600
    monkeypatch.setenv("SCM_API_KEY_FILE", str(file))
    key = key_of_environment()
    assert key not in capsys.readouterr().out
    kept = KeyRing(open_store(store)).record(public_part(key))
    assert kept is not None
    found = whose(key, kept)
    assert found is not None
    assert found.owner == "anna"
    assert main(command) == 2
    assert "anna.key: cannot be written: File exists" in capsys.readouterr().err
    assert len(list(KeyRing(open_store(store)).records())) == 1


def test_a_folder_is_no_recording_to_mend(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["recover", str(tmp_path)]) == 2
    assert "got a folder" in capsys.readouterr().err


def test_the_selftest_lists_faults_of_signals_and_of_cities(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["selftest", "--list"]) == 0
    lines = [line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines()]
    assert {"frozen_controller", "flood"} <= {line[0] for line in lines}
    assert all(len(line) == 2 for line in lines)


@pytest.mark.parametrize("name", names("scm.commands"))
def test_every_command_shows_an_example_that_it_understands(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    example = load("scm.commands", name, "COMMAND", Command).example
    first, *others = name.split("_")
    words = [first, *filter(None, ["-".join(others)])]
    assert example.split()[: len(words) + 1] == ["scm", *words]
    assert parse(example.split()[1:]).command == " ".join(words)
    with pytest.raises(SystemExit):
        main([*words, "--help"])
    assert f"example: {example}" in capsys.readouterr().out


def test_a_recorder_without_a_city_leaves_no_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run.mcap"
    assert main(["record", "--out", str(out), "--connect", "nonsense"]) == 2
    assert "no city at 'nonsense'" in capsys.readouterr().err
    assert not out.exists()


def test_a_reader_that_leaves_early_is_no_error(root: Path) -> None:
    command = f"{sys.executable} -m scm show terms | head -1"
    done = subprocess.run(
        ["bash", "-o", "pipefail", "-c", command], cwd=root, capture_output=True, check=False
    )
    assert done.stderr == b""
    assert done.returncode == 0


LOADED = """
import sys
from scm.__main__ import parse
parse(["--log", "info", "monitor"])
print(*(name for name in sys.modules if name.startswith("scm.commands.")))
"""


def test_to_run_a_command_loads_no_other() -> None:
    done = subprocess.run(
        [sys.executable, "-c", LOADED], check=True, capture_output=True, text=True
    )
    assert done.stdout.split() == ["scm.commands.monitor"]


@pytest.mark.parametrize("words", [["monitr"], ["foo", "monitor"]])
def test_a_command_that_is_none_is_told_all_that_are(
    words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit, match="2"):
        parse(words)
    said = capsys.readouterr().err
    assert f"invalid choice: '{words[0]}'" in said
    assert "'world'" in said


def test_a_car_is_shown_with_the_lanes_that_it_cannot_follow(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Its turning circle is held against the map."""
    assert main(["show", "car", "f1tenth", "--map", "driving_school"]) == 0
    last = capsys.readouterr().out.splitlines()[-1]
    assert last.startswith("ON MAP driving_school: it is 0.27 m wide, wider than 4 lanes")
    assert main(["show", "car", "nigel", "--map", "driving_school"]) == 0
    shown = capsys.readouterr().out
    assert "turns    on a radius of 0.245 m" in shown
    assert shown.endswith("ON MAP driving_school: it can follow all lanes\n")
