"""A fault in the rows of a recording costs those rows, and is named by its own name."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from scm.arrays import Floats
from scm.data_quality.prepare import Screened, prepare, screen
from scm.errors import RecordingError
from scm.recording.read import Channel, Recording, read_recordings
from scm.vehicles.car import Car, load_car

STEP_S = 0.02
EPOCH_S = 1.7e9
POSE = ("pose.x", "pose.y", "pose.yaw")
COMMANDS = ("command.throttle", "command.steering")
COUNTERS = ("encoder.left", "encoder.right")
RATES = ("imu.gyro_z", "speed", "wheel_speed.rl")
COLUMNS = ("t", *POSE, *COMMANDS, *COUNTERS, *RATES)
DIMENSIONS = {
    "encoder": "count",
    "imu": "angular speed",
    "speed": "speed",
    "wheel_speed": "angular speed",
}


@pytest.fixture(scope="module")
def nigel() -> Car:
    return load_car("nigel")


@pytest.fixture(scope="module")
def clean() -> dict[str, Floats]:
    """Columns of 30 s at 50 Hz: circles of varying radius at 0.2 m/s, after 2 s at rest."""
    t = STEP_S * np.arange(1500)
    v = np.where(t < 2.0, 0.0, 0.2 + 0.05 * np.sin(t))
    w = np.where(t < 2.0, 0.0, 0.6 * np.sin(0.4 * t))
    yaw = added(w)
    counts = 1920.0 / (math.tau * 0.0325)
    steering = np.where(v > 0.0, np.arctan(w * 0.14154 / np.maximum(v, 0.1)) / 0.5236, 0.0)
    columns = (
        t, added(v * np.cos(yaw)), added(v * np.sin(yaw)), wrapped(yaw), v / 0.27, steering,
        np.rint(counts * added(v - 0.0765 * w)), np.rint(counts * added(v + 0.0765 * w)),
        w, v, (v - 0.0765 * w) / 0.0325,
    )  # fmt: skip
    return dict(zip(COLUMNS, columns, strict=True))


def added(rate: Floats) -> Floats:
    return np.concatenate(([0.0], np.cumsum(rate[:-1]) * STEP_S))


def wrapped(angle: Floats) -> Floats:
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


def recording(columns: dict[str, Floats]) -> Recording:
    channels = {
        name: Channel(columns["t"].copy(), columns[name].copy(), None, (0.0, 0.0), dimension(name))
        for name in COLUMNS[1:]
    }
    return Recording(Path("drive/recording.yaml"), "nigel", channels)


def dimension(name: str) -> str:
    if name.startswith("pose."):
        return "angle" if name.endswith("yaw") else "length"
    return DIMENSIONS.get(name.partition(".")[0], "ratio")


def changed(columns: dict[str, Floats], **new: Floats) -> dict[str, Floats]:
    return {**columns, **{name.replace("_", ".", 1): values for name, values in new.items()}}


def at(values: Floats, row: int, value: float) -> Floats:
    out = values.copy()
    out[row] = value
    return out


def names(screened: Screened) -> list[str]:
    return [problem.name for problem in screened.problems]


def said(screened: Screened) -> str:
    return " ".join(f"{p.channel}: {p.text} {p.corrected}" for p in screened.problems)


def test_a_clean_recording_keeps_every_row(clean: dict[str, Floats], nigel: Car) -> None:
    before = recording(clean)
    after = screen(before, nigel)
    assert after.problems == ()
    assert after.jumps == ()
    for name, channel in before.channels.items():
        assert np.array_equal(channel.t, after.recording.channel(name).t)
        assert np.array_equal(channel.values, after.recording.channel(name).values)


@pytest.mark.parametrize("factor", [1e9, 1e6, 1e3, 1e-3, 1e-6, 1e-9, 60.0, 1.0 / 60.0])
@pytest.mark.parametrize("start_s", [0.0, EPOCH_S])
def test_stamps_in_another_unit_become_seconds(
    clean: dict[str, Floats], nigel: Car, factor: float, start_s: float
) -> None:
    found = screen(recording(changed(clean, t=(clean["t"] + start_s) * factor)), nigel)
    assert names(found) == ["unit"]
    assert "is the unit" in said(found)
    t = found.recording.channel("pose.x").t
    np.testing.assert_allclose(t - t[0], clean["t"], atol=1e-4)


@pytest.mark.parametrize("table", [POSE, COMMANDS, COUNTERS])
@pytest.mark.parametrize("factor", [1e9, 1e6, 1e3, 1e-3, 1e-6])
@pytest.mark.parametrize("start_s", [0.0, EPOCH_S])
def test_one_table_in_another_unit_becomes_seconds(
    clean: dict[str, Floats], nigel: Car, table: Sequence[str], factor: float, start_s: float
) -> None:
    source = recording(changed(clean, t=clean["t"] + start_s))
    for name in table:
        source.channels[name] = replace(source.channels[name], t=(clean["t"] + start_s) * factor)
    found = screen(source, nigel)
    assert names(found) == ["unit"]
    t = found.recording.channel(table[0]).t
    np.testing.assert_allclose(t, clean["t"] + start_s, atol=1e-3)


@pytest.mark.parametrize("together", [2, 5, 10])
@pytest.mark.parametrize("apart_s", [0.0, 2e-4])
def test_rows_of_one_moment_are_in_seconds_and_no_spikes(
    clean: dict[str, Floats], nigel: Car, together: int, apart_s: float
) -> None:
    number = np.arange(1500)
    last = np.minimum(number // together * together + together - 1, 1499)
    handed_over = clean["t"][last] + apart_s * (number % together)
    found = screen(recording(changed(clean, t=handed_over)), nigel)
    assert not {"unit", "spike", "jump", "stray"} & set(names(found))


@pytest.mark.parametrize("row", [0, 1, 700, 1498, 1499])
@pytest.mark.parametrize("stamp", [0.0, EPOCH_S + 86_400.0, EPOCH_S - 86_400.0, EPOCH_S + 3e3])
def test_one_bad_stamp_costs_one_row(
    clean: dict[str, Floats], nigel: Car, row: int, stamp: float
) -> None:
    t = at(clean["t"] + EPOCH_S, row, stamp)
    found = screen(recording(changed(clean, t=t)), nigel)
    assert names(found) == ["stray"]
    assert f"Row {row + 1} is stamped" in said(found)
    assert "1 row left out" in said(found)
    for name, channel in found.recording.channels.items():
        assert np.array_equal(channel.values, np.delete(clean[name], row)), name


@pytest.mark.parametrize("table", [POSE, COMMANDS, COUNTERS])
@pytest.mark.parametrize("row", [0, 600, 1499])
def test_a_bad_stamp_costs_a_row_of_its_own_table_only(
    clean: dict[str, Floats], nigel: Car, table: Sequence[str], row: int
) -> None:
    source = recording(changed(clean, t=clean["t"] + EPOCH_S))
    for name in table:
        source.channels[name] = replace(source.channels[name], t=at(clean["t"] + EPOCH_S, row, 0.0))
    found = screen(source, nigel)
    assert names(found) == ["stray"]
    for name, channel in found.recording.channels.items():
        assert len(channel.t) == (1499 if name in table else 1500), name


def test_several_bad_stamps_cost_a_row_each(clean: dict[str, Floats], nigel: Car) -> None:
    t = clean["t"] + EPOCH_S
    for row in (0, 1, 2, 500, 501, 900):
        t = at(t, row, 0.0)
    found = screen(recording(changed(clean, t=t)), nigel)
    assert names(found) == ["stray"]
    assert "6 rows left out" in said(found)
    assert len(found.recording.channel("pose.x").t) == 1494


def test_a_command_long_before_the_drive_is_no_stray(clean: dict[str, Floats], nigel: Car) -> None:
    source = recording(clean)
    for name in COMMANDS:
        channel = source.channels[name]
        source.channels[name] = replace(channel, t=at(channel.t, 0, -20.0))
    assert screen(source, nigel).problems == ()


def shuffled(n: int) -> Floats:
    return np.random.default_rng(5).permutation(n)


ORDERS: dict[str, Callable[[int], Floats]] = {
    "backwards": lambda n: np.arange(n)[::-1],
    "shuffled": shuffled,
    "odd rows, then even ones": lambda n: np.concatenate((np.arange(1, n, 2), np.arange(0, n, 2))),
    "second half first": lambda n: np.concatenate((np.arange(n // 2, n), np.arange(n // 2))),
    "every other row 0.3 s late": lambda n: np.argsort(
        np.arange(n) + 15.5 * (np.arange(n) % 2), kind="stable"
    ),
    "a block 3 s late": lambda n: np.argsort(
        np.arange(n) + 150.5 * ((np.arange(n) > 600) & (np.arange(n) < 660)), kind="stable"
    ),
    "three rows 5 s late": lambda n: np.argsort(
        np.arange(n) + 250.5 * np.isin(np.arange(n), (300, 700, 900)), kind="stable"
    ),
}


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("table", [COLUMNS[1:], COMMANDS])
def test_rows_in_any_order_are_sorted(
    clean: dict[str, Floats], nigel: Car, order: str, table: Sequence[str]
) -> None:
    source, rows = recording(clean), ORDERS[order](1500)
    for name in table:
        source.channels[name] = source.channels[name].at(rows)
    found = screen(source, nigel)
    assert set(names(found)) == {"time_backwards"}
    assert "Sorted by their stamps." in said(found)
    for name, channel in found.recording.channels.items():
        assert np.array_equal(channel.t, clean["t"]), name
        assert np.array_equal(channel.values, clean[name]), name


@pytest.mark.parametrize("back_s", [10.0, 14.0, 300.0])
def test_a_clock_that_is_set_back_makes_two_drives(
    clean: dict[str, Floats], nigel: Car, back_s: float
) -> None:
    t = np.where(np.arange(1500) < 750, clean["t"], clean["t"] - back_s)
    found = screen(recording(changed(clean, t=t)), nigel)
    now = found.recording.channel("pose.x")
    if back_s > 30.0:  # the parts do not overlap: sorted
        assert len(now.t) == 1500
        return
    assert "The clock is set back once, at row 751" in said(found)
    assert np.array_equal(now.values, clean["pose.x"])
    assert float(np.diff(now.t).max()) == pytest.approx(10.0)


def test_a_clock_that_is_set_back_twice_makes_three_drives(
    clean: dict[str, Floats], nigel: Car
) -> None:
    part = np.arange(1500) // 500
    found = screen(
        recording(changed(clean, t=clean["t"] - np.array([0.0, 9.0, 19.0])[part])), nigel
    )
    assert names(found) == ["time_backwards"]
    assert np.array_equal(found.recording.channel("pose.x").values, clean["pose.x"])


def test_two_drives_on_one_clock_are_not_mixed(clean: dict[str, Floats], nigel: Car) -> None:
    twice = {name: np.concatenate((values, values)) for name, values in clean.items()}
    twice["pose.x"][1500:] += 3.0
    found = screen(recording(twice), nigel)
    assert "at row 1501" in said(found)
    assert np.array_equal(found.recording.channel("pose.x").values, twice["pose.x"])


def test_of_a_stamp_the_last_command_and_the_first_measured_row_count(
    clean: dict[str, Floats], nigel: Car
) -> None:
    twice = {name: np.insert(values, 800, values[800]) for name, values in clean.items()}
    twice["command.throttle"][801] = 0.25
    twice["pose.x"][801] += 0.001
    found = screen(recording(twice), nigel)
    assert names(found) == ["duplicate"]
    assert "1 row of 1501 repeats the stamp" in said(found)
    assert found.recording.channel("command.throttle").values[800] == 0.25
    assert found.recording.channel("pose.x").values[800] == clean["pose.x"][800]


@pytest.mark.parametrize("row", [0, 1, 60, 900, 1498, 1499])
@pytest.mark.parametrize("value", [0.0, 1e9, -32_768.0])
def test_one_wrong_count_costs_one_row(
    clean: dict[str, Floats], nigel: Car, row: int, value: float
) -> None:
    counts = clean["encoder.left"] + 5000.0
    found = screen(recording(changed(clean, encoder_left=at(counts, row, value))), nigel)
    assert names(found) == ["spike"]
    assert f"Row {row + 1} is" in said(found)
    assert np.array_equal(found.recording.channel("encoder.left").values, np.delete(counts, row))
    assert len(found.recording.channel("encoder.right").t) == 1500


@pytest.mark.parametrize("bits", [8, 10, 12, 14, 16])
@pytest.mark.parametrize("signed", [False, True])
def test_a_wrapped_counter_is_unwrapped(
    clean: dict[str, Floats], nigel: Car, bits: int, signed: bool
) -> None:
    low, width = (-(2.0 ** (bits - 1)) if signed else 0.0), 2.0**bits
    start = 0.0 if bits < 16 else 20_000.0
    wraps = {
        f"encoder_{side}": (clean[f"encoder.{side}"] + start - low) % width + low
        for side in ("left", "right")
    }
    found = screen(recording(changed(clean, **wraps)), nigel)
    assert set(names(found)) == {"wrap"}
    assert f"by {width:.0f} counts" in said(found)
    for name in COUNTERS:
        now = found.recording.channel(name).values
        assert np.array_equal(now - now[0], clean[name] - clean[name][0])


@pytest.mark.parametrize("modulus", [1920.0, 1000.0, 10_000.0])
def test_a_counter_that_wraps_once_a_turn_or_decimally_is_unwrapped(
    clean: dict[str, Floats], nigel: Car, modulus: float
) -> None:
    found = screen(recording(changed(clean, encoder_left=clean["encoder.left"] % modulus)), nigel)
    assert names(found) == ["wrap"]
    now = found.recording.channel("encoder.left").values
    assert np.array_equal(now, clean["encoder.left"])


def test_a_counter_that_wraps_faster_than_it_is_read_is_not_used(
    clean: dict[str, Floats], nigel: Car
) -> None:
    slow = {name: values[::5] for name, values in clean.items()}
    slow["encoder.left"] = slow["encoder.left"] % 256.0
    found = screen(recording(slow), nigel)
    assert names(found) == ["wrap"]
    assert "nobody knows which way" in said(found)
    assert "encoder.left" not in found.recording.channels


@pytest.mark.parametrize("factor", [100.0, 1000.0])
def test_positions_in_another_unit_are_not_another_car(
    clean: dict[str, Floats], nigel: Car, factor: float
) -> None:
    scaled = {name: factor * clean[name] for name in ("pose.x", "pose.y")}
    source = recording({**clean, **scaled})
    kept = {n: c for n, c in source.channels.items() if n.startswith(("pose.", "command."))}
    found = prepare(replace(source, channels=kept), nigel)
    assert [p.name for p in found.problems] == ["unit"]
    np.testing.assert_allclose(found.recordings[0].channel("pose.x").values, clean["pose.x"])


@pytest.mark.parametrize("to", [0.0, None])
def test_a_counter_that_begins_anew_is_joined(
    clean: dict[str, Floats], nigel: Car, to: float | None
) -> None:
    counts = clean["encoder.left"].copy()
    counts[900:] -= 20_000.0 if to is None else counts[900]
    found = screen(recording(changed(clean, encoder_left=counts)), nigel)
    assert names(found) == ["restart"]
    assert "row 901 from" in said(found)
    np.testing.assert_allclose(
        found.recording.channel("encoder.left").values, clean["encoder.left"], atol=10.0
    )


@pytest.mark.parametrize("row", [30, 500, 1498])
@pytest.mark.parametrize("name", ["pose.x", "pose.y"])
def test_one_pose_off_costs_one_row_of_the_pose(
    clean: dict[str, Floats], nigel: Car, row: int, name: str
) -> None:
    found = screen(recording({**clean, name: at(clean[name], row, clean[name][row] + 0.3)}), nigel)
    assert names(found) == ["spike"]
    assert f"Row {row + 1} lies up to 0." in said(found)
    for channel in POSE:
        assert len(found.recording.channel(channel).t) == 1499
    assert len(found.recording.channel("command.throttle").t) == 1500


def test_poses_off_for_some_rows_cost_those_rows(clean: dict[str, Floats], nigel: Car) -> None:
    x = clean["pose.x"].copy()
    x[600:615] += 1.0
    found = screen(recording({**clean, "pose.x": x}), nigel)
    assert names(found) == ["spike"]
    assert "15 rows left out" in said(found)
    assert found.jumps == ()


def test_a_car_that_is_carried_away_is_cut_there(clean: dict[str, Floats], nigel: Car) -> None:
    x = clean["pose.x"].copy()
    x[700:] += 1.0
    found = screen(recording({**clean, "pose.x": x}), nigel)
    assert names(found) == ["jump"]
    (jump,) = found.jumps
    assert jump == pytest.approx((13.98, 14.0))
    assert len(found.recording.channel("pose.x").t) == 1500


def test_yaw_interpolated_through_half_a_turn_costs_those_rows(
    clean: dict[str, Floats], nigel: Car
) -> None:
    """Straight lines between rows of 10 Hz: where the angle wraps they pass through zero."""
    yaw = wrapped(clean["pose.yaw"] + math.pi - 1.0)
    crossings = int((np.abs(np.diff(yaw)) > 3.0).sum())
    assert crossings >= 1
    slow = np.interp(clean["t"], clean["t"][3::5], yaw[3::5])
    found = screen(recording({**clean, "pose.yaw": slow}), nigel)
    assert names(found) == ["spike"]
    now = found.recording.channel("pose.yaw")
    true = np.interp(now.t, clean["t"], np.unwrap(yaw))
    assert np.abs(wrapped(now.values - true)).max() < 0.05
    assert len(now.t) >= 1500 - 5 * crossings - 2


@pytest.mark.parametrize("name", RATES)
def test_a_spike_of_a_rate_costs_one_row(clean: dict[str, Floats], nigel: Car, name: str) -> None:
    found = screen(recording({**clean, name: at(clean[name], 900, 400.0)}), nigel)
    assert names(found) == ["spike"]
    assert f"{name}: Row 901 reaches 400" in said(found)
    assert len(found.recording.channel(name).t) == 1499


def test_one_absurd_command_costs_one_row(clean: dict[str, Floats], nigel: Car) -> None:
    throttle = at(clean["command.throttle"], 900, 6000.0)
    found = screen(recording({**clean, "command.throttle": throttle}), nigel)
    assert names(found) == ["spike"]
    assert len(found.recording.channel("command.throttle").t) == 1499


def test_what_a_faster_car_can_do_is_no_spike(clean: dict[str, Floats]) -> None:
    fast = {**clean, **{name: 10.0 * clean[name] for name in ("pose.x", "pose.y")}}
    found = screen(recording(fast), load_car("nigel"))
    assert found.problems == ()


def test_noise_of_a_centimetre_is_no_spike(clean: dict[str, Floats], nigel: Car) -> None:
    rng = np.random.default_rng(0)
    noisy = dict(clean)
    for name, std in (("pose.x", 0.01), ("pose.y", 0.01), ("pose.yaw", 0.03)):
        noisy[name] = clean[name] + std * rng.standard_normal(1500)
    assert screen(recording(noisy), nigel).problems == ()


def test_a_pose_that_freezes_and_catches_up_is_no_spike(
    clean: dict[str, Floats], nigel: Car
) -> None:
    frozen = dict(clean)
    for name in POSE:
        frozen[name] = clean[name].copy()
        frozen[name][700:715] = clean[name][699]
    assert screen(recording(frozen), nigel).problems == ()


def written(folder: Path, columns: dict[str, Floats], time_unit: str = "s") -> Path:
    """Write columns as a table with its description, and return its folder."""
    units = {
        "length": "m",
        "angle": "rad",
        "count": "count",
        "speed": "m/s",
        "ratio": '"1"',
        "angular speed": "rad/s",
    }
    lines = [f"      {n}: {{column: {n}, unit: {units[dimension(n)]}}}" for n in COLUMNS[1:]]
    (folder / "recording.yaml").write_text(
        "recording: 1\nvehicle: nigel\ntables:\n  - file: d.csv\n"
        f"    time: {{column: t, unit: {time_unit}}}\n    channels:\n" + "\n".join(lines) + "\n"
    )
    rows = zip(*(columns[name].tolist() for name in COLUMNS), strict=True)
    text = ["", *(",".join("" if math.isnan(v) else repr(v) for v in row) for row in rows)]
    (folder / "d.csv").write_text(",".join(COLUMNS) + "\n".join(text) + "\n")
    return folder


def test_the_account_counts_the_rows_of_the_file(
    clean: dict[str, Floats], nigel: Car, tmp_path: Path
) -> None:
    bad = changed(clean, t=at(clean["t"] + EPOCH_S, 0, 0.0))
    bad["encoder.left"] = at(at(bad["encoder.left"], 10, math.nan), 900, 0.0)
    (source,) = read_recordings(written(tmp_path, bad))
    account = prepare(source, nigel).account
    assert account[0] == "read d.csv: 1500 rows"
    text = "\n".join(account)
    assert "encoder.left: 1 of 1500 rows holds no number. 1 row left out." in text
    assert "Row 1 is stamped 0 s, the others near 1.7e+09 s. 1 row left out." in text
    assert "encoder.left: Row 901 is" in text


def test_strict_refuses_what_would_have_to_be_repaired(
    clean: dict[str, Floats], nigel: Car
) -> None:
    bad = recording(changed(clean, t=at(clean["t"] + EPOCH_S, 0, 0.0)))
    with pytest.raises(RecordingError, match="Row 1 is stamped 0 s"):
        prepare(bad, nigel, strict=True)
    assert prepare(recording(clean), nigel, strict=True).recordings
