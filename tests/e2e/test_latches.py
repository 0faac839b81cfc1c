"""What only a person may release stays as it is when the process that keeps it dies."""

from collections.abc import Iterator
from typing import Any

import pytest

from tests.e2e.city_process import CityProcess, city, wait_for


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[CityProcess]:
    """One city for both tests; each leaves it as it found it."""
    with city(tmp_path_factory.mktemp("runs"), "--hosted", "1", "--agents", "1") as process:
        wait_for(lambda: len(cars_of(process)) == 2, 40.0, "two cars are on the map")
        yield process


def cars_of(running: CityProcess) -> dict[str, Any]:
    return {row["vehicle"]: row for row in running.get("/vehicles")["vehicles"]}


def tick(running: CityProcess) -> int:
    return int(running.get("/vehicles")["tick"])


def fault(running: CityProcess) -> str | None:
    monitor = running.get("/signals/crossing")["monitor"]
    return None if monitor is None else monitor["fault"]


def detail(running: CityProcess) -> str:
    return str(running.get("/signals/crossing")["monitor"]["detail"])


def press(running: CityProcess, *, engaged: bool) -> None:
    running.web.put("/stop", json={"engaged": engaged, "by": "ann"}).raise_for_status()


def test_cars_still_stand_when_the_world_dies_under_the_stop(running: CityProcess) -> None:
    wait_for(lambda: tick(running) > 300, 20.0, "6 s of the first world")
    press(running, engaged=True)
    running.kill("world")
    wait_for(lambda: 100 < tick(running) < 300, 20.0, "2 s of a new world")
    rows = wait_for(lambda: r if len(r := cars_of(running)) == 2 else None, 20.0, "both are back")
    assert {row["mode"] for row in rows.values()} == {"stop"}
    assert max(abs(row["speed_mps"]) for row in rows.values()) < 0.01
    press(running, engaged=False)


def test_a_fault_is_still_there_when_the_monitor_dies_and_ends_by_reset(
    running: CityProcess,
) -> None:
    with running.frozen("traffic"):  # a restart may be too quick for the monitor to miss it
        wait_for(lambda: fault(running) == "stale", 5.0, "the monitor saw the signals fall silent")
    running.kill("monitor")
    wait_for(lambda: "again" in detail(running), 5.0, "the new monitor has spoken")
    assert fault(running) == "stale"
    assert running.get("/signals/crossing")["mode"] == "flash"
    body = {"by": "ann", "reason": "traffic was frozen"}
    running.web.post("/signals/crossing/monitor/reset", json=body).raise_for_status()
    wait_for(lambda: running.get("/signals/crossing")["mode"] == "plan", 20.0, "signals run again")
