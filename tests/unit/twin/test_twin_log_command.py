"""`scm twin log`: changes and versions of a car, in words."""

import msgspec
import pytest

from scm.__main__ import main
from scm.clock import NS_PER_S
from scm.records.twins import TwinCause, TwinChange, TwinEffect, TwinParameter, TwinVersion
from scm.store.open import open_store
from tests.unit.mismatch.made_drive import nigel

SINCE_NS = 1_800_000_000 * NS_PER_S
NUMBER = TwinParameter(name="gain", value=0.85, low=0.83, high=0.87)
CHANGE = TwinChange(
    noticed_ns=SINCE_NS + 11 * NS_PER_S, since_ns=SINCE_NS, since_low_ns=SINCE_NS - NS_PER_S,
    since_high_ns=SINCE_NS + NS_PER_S, effect="understeer", parameter="gradient", size=1.0,
    unit="rad*s^2/m", score=20.0, search="named", text="The wheels turn too little.",
    effects=(TwinEffect(name="steer_gain", probability=0.97, parameters=(NUMBER,)),),
    report="twin-n3-1800000000", cause="car",
    causes=(
        TwinCause(kind="car", probability=0.92),
        TwinCause(kind="place", probability=0.06, x_m=1.2, y_m=0.4, radius_m=0.3),
        TwinCause(kind="camera", probability=0.02, camera="north"),
    ),
)  # fmt: skip


@pytest.fixture
def store(tmp_path):
    """A store with a change of n3 and the version that was adopted for it."""
    file = tmp_path / "1.toml"
    text = nigel().path.read_text("utf-8").replace("terms = [", 'terms = ["steer_gain",', 1)
    head, section, rest = text.partition("[steering]")
    file.write_text(f"{head}{section}\ngain = {{ value = 0.85 }}{rest}", "utf-8")
    version = TwinVersion(
        number=1, car="nigel", file=str(file), made_ns=SINCE_NS + 100 * NS_PER_S, state="adopted",
        by="twin", reason="position better",
    )  # fmt: skip
    url = f"sqlite:{tmp_path / 'city.db'}"
    opened = open_store(url)
    opened.put("twins", "twin/version/n3/1", msgspec.json.encode(version))
    opened.put("twins", f"twin/change/n3/{CHANGE.noticed_ns}", msgspec.json.encode(CHANGE))
    opened.close()
    return url


def test_changes_and_versions_are_printed_with_what_differs(store, capsys):
    assert main(["twin", "log", "n3", "--state", store]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == (
        "changed since 2027-01-15 08:00:00 (-1.0 to +1.0 s), noticed 2027-01-15 08:00:11: named"
    )
    assert lines[1] == "  of car: car 92 %, place (1.20, 0.40), 0.3 m 6 %"
    assert lines[2] == "  The wheels turn too little."
    assert lines[3] == "  steer_gain, 97 %: gain 0.85 (0.83 to 0.87)"
    assert lines[5] == "version 1: adopted, found 2027-01-15 08:01:40, by twin: position better"
    assert lines[7:] == ["  with steer_gain", "  steering.gain 0.85"]


def test_two_versions_are_compared(store, capsys):
    assert main(["twin", "log", "n3", "--state", store, "--between", "0", "1"]) == 0
    assert capsys.readouterr().out.splitlines() == ["with steer_gain", "steering.gain 0.85"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["n9"], "nothing is stored of a change of n9"),
        (["n3", "--between", "0", "7"], "n3 has no version 7; it has 0, 1"),
        (["n3", "--between", "1", "0"], "expected more than 0, got 0"),
    ],
)
def test_what_is_not_there_is_refused_in_words(store, arguments, words, capsys):
    assert main(["twin", "log", *arguments, "--state", store]) == 2
    assert words in capsys.readouterr().err


def test_store_that_is_not_there_is_not_made(tmp_path, capsys):
    file = tmp_path / "none.db"
    assert main(["twin", "log", "n3", "--state", f"sqlite:{file}"]) == 2
    assert "none.db: no such store" in capsys.readouterr().err
    assert not file.exists()
