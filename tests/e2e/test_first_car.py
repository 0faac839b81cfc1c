"""The first car of a file must not stop the city while its kernel is compiled."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from scm.v2x.bus import Mailbox
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.presence import Presence
from scm.v2x.messages.spawn_request import SpawnReply, SpawnRequest
from scm.v2x.request_retry import send_request
from scm.v2x.router import Router, free_endpoint
from scm.vehicles.car import car_names
from tests.e2e.city_process import wait_for

COLD_START_S = 600.0  # all car files, on what other processes leave of the machine
MAX_STEP_MS = 3000  # to compile one car takes longer


@pytest.mark.timeout(900)
def test_every_car_file_is_compiled_before_the_world_opens(tmp_path: Path) -> None:
    with Router(free_endpoint()) as router, ZenohBus("city", "test", router.listen) as bus:
        here, statuses = Mailbox(100), Mailbox(1000)
        bus.subscribe(Presence, {"station": "world"}, here)
        command = [sys.executable, "-m", "scm", "world", "driving_school"]
        environment = {**os.environ, "SCM_CACHE_DIR": str(tmp_path)}
        world = subprocess.Popen([*command, "--connect", router.listen], env=environment)
        try:
            wait_for(here.drain, COLD_START_S, "the world is up")
            bus.subscribe(PartStatus, {"station": "world"}, statuses)
            for car in car_names():
                assert isinstance(send_request(bus, SpawnRequest(car=car)), SpawnReply), car
            reported = wait_for(statuses.drain, 120.0, "the world's status")
        finally:
            world.terminate()
            world.wait(timeout=5.0)
    steps_ms = [item.message.step_ms for item in reported if isinstance(item.message, PartStatus)]
    assert max(steps_ms) < MAX_STEP_MS
