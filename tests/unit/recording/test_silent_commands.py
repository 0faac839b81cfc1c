"""Commands that fall silent: a table says how long the car obeys the last one."""

from pathlib import Path

import numpy as np
import pytest

from scm.errors import RecordingError
from scm.recording.read import Recording, read_recordings
from scm.replay.commands import Commands
from scm.vehicles.car import load_car

TEXT = """\
recording: 1
vehicle: nigel
tables:
  - file: pose.csv
    time: {column: t}
    channels:
      pose.x: {column: x, unit: m}
      pose.y: {column: x, unit: m}
      pose.yaw: {column: x, unit: rad}
  - file: command.csv
    time: {column: t}
    HOLD
    channels: {command.throttle: {column: u}, command.steering: {column: u}}
"""
ROWS = ((1.0, 0.5), (1.1, 0.5), (1.2, 0.6), (6.0, 0.7), (6.1, 0.8))


def read(folder: Path, hold: str) -> Recording:
    (folder / "recording.yaml").write_text(TEXT.replace("HOLD", hold))
    poses = "".join(f"{t:.2f},0\n" for t in np.arange(0.0, 10.01, 0.05))
    (folder / "pose.csv").write_text("t,x\n" + poses)
    (folder / "command.csv").write_text("t,u\n" + "".join(f"{t},{u}\n" for t, u in ROWS))
    (recording,) = read_recordings(folder)
    return recording


def throttle_at(recording: Recording, *t: float) -> list[float]:
    return list(Commands(recording, load_car("nigel")).at(np.array(t))[0])


def test_without_hold_s_commands_are_known_up_to_the_last_row(tmp_path: Path) -> None:
    recording = read(tmp_path, "")
    assert len(recording.channel("command.throttle").t) == len(ROWS)
    assert Commands(recording, load_car("nigel")).span_s == (1.0, 6.1)


def test_a_command_ends_hold_s_after_its_row(tmp_path: Path) -> None:
    recording = read(tmp_path, "hold_s: 0.5")
    assert throttle_at(recording, 1.15, 1.69, 1.71, 5.9, 6.05, 6.59, 6.61, 9.9) == [
        0.5, 0.6, 0.0, 0.0, 0.7, 0.8, 0.0, 0.0,
    ]  # fmt: skip


def test_with_hold_s_commands_are_known_to_the_end(tmp_path: Path) -> None:
    assert Commands(read(tmp_path, "hold_s: 0.5"), load_car("nigel")).span_s == (1.0, 10.0)


def test_a_car_without_watchdog_obeys_the_last_command_for_ever(tmp_path: Path) -> None:
    recording = read(tmp_path, "hold_s: .inf")
    assert throttle_at(recording, 5.9, 6.05, 9.9) == [0.6, 0.7, 0.8]
    assert Commands(recording, load_car("nigel")).span_s[1] == 10.0


def test_silence_is_filled_by_as_many_rows_as_there_are_poses(tmp_path: Path) -> None:
    t = read(tmp_path, "hold_s: 0.5").channel("command.steering").t
    assert len(ROWS) < len(t) < len(ROWS) + 201
    assert np.max(np.diff(t)) < 0.31
    assert np.all(np.diff(t) > 0.0)


@pytest.mark.parametrize("hold", ["-1", "0", ".nan"])
def test_hold_s_must_be_positive(tmp_path: Path, hold: str) -> None:
    with pytest.raises(RecordingError, match="hold_s: expected more than 0"):
        read(tmp_path, f"hold_s: {hold}")


def test_hold_s_is_for_commands(tmp_path: Path) -> None:
    text = TEXT.replace("    HOLD\n", "").replace(
        "  - file: pose.csv", "  - hold_s: 1\n    file: pose.csv"
    )
    (tmp_path / "recording.yaml").write_text(text)
    with pytest.raises(RecordingError, match=r"pose\.csv: hold_s: .* no command"):
        read_recordings(tmp_path)


def test_a_late_row_stays_where_it_was_written(tmp_path: Path) -> None:
    read(tmp_path, "")
    late = (ROWS[1], ROWS[0], *ROWS[2:])
    (tmp_path / "command.csv").write_text("t,u\n" + "".join(f"{t},{u}\n" for t, u in late))
    (tmp_path / "recording.yaml").write_text(TEXT.replace("HOLD", "hold_s: 0.5"))
    (recording,) = read_recordings(tmp_path)
    throttle = recording.channel("command.throttle")
    assert list(throttle.t[:2]) == [1.1, 1.0]
    assert (np.diff(throttle.t) < 0.0).sum() == 1
    assert throttle.values[np.argmax(throttle.t > 1.75)] == 0.0
