"""Recordings that allow no verdict: the command says what is missing, and invents nothing."""

import json

import numpy as np
import pytest

from scm.__main__ import main
from tests.unit.mismatch.made_drive import made_drive

POSE, COMMANDS = ("pose.x", "pose.y", "pose.yaw"), ("command.throttle", "command.steering")
UNITS = {"pose.x": "m", "pose.y": "m", "pose.yaw": "rad"}


def write(folder, names, change=lambda name, t, values: (t, values), seconds=20.0):
    """Write channels of a healthy drive as a recording, each with a table of its own."""
    recording, lines = made_drive(seconds=seconds), ["recording: 1", "vehicle: nigel", "tables:"]
    for name in names:
        channel = recording.channels[name]
        t, values = change(name, channel.t.copy(), channel.values.copy())
        rows = "\n".join(f"{a:.4f},{b:.6f}" for a, b in zip(t, values, strict=True))
        (folder / f"{name}.csv").write_text(f"t,v\n{rows}\n", encoding="utf-8")
        lines += [
            f"  - file: {name}.csv",
            "    time: {column: t, unit: s}",
            f"    channels: {{{name}: {{column: v, unit: '{UNITS.get(name, '1')}'}}}}",
        ]
    (folder / "recording.yaml").write_text("\n".join(lines), encoding="utf-8")
    return folder


def diagnosed(folder):
    """What the command reported, its exit code being 0."""
    assert main(["mismatch", str(folder), "--out", str(folder / "found")]) == 0
    return json.loads((folder / "found" / "report.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("missing", [COMMANDS, POSE])
def test_what_is_missing_is_said_and_nothing_is_invented(tmp_path, missing, capsys):
    names = [name for name in (*POSE, *COMMANDS) if name not in missing]
    report = diagnosed(write(tmp_path, names))
    assert "\nno verdict: " in capsys.readouterr().out
    assert report["verdict"] == "none"
    assert report["effects"] == []
    assert "missing" in {problem["name"] for problem in report["data"]}
    assert any(problem["record_instead"] for problem in report["data"])


def test_three_seconds_are_too_short(tmp_path):
    report = diagnosed(write(tmp_path, (*POSE, *COMMANDS), seconds=3.0))
    assert "too_short" in {problem["name"] for problem in report["data"]}
    assert report["effects"] == []


def test_commands_that_belong_to_another_drive_are_no_physics(tmp_path):
    def shuffled(name, t, values):
        rng = np.random.default_rng(2)
        return (t, rng.permutation(values)) if name in COMMANDS else (t, values)

    report = diagnosed(write(tmp_path, (*POSE, *COMMANDS), shuffled))
    assert report["effects"] == []
    assert {"no_verdict", "without_effect"} <= {problem["name"] for problem in report["data"]}


def test_a_recording_that_is_not_there_is_bad_input(tmp_path, capsys):
    assert main(["mismatch", str(tmp_path / "nowhere"), "--out", str(tmp_path)]) == 2
    assert "nowhere" in capsys.readouterr().err


def test_the_page_says_that_there_is_no_verdict(tmp_path):
    write(tmp_path, POSE)
    diagnosed(tmp_path)
    page = (tmp_path / "found" / "report.html").read_text(encoding="utf-8")
    assert "does not allow a verdict" in page


def test_of_several_recordings_it_is_said_which_one_is_broken(tmp_path):
    for name, channels in (("one", POSE), ("two", COMMANDS)):
        (tmp_path / name).mkdir()
        write(tmp_path / name, channels)
    both = [str(tmp_path / name) for name in ("one", "two")]
    assert main(["mismatch", *both, "--out", str(tmp_path / "found")]) == 0
    report = json.loads((tmp_path / "found" / "report.json").read_text(encoding="utf-8"))
    assert [p["said"][:19] for p in report["data"] if p["name"] == "no_verdict"] == [
        "one: The car cannot", "two: The car cannot",
    ]  # fmt: skip
