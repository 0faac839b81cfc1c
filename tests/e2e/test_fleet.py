"""A car drives its own car in a city that lets in only its fleet, and nothing else."""

import os
import subprocess
import sys
from contextlib import ExitStack
from datetime import UTC, datetime

import pytest
import zenoh

from scm.clock import NS_PER_S
from scm.v2x import zenoh_config
from scm.v2x.access import guard_of, own_stations
from scm.v2x.bus import Mailbox
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.credentials import read_credentials
from scm.v2x.fleet_file import Fleet, add
from scm.v2x.message import Refused, encode
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.lease_request import LeaseRequest
from scm.v2x.messages.remove_request import RemoveRequest
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.spawn_request import SpawnRequest
from scm.v2x.messages.stop_request import StopRequest
from scm.v2x.messages.world_snapshot import WorldSnapshot
from scm.v2x.request_retry import send_request
from scm.v2x.router import Router, free_endpoint
from tests.e2e.city_process import START_S, wait_for

MOVED_M = 0.3


class Guarded:
    """A small city behind a guarded router, one car of it the world's and one an agent's."""

    def __init__(self, folder, auth, stack):
        self.stack = stack
        self.fleet = Fleet(folder / "fleet.toml", auth)
        now = datetime.now(UTC)
        for name, role in (("n7", "vehicle"), ("n8", "vehicle"), ("anna", "operator")):
            add(self.fleet, name, role, now)
        scheme = "tls/" if auth == "mtls" else "tcp/"
        listen = free_endpoint().replace("tcp/", scheme)
        guard = guard_of(self.fleet.path, "city", listen, own_stations(("eye",), ()), now)
        self.endpoint = guard.connect
        stack.enter_context(Router(guard.listen, guard.settings))
        self.operator = self.bus("anna")
        self.boxes = {kind: Mailbox(5000) for kind in (WorldSnapshot, Spat, CityStop)}
        for kind, box in self.boxes.items():
            self.operator.subscribe(kind, {}, box)
        self.newest = None

    def bus(self, name):
        credentials = read_credentials(self.fleet.credentials(name))
        return self.stack.enter_context(
            ZenohBus("city", name, self.endpoint, credentials=credentials)
        )

    def start(self, name, *command):
        who = ("--connect", self.endpoint, "--credentials", str(self.fleet.credentials(name)))
        child = subprocess.Popen([sys.executable, "-m", *command, *who], env=dict(os.environ))
        self.stack.callback(child.wait, timeout=10.0)
        self.stack.callback(child.terminate)
        return child

    def cars(self):
        for item in self.boxes[WorldSnapshot].drain():
            self.newest = item.message
        return {car.vehicle: car for car in self.newest.vehicles} if self.newest else {}

    def moved(self, name, since):
        car = self.cars().get(name)
        return car is not None and abs(car.x_m - since.x_m) + abs(car.y_m - since.y_m) > MOVED_M


@pytest.fixture(scope="module", params=["password", "mtls"])
def guarded(request, tmp_path_factory):
    with ExitStack() as stack:
        city = Guarded(tmp_path_factory.mktemp(request.param), request.param, stack)
        city.start("world", "scm", "world", "driving_school", "--hosted", "1")
        city.start("traffic", "scm", "traffic", "driving_school")
        city.start("monitor", "scm", "monitor", "driving_school")
        wait_for(city.cars, START_S, "the world speaks")
        city.start("n7", "vehicle_agent", "join", "--name", "n7")
        wait_for(lambda: "n7" in city.cars(), START_S, "n7 is in the city")
        yield city


def test_a_car_with_its_own_credentials_drives(guarded):
    begun = guarded.cars()["n7"]
    wait_for(lambda: guarded.moved("n7", begun), 120.0, "n7 drives")


def test_another_car_cannot_drive_remove_or_stop_it_nor_forge_signals(guarded):
    thief = guarded.bus("n8")
    settings = read_credentials(guarded.fleet.credentials("n8")).client_settings()
    config = zenoh.Config.from_json5(zenoh_config.client(guarded.endpoint, 2.0, settings))
    raw = guarded.stack.enter_context(zenoh.open(config))
    wait_for(guarded.boxes[Spat].drain, 60.0, "signals are shown")
    for request in (
        RemoveRequest(vehicle="n7"), StopRequest(engaged=True, by="n8"), SpawnRequest(),
        LeaseRequest(vehicle="n7", owner="n8", verb="steal", reason="mine"),
    ):  # fmt: skip
        assert isinstance(send_request(thief, request, 0.5), Refused)
    stop = CityStop(t_ns=NS_PER_S, engaged=True, by="n8")
    green = Spat(junction="crossing", t_ns=1, seq=1, mode="plan", plan="forged", groups=())
    brake = DriveCommand(vehicle="n7", t_ns=1, epoch=10**6, seq=1, throttle=-1.0, steering=0.0)
    begun = guarded.cars()["n7"]
    for _ in range(20):
        for key, message in (
            ("world/stop", stop),
            ("tl/crossing/spat", green),
            ("v/n7/cmd/drive", brake),
        ):
            raw.put(f"scm/@v1/city/{key}", encode(message)[0])
    wait_for(lambda: guarded.moved("n7", begun), 120.0, "n7 drives on")
    assert {item.message.plan for item in guarded.boxes[Spat].drain()} & {"forged"} == set()
    assert not any(item.message.engaged for item in guarded.boxes[CityStop].drain())


def test_an_operator_stops_the_city_and_lets_it_go(guarded):
    for engaged in (True, False):
        told = send_request(guarded.operator, StopRequest(engaged=engaged, by="anna"), 2.0)
        assert isinstance(told, CityStop)
        assert told.engaged is engaged
