"""`scm up --fleet`: only who has credentials enters the city, and what people set outlives parts.

What only a person may release, and the plan that was asked for, stay as they are when the process
that keeps them dies.
"""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import pytest

from scm.api.keys import KeyRing
from scm.client import Client
from scm.errors import LinkError
from scm.store.open import open_store
from scm.v2x.bus_zenoh import ZenohBus
from tests.e2e.city_process import CityProcess, city, wait_for

pytestmark = pytest.mark.e2e


def scm(*arguments: object) -> str:
    command = [sys.executable, "-m", "scm", *map(str, arguments)]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[CityProcess]:
    fleet = tmp_path_factory.mktemp("fleet") / "fleet.toml"
    scm("fleet", "add", "n9", "--fleet", fleet, "--role", "vehicle", "--password")
    runs = tmp_path_factory.mktemp("runs")
    keys = f"sqlite:{runs}/keys.db"
    admin = KeyRing(open_store(keys)).add("ann", "admin", 1)
    guarded = ("--fleet", str(fleet), "--keys", keys, "--state", f"sqlite:{runs}/state.db")
    guarded += ("--hosted", "1", "--agents", "1")
    with city(runs, *guarded) as process:
        process.web.headers["Authorization"] = f"Bearer {admin}"
        wait_for(
            lambda: len(process.get("/vehicles")["vehicles"]) == 2, 60.0, "two cars are on the map"
        )
        yield process


@pytest.fixture(scope="module")
def other(running: CityProcess) -> str:
    """Ask for another plan: its time comes with the next cycle, while the first tests run."""
    plan = {"brisk": "calm", "calm": "brisk"}[signals(running)["plan"]]
    body = {"plan": plan, "by": "ann"}
    running.web.put("/signals/crossing/plan", json=body).raise_for_status()
    return plan


def cars_of(running: CityProcess) -> dict[str, Any]:
    return {row["vehicle"]: row for row in running.get("/vehicles")["vehicles"]}


def signals(running: CityProcess) -> dict[str, Any]:
    return dict(running.get("/signals/crossing"))


def reset(running: CityProcess, reason: str) -> None:
    """Reset the monitor as a person, and wait until the plan runs again."""
    body = {"by": "ann", "reason": reason}
    running.web.post("/signals/crossing/monitor/reset", json=body).raise_for_status()
    wait_for(lambda: signals(running)["mode"] == "plan", 90.0, "signals run again")


@pytest.mark.usefixtures("other")
def test_who_has_no_credentials_stays_outside(running: CityProcess) -> None:
    with pytest.raises(LinkError):
        ZenohBus("city", "n8", running.endpoint, connect_timeout_s=1.0)


def tick(running: CityProcess) -> int:
    return int(running.get("/vehicles")["tick"])


def fault(running: CityProcess) -> str | None:
    monitor = signals(running)["monitor"]
    return None if monitor is None else monitor["fault"]


def detail(running: CityProcess) -> str:
    return str(signals(running)["monitor"]["detail"])


def press(running: CityProcess, *, engaged: bool) -> None:
    running.web.put("/stop", json={"engaged": engaged, "by": "ann"}).raise_for_status()


def test_cars_still_stand_when_the_world_dies_under_the_stop(running: CityProcess) -> None:
    wait_for(lambda: tick(running) > 300, 90.0, "6 s of the first world")
    press(running, engaged=True)
    running.kill("world")
    wait_for(lambda: 100 < tick(running) < 300, 90.0, "2 s of a new world")
    rows = wait_for(lambda: r if len(r := cars_of(running)) == 2 else None, 90.0, "both are back")
    assert {row["mode"] for row in rows.values()} == {"stop"}
    assert max(abs(row["speed_mps"]) for row in rows.values()) < 0.01
    press(running, engaged=False)


def test_a_fault_is_still_there_when_the_monitor_dies_and_ends_by_reset(
    running: CityProcess,
) -> None:
    with running.frozen("traffic"):  # a restart may be too quick for the monitor to miss it
        wait_for(lambda: fault(running) == "stale", 90.0, "the monitor saw the signals fall silent")
    state = open_store(f"sqlite:{running.folder}/state.db")  # it is seen before it is stored
    stored = lambda: any(key.startswith("monitor/") for key, _ in state.items("latches"))  # noqa: E731
    wait_for(stored, 30.0, "the fault is stored")
    running.kill("monitor")
    wait_for(lambda: "again" in detail(running), 90.0, "the new monitor has spoken")
    assert fault(running) == "stale"
    assert signals(running)["mode"] == "flash"
    reset(running, "traffic was frozen")


SCRIPT = """
import os, sys
from scm.client import Client
from scm.fleet import open_city

with open_city(connect=os.environ["SCM_CONNECT"]) as city:
    print(city.spawn("nigel", name="guest").name)
with Client(sys.argv[1]) as web:
    print(web.session.session().owner)
"""


def test_scripts_enter_as_an_operator_and_people_drive_by_their_keys(running: CityProcess) -> None:
    admin = running.web.headers["Authorization"].removeprefix("Bearer ")
    ring = KeyRing(open_store(f"sqlite:{running.folder}/keys.db"))
    with Client(running.url, admin) as ann:
        ann.scenarios.write("visit", text=SCRIPT, if_none_match="*")
    with Client(running.url, ring.add("ben", "operator", 1)) as ben:
        run = ben.wait(ben.scenarios.run("visit", arguments=(running.url,)), timeout_s=60.0)
        assert ben.scenarios.lines(run.id).lines == ("guest", "ben: visit")
        with ben.wheel("n1") as wheel:
            while wheel.drive(0.4, 0.0).why != "driving":
                pass
        assert wheel.over is not None
        assert wheel.over.code == "given_back"


def test_the_plan_asked_for_is_still_in_force_when_traffic_dies(
    running: CityProcess, other: str
) -> None:
    wait_for(lambda: signals(running)["plan"] == other, 60.0, "the other plan runs")
    with running.frozen("traffic"):  # so that the monitor surely sees it fall silent
        wait_for(lambda: fault(running) == "stale", 90.0, "the monitor has seen it")
        os.kill(running.pid("traffic"), signal.SIGKILL)
    wait_for(lambda: signals(running)["mode"] == "flash", 90.0, "the new one flashes")
    reset(running, "traffic was killed")
    assert signals(running)["plan"] == other
