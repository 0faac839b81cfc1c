"""The whole city as a user starts it: all parts up, cars moving, deaths noticed, a clean end."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from scm.recorder.mcap_file import read_run
from tests.e2e.city_process import CityProcess, city, wait_for

PARTS = {"world", "traffic", "monitor", "eye", "camera", "api", "record"}


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[CityProcess]:
    """One city for all tests that leave it as they found it."""
    with city(tmp_path_factory.mktemp("runs")) as process:
        yield process


def cars_of(running: CityProcess) -> dict[str, Any]:
    return {row["vehicle"]: row for row in running.get("/vehicles")["vehicles"]}


def events_of(running: CityProcess, vehicle: str) -> list[str]:
    told = running.get("/events")["items"]
    return [event["name"] for event in told if event.get("vehicle") == vehicle]


def alive_stations(running: CityProcess) -> set[str]:
    return {row["name"] for row in running.get("/stations")["stations"] if row["alive"]}


def test_every_part_and_six_cars_come_up(running: CityProcess) -> None:
    expected = PARTS | {"n5", "n6"}
    wait_for(lambda: alive_stations(running) >= expected, 20.0, f"{expected} are all there")
    wait_for(lambda: len(cars_of(running)) == 6, 20.0, "six cars are on the map")
    kinds = sorted(row["kind"] for row in cars_of(running).values())
    assert kinds == ["hosted"] * 4 + ["remote"] * 2


def test_it_prints_a_line_for_every_part_and_what_to_try_next(running: CityProcess) -> None:
    text = "\n".join(running.lines)
    for name in (*PARTS, "n5", "n6"):
        assert any(name in line.split() for line in running.lines), name
    for hint in ("vehicle-agent join", "examples/", "Ctrl-C"):
        assert hint in text


def test_the_cars_drive(running: CityProcess) -> None:
    wait_for(lambda: len(cars_of(running)) == 6, 20.0, "six cars are on the map")
    before = cars_of(running)

    def moved() -> bool:
        now = cars_of(running)
        return all(
            abs(now[name]["x_m"] - row["x_m"]) + abs(now[name]["y_m"] - row["y_m"]) > 0.3
            for name, row in before.items()
        )

    wait_for(moved, 60.0, "all six cars have moved 0.3 m")


def test_the_signals_change_and_tell_when(running: CityProcess) -> None:
    def colours() -> set[str]:
        return {group["colour"] for group in running.get("/signals/crossing")["groups"]}

    seen: set[str] = set()

    def all_seen() -> bool:
        seen.update(colours())
        return {"red", "yellow", "green"} <= seen

    wait_for(all_seen, 60.0, "red, yellow and green have been shown")
    groups = running.get("/signals/crossing")["groups"]
    assert all(group["min_s"] is not None for group in groups)


def test_the_eye_sees_every_car_within_a_centimetre(running: CityProcess) -> None:
    def residuals() -> list[float]:
        rows = cars_of(running).values()
        return [row["eye"]["position_mm"] for row in rows if row["eye"] is not None]

    seen = wait_for(
        lambda: r if len(r := residuals()) == 6 else None, 20.0, "the Eye sees six cars"
    )
    # at 0.27 m/s and up to 50 ms between the two samples a car itself moves 13 mm
    assert max(seen) < 25.0


def test_another_car_joins_and_leaves_cleanly(running: CityProcess) -> None:
    agent = join(running, "n7")
    try:
        wait_for(lambda: "n7" in cars_of(running), 40.0, "n7 is on the map")
        began = time.monotonic()
        agent.send_signal(signal.SIGINT)
        assert agent.wait(timeout=5.0) == 0
        assert time.monotonic() - began < 1.5
        wait_for(lambda: "n7" not in cars_of(running), 2.0, "n7 has left the map")
        assert "vehicle_left" in events_of(running, "n7")
        assert "vehicle_lost" not in events_of(running, "n7")
    finally:
        end(agent)


def test_a_killed_car_is_noticed_within_one_and_a_half_seconds(running: CityProcess) -> None:
    agent = join(running, "n8")
    try:
        wait_for(lambda: "n8" in cars_of(running), 40.0, "n8 is on the map")
        os.kill(agent.pid, signal.SIGKILL)
        noticed = "the city shows n8 as lost"
        wait_for(lambda: not cars_of(running).get("n8", {"alive": False})["alive"], 1.5, noticed)
        assert "vehicle_lost" in events_of(running, "n8")
    finally:
        end(agent)


def test_a_part_that_dies_is_started_again(running: CityProcess) -> None:
    def session_of_eye() -> str | None:
        rows = running.get("/stations")["stations"]
        return next((r["session"] for r in rows if r["name"] == "eye" and r["alive"]), None)

    before = wait_for(session_of_eye, 20.0, "the eye is there")
    found = (re.fullmatch(r" *eye .* pid (\d+)", line) for line in running.lines)
    pid = next(int(match.group(1)) for match in found if match)
    os.kill(pid, signal.SIGKILL)
    wait_for(lambda: session_of_eye() not in (None, before), 20.0, "another eye is there")


def test_ctrl_c_ends_everything_within_two_seconds_and_leaves_a_recording(tmp_path: Path) -> None:
    with city(tmp_path, "--agents", "1", "--hosted", "1") as process:
        wait_for(lambda: len(cars_of(process)) == 2, 40.0, "two cars are on the map")
        children = process.descendants()
        assert len(children) >= 7
        assert process.stop() < 2.0
        assert process.process.returncode == 0
        assert not [pid for pid in children if Path(f"/proc/{pid}").exists()]
    (recording,) = tmp_path.glob("*.mcap")
    keys = {message.key.partition("@v1/city/")[2] for message in read_run(recording)}
    assert {"world/snapshot", "world/def", "tl/crossing/spat", "tl/crossing/mon"} <= keys


def join(running: CityProcess, name: str) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "vehicle_agent", "join", "--name", name]
    return subprocess.Popen([*command, "--connect", running.endpoint])


def end(agent: subprocess.Popen[bytes]) -> None:
    if agent.poll() is None:
        agent.kill()
    agent.wait(timeout=5.0)
