"""`scm up --fleet`: only who has credentials enters the city, and a plan outlives its process."""

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
    guarded = ("--fleet", str(fleet), "--keys", keys, "--hosted", "1", "--agents", "1")
    with city(runs, *guarded) as process:
        process.web.headers["Authorization"] = f"Bearer {admin}"
        wait_for(
            lambda: len(process.get("/vehicles")["vehicles"]) == 2, 60.0, "two cars are on the map"
        )
        yield process


def test_who_has_no_credentials_stays_outside(running: CityProcess) -> None:
    with pytest.raises(LinkError):
        ZenohBus("city", "n8", running.endpoint, connect_timeout_s=1.0)


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


def test_the_plan_asked_for_is_still_in_force_when_traffic_dies(running: CityProcess) -> None:
    def signals() -> dict[str, Any]:
        return dict(running.get("/signals/crossing"))

    other = {"brisk": "calm", "calm": "brisk"}[signals()["plan"]]
    body = {"plan": other, "by": "ann"}
    running.web.put("/signals/crossing/plan", json=body).raise_for_status()
    wait_for(lambda: signals()["plan"] == other, 60.0, "the other plan runs")
    with running.frozen("traffic"):  # so that the monitor surely sees it fall silent
        wait_for(lambda: signals()["monitor"]["fault"] == "stale", 5.0, "the monitor has seen it")
        os.kill(running.pid("traffic"), signal.SIGKILL)
    wait_for(lambda: signals()["mode"] == "flash", 20.0, "the new one flashes")
    body = {"by": "ann", "reason": "traffic was killed"}
    running.web.post("/signals/crossing/monitor/reset", json=body).raise_for_status()
    wait_for(lambda: signals()["mode"] == "plan", 20.0, "the new one runs a plan")
    assert signals()["plan"] == other
