"""The whole city as a user starts it: all parts up, cars driven and pictured, deaths, an end."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import httpx
import numpy as np
import pytest

from scm.__main__ import main
from scm.recorder.mcap_file import read_run
from scm.recording.read import read_recordings
from tests.e2e.city_process import CityProcess, city, wait_for

PARTS = {"world", "traffic", "monitor", "eye", "camera", "api", "record"}


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[CityProcess]:
    """One city for all tests: each leaves it as it found it, and the last one ends it."""
    with city(tmp_path_factory.mktemp("runs")) as process:
        yield process


@pytest.fixture(scope="module")
def begun(running: CityProcess) -> dict[str, Any]:
    """Where the six cars were at first; red lights let some of them begin much later."""
    wait_for(lambda: len(cars_of(running)) == 6, 90.0, "six cars are on the map")
    return cars_of(running)


def cars_of(running: CityProcess) -> dict[str, Any]:
    return {row["vehicle"]: row for row in running.get("/vehicles")["vehicles"]}


def events_of(running: CityProcess, vehicle: str) -> list[str]:
    told = running.get("/events")["items"]
    return [event["name"] for event in told if event.get("vehicle") == vehicle]


def alive_stations(running: CityProcess) -> set[str]:
    return {row["name"] for row in running.get("/stations")["stations"] if row["alive"]}


def test_every_part_and_six_cars_come_up(running: CityProcess, begun: dict[str, Any]) -> None:
    expected = PARTS | {"n5", "n6"}
    wait_for(lambda: alive_stations(running) >= expected, 20.0, f"{expected} are all there")
    kinds = sorted(row["kind"] for row in begun.values())
    assert kinds == ["hosted"] * 4 + ["remote"] * 2


def test_it_prints_a_line_for_every_part_and_what_to_try_next(running: CityProcess) -> None:
    text = "\n".join(running.lines)
    for name in (*PARTS, "n5", "n6"):
        assert any(name in line.split() for line in running.lines), name
    for hint in ("vehicle-agent join", "examples/", "Ctrl-C"):
        assert hint in text


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
    seen: dict[str, float] = {}

    def all_seen() -> bool:
        for name, row in cars_of(running).items():
            if row["eye"] is not None:
                seen.setdefault(name, row["eye"]["position_mm"])
        return len(seen) == 6

    wait_for(all_seen, 60.0, "the Eye has seen six cars")
    # at 0.27 m/s and up to 50 ms between the two samples a car itself moves 13 mm
    assert max(seen.values()) < 25.0, seen


def detail_of_camera(running: CityProcess) -> str:
    """Return what the camera part says of itself."""
    stations = running.get("/stations")["stations"]
    return str(next(row["detail"] for row in stations if row["name"] == "camera"))


def test_a_city_pictures_what_is_watched_and_nothing_else(running: CityProcess) -> None:
    idle = lambda: detail_of_camera(running) == "nobody looks"  # noqa: E731
    wait_for(idle, 90.0, "the camera part tells of itself")
    wait_for(lambda: {"n1", "n5"} <= cars_of(running).keys(), 90.0, "both are on the map")
    for car in ("n1", "n5"):
        answer = running.web.get(f"/vehicles/{car}/camera/front.jpg", timeout=20.0)
        assert answer.status_code == 200, answer.text
        image = cv2.imdecode(np.frombuffer(answer.content, np.uint8), cv2.IMREAD_COLOR)
        assert image is not None
        assert image.shape == (720, 1280, 3)
    film = f"{running.url}/api/v1/vehicles/n1/camera/rear/film"
    with httpx.stream("GET", film, timeout=20.0) as answer:
        assert answer.headers["content-type"].startswith("multipart/x-mixed-replace")
        pieces, film_so_far = answer.iter_bytes(), bytearray()

        def is_shown() -> bool:  # a film that nobody reads any more is not pictured for long
            film_so_far.extend(next(pieces))
            enough = film_so_far.count(b"Content-Type: image/jpeg") >= 5
            return enough and "1 camera," in detail_of_camera(running)

        wait_for(is_shown, 60.0, "one camera is pictured", every_s=0.0)
    wait_for(idle, 60.0, "rendering ends with the film")
    assert running.get("/vehicles/n1/camera") == {"cameras": ["front", "rear"], "watched": []}


def test_the_cars_drive(running: CityProcess, begun: dict[str, Any]) -> None:
    def moved() -> bool:
        now = cars_of(running)
        return all(
            abs(now[name]["x_m"] - row["x_m"]) + abs(now[name]["y_m"] - row["y_m"]) > 0.3
            for name, row in begun.items()
        )

    wait_for(moved, 60.0, "all six cars have moved 0.3 m")


def test_a_car_plays_a_written_drive_is_recorded_and_goes_back_to_its_driver(
    running: CityProcess, tmp_path: Path
) -> None:
    (tmp_path / "a.csv").write_text(
        "t_s,throttle,steering\n0,0,0\n1,0.5,0\n3,0,0\n4,0,0\n", encoding="utf-8"
    )
    (tmp_path / "drive.yaml").write_text("drive: 1\ncommands: a.csv\n", encoding="utf-8")
    wait_for(lambda: "n1" in cars_of(running), 90.0, "n1 is on the map")
    arguments = ["play", str(tmp_path / "drive.yaml"), "--connect", running.endpoint]
    assert main([*arguments, "--vehicle", "n1", "--out", str(tmp_path / "out")]) == 0
    assert main([*arguments, "--vehicle", "n99", "--out", str(tmp_path / "no")]) == 2
    home = lambda: cars_of(running)["n1"]["owner"] == "world"  # noqa: E731
    wait_for(home, 120.0, "the city has its car again")
    (recording,) = read_recordings(tmp_path / "out")
    throttle, x, y = (recording.channel(n) for n in ("command.throttle", "pose.x", "pose.y"))
    began = x.t[0]
    assert throttle.values[throttle.t > began].max() == 0.5
    assert throttle.t[0] < began - 0.8, "a second before tells where its servo stood"
    assert 3.8 < throttle.t[-1] - began < 4.5
    assert len(x.t) > 60
    way = sum(abs(c.values[-1] - c.values[0]) for c in (x, y))
    assert 0.05 < way < 1.0


def test_another_car_joins_and_leaves_cleanly(running: CityProcess) -> None:
    agent = join(running, "n7")
    try:
        wait_for(lambda: "n7" in cars_of(running), 120.0, "n7 is on the map")
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
        wait_for(lambda: "n8" in cars_of(running), 120.0, "n8 is on the map")
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

    before = wait_for(session_of_eye, 90.0, "the eye is there")
    found = (re.fullmatch(r" *eye .* pid (\d+)", line) for line in running.lines)
    pid = next(int(match.group(1)) for match in found if match)
    os.kill(pid, signal.SIGKILL)
    wait_for(lambda: session_of_eye() not in (None, before), 90.0, "another eye is there")


def test_ctrl_c_ends_everything_within_two_seconds_and_leaves_a_recording(
    running: CityProcess,
) -> None:
    children = running.descendants()
    assert len(children) >= 7
    assert running.stop() < 2.0
    assert running.process.returncode == 0
    assert not [pid for pid in children if Path(f"/proc/{pid}").exists()]
    (recording,) = running.folder.glob("*.mcap")
    keys = {message.key.partition("@v1/city/")[2] for message in read_run(recording)}
    assert {"world/snapshot", "world/def", "tl/crossing/spat", "tl/crossing/mon"} <= keys


def join(running: CityProcess, name: str) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "vehicle_agent", "join", "--name", name]
    return subprocess.Popen([*command, "--connect", running.endpoint])


def end(agent: subprocess.Popen[bytes]) -> None:
    if agent.poll() is None:
        agent.kill()
    agent.wait(timeout=5.0)
