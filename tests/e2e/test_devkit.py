"""A Devkit script under its own libraries, both generations, drives a car of a running city.

The script is `tests/devkit/script.py`; its libraries are installed once, into an environment of its
own. World, bridge and script are processes.
"""

import json
import os
import signal
import subprocess
import sys

import pytest

from scm.v2x.bus import Mailbox
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.messages.world_snapshot import WorldSnapshot
from scm.v2x.router import Router, free_endpoint
from tests.devkit.generations import GENERATIONS, SCRIPT, NotToBeHadError, python_of
from tests.e2e.city_process import wait_for

START_S = 60.0  # a cold start compiles the physics
CRASH_AT = 5


class Stage:
    """A world, and an ear on its bus."""

    def __init__(self, router):
        self.endpoint = router.listen
        command = ["-m", "scm", "world", "driving_school", "--connect", router.listen]
        self.world = subprocess.Popen([sys.executable, *command, "--hosted", "0"])
        self.bus = ZenohBus("city", "test", router.listen)
        self.box = Mailbox(5000)
        self.bus.subscribe(WorldSnapshot, {}, self.box)
        self.cars = None

    def car(self, name):
        for item in self.box.drain():
            self.cars = {row.vehicle: row for row in item.message.vehicles}
        return (self.cars or {}).get(name)

    def is_up(self):
        self.car("")
        return self.cars is not None

    def close(self):
        self.bus.close()
        end(self.world)


def end(process, how=signal.SIGTERM):
    """End a process and return its exit code."""
    if process.poll() is None:
        process.send_signal(how)
    try:
        return process.wait(timeout=8.0)
    finally:
        process.kill()


@pytest.fixture(scope="module")
def stage():
    with Router(free_endpoint()) as router:
        made = Stage(router)
        try:
            wait_for(made.is_up, START_S, "the world is there")
            yield made
        finally:
            made.close()


class Script:
    """The script as a process; port 0 is a free one."""

    def __init__(self, python, folder, port, *options):
        self.log = folder / "log"
        alone = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
        self.process = subprocess.Popen(
            [python, "-W", "ignore", str(SCRIPT), str(port), str(self.log), *options],
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=alone,
        )  # fmt: skip
        self.port = int(self.process.stdout.readline().split()[1])

    def packets(self):
        text = self.log.read_text()
        return [json.loads(line) for line in text[: text.rfind("\n") + 1].splitlines()]

    def kill(self):
        self.process.kill()
        self.process.wait(timeout=5.0)
        self.process.stdout.close()


def bridge(stage, port, name):
    command = ["-m", "vehicle_agent", "devkit", "--connect", stage.endpoint, "--script-port"]
    command += [str(port), "--car", name, "--spawn", "--cameras"]
    return subprocess.Popen([sys.executable, *command])


@pytest.mark.e2e
@pytest.mark.parametrize("generation", GENERATIONS)
def test_a_script_drives_loses_a_packet_dies_and_drives_again(stage, tmp_path, generation):
    try:
        python = python_of(generation)
    except NotToBeHadError as cause:
        pytest.skip(f"the script's libraries cannot be installed: {cause}")
    name = "v" + generation[0]
    turn = ("--throttle", "0.6", "--steering", "1.0")
    script = Script(python, tmp_path, 0, *turn, "--crash-at", str(CRASH_AT))
    agent = bridge(stage, script.port, name)
    owner = f"devkit-{script.port}"

    def drives():
        car = stage.car(name)
        return car is not None and car.owner == owner and car.speed_mps > 0.08

    try:
        wait_for(drives, START_S, "the car drives although the script failed on a packet")
        wait_for(lambda: len(script.packets()) > 150, 90.0, "packets flow")
        seen = [packet["pid_packets"] for packet in script.packets()]
        assert seen == [n for n in range(1, len(seen) + 2) if n != CRASH_AT]
        first, last = script.packets()[0]["V1"], script.packets()[-1]["V1"]
        assert last["ticks"][1] > first["ticks"][1] + 100
        assert last["size"] == [1280, 720]
        car = stage.car(name)
        assert car.steering_rad > 0.4
        script.kill()
        wait_for(lambda: stage.car(name).owner == "world", 120.0, "the lease is given back")
        script = Script(python, tmp_path, script.port, *turn)
        wait_for(drives, 90.0, "the script that came back drives")
        assert end(agent, signal.SIGINT) == 0
        wait_for(lambda: stage.car(name) is None, 120.0, "the car it brought is taken away")
    finally:
        end(agent, signal.SIGKILL)
        script.kill()
