"""A car's program as a process of its own, beside a real world and real signals."""

import os
import signal
import subprocess
import sys
import time

import pytest

from scm.v2x.bus import Mailbox
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.messages.presence import Presence
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.world_snapshot import WorldSnapshot
from scm.v2x.router import Router, free_endpoint
from tests.e2e.city_process import wait_for

START_S = 60.0  # a cold start compiles the physics


class Stage:
    """A router in this process, parts as children, and an ear on the bus."""

    def __init__(self, endpoint):
        self.endpoint = endpoint
        self.children = []
        self.bus = ZenohBus("city", "test", endpoint)
        self.boxes = {kind: Mailbox(5000) for kind in (VehicleState, WorldSnapshot, Presence)}
        self.newest = {}
        for kind, box in self.boxes.items():
            self.bus.subscribe(kind, {}, box)

    def start(self, *command):
        child = subprocess.Popen([sys.executable, "-m", *command], stderr=subprocess.PIPE)
        self.children.append(child)
        return child

    def part(self, name):
        return self.start("scm", name, "driving_school", "--connect", self.endpoint)

    def agent(self, name, *more):
        return self.start(
            "vehicle_agent", "join", "--name", name, "--connect", self.endpoint, *more
        )

    def state(self, name):
        for item in self.boxes[VehicleState].drain():
            self.newest[item.message.vehicle] = item.message
        return self.newest.get(name)

    def vehicles(self):
        for item in self.boxes[WorldSnapshot].drain():
            self.newest[WorldSnapshot] = item.message
        snapshot = self.newest.get(WorldSnapshot)
        return {} if snapshot is None else {car.vehicle: car for car in snapshot.vehicles}

    def forget(self):
        self.state("")
        self.vehicles()
        self.newest.clear()

    def close(self):
        for child in self.children:
            if child.poll() is None:
                child.kill()
            child.wait(timeout=5.0)
            child.stderr.close()
        self.bus.close()


@pytest.fixture(scope="module")
def stage():
    with Router(free_endpoint()) as router:
        made = Stage(router.listen)
        try:
            made.world = made.part("world")
            made.part("traffic")
            yield made
        finally:
            made.close()


@pytest.fixture
def driving(stage):
    """A car that drives, and is gone afterwards."""
    stage.forget()
    child = stage.agent("n7")
    moves = lambda: (state := stage.state("n7")) and state.speed_mps > 0.05  # noqa: E731
    wait_for(moves, START_S, "n7 drives")
    yield child
    if child.poll() is None:
        child.send_signal(signal.SIGINT)  # it says goodbye: nobody waits until it is missed
        child.wait(timeout=5.0)
    wait_for(lambda: "n7" not in stage.vehicles(), 60.0, "n7 is off the map")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_makes_it_leave_within_a_second(stage, driving, number):
    began = time.monotonic()
    driving.send_signal(number)
    assert driving.wait(timeout=5.0) == 0
    assert time.monotonic() - began < 1.0
    wait_for(lambda: "n7" not in stage.vehicles(), 1.5, "the map is empty at once")


def test_a_killed_agent_is_off_the_map_in_the_end(stage, driving):
    os.kill(driving.pid, signal.SIGKILL)
    wait_for(lambda: not alive(stage, "n7"), 1.5, "its death is known")
    wait_for(lambda: "n7" not in stage.vehicles(), 60.0, "its car is taken away")


def test_a_frozen_agent_drives_on_only_under_a_newer_epoch(stage, driving):
    before = stage.state("n7").epoch
    driving.send_signal(signal.SIGSTOP)
    try:
        wait_for(lambda: not alive(stage, "n7"), 3.0, "its silence is known")
    finally:
        driving.send_signal(signal.SIGCONT)
    stage.forget()

    def goes_on():
        state = stage.state("n7")
        return state is not None and state.speed_mps > 0.05 and state.mode == "drive"

    wait_for(goes_on, 60.0, "n7 drives again")
    assert stage.state("n7").epoch != before


def test_a_world_that_comes_back_is_joined_again(stage, driving):
    stage.world.kill()
    stage.world.wait(timeout=5.0)

    def stands():
        state = stage.state("n7")
        return state is not None and state.mode == "stop" and abs(state.speed_mps) < 0.01

    wait_for(stands, 3.0, "n7 stops without a city")
    stage.world = stage.part("world")
    wait_for(lambda: "n7" in stage.vehicles(), START_S, "n7 is on the map again")
    moves = lambda: (state := stage.state("n7")) and state.speed_mps > 0.05  # noqa: E731
    wait_for(moves, 90.0, "n7 drives again")


def test_a_second_car_of_the_same_name_waits_outside_and_then_gives_up(stage, driving):
    second = stage.agent("n7")
    with pytest.raises(subprocess.TimeoutExpired):
        second.wait(timeout=4.0)
    assert len(stage.vehicles()) == 1
    _, said = second.communicate(timeout=20.0)
    assert second.returncode == 2
    assert b"already one named 'n7'" in said
    assert "n7" in stage.vehicles()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--name", "N 7", "--connect", "tcp/127.0.0.1:1"), "--name"),
        (("--name", "n7", "--connect", "tcp/127.0.0.1:1"), "tcp/127.0.0.1:1"),
    ],
)
def test_bad_input_ends_with_2_and_says_why(arguments, words):
    command = [sys.executable, "-m", "vehicle_agent", "join", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=30.0, check=False)
    assert done.returncode == 2
    assert words in done.stderr
    assert ".rs:" not in done.stderr


def test_an_unknown_car_file_ends_with_2_and_names_the_nearest(stage):
    child = stage.agent("n9", "--car", "nigal")
    _, said = child.communicate(timeout=30.0)
    assert child.returncode == 2
    assert b"nigel" in said


def test_a_place_that_the_map_does_not_have_ends_with_2_and_no_traceback(stage):
    child = stage.agent("n9", "--spawn", "zz")
    _, said = child.communicate(timeout=30.0)
    assert child.returncode == 2
    assert b"no spawn 'zz'" in said
    assert b"Traceback" not in said


def test_help_shows_an_example():
    command = [sys.executable, "-m", "vehicle_agent", "join", "--help"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=30.0, check=True)
    assert "vehicle-agent join --name n7" in done.stdout


def alive(stage, name):
    car = stage.vehicles().get(name)
    return car is not None and car.alive
